"""Programs that make the reference solutions of rigid_body_sim/report/reference, by hand and for minutes."""

import pathlib

DATA = pathlib.Path(__file__).parents[2] / "rigid_body_sim/report/reference"
