"""The demo's table and picture, from a short recording."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim import load_scene
from rigid_body_sim.tools import demo_plot, findings
from rigid_body_sim.tools.heard import Heard

SCENE = load_scene(Path(__file__).parents[2] / "config/satellite.yaml")
TARGET = (1.0, 0.0, 0.0, 0.0)
REPORT = {"achieved rate [Hz]": "999.5", "real-time factor": "0.9995", "largest lateness [s]": "0.0031"}


@pytest.fixture
def recording() -> Heard:
    """Five poses of a body at rest, one of them missing."""
    stamps = 10_000_000 * np.array((0, 1, 2, 4, 5), np.int64)
    orientation = np.tile((0.8, 0.0, 0.6, 0.0), (5, 1))
    return Heard(stamps, orientation, np.zeros((5, 3)), stamps[1:2], np.zeros((1, 3)))


def test_table_says_what_was_heard(recording):
    rows = findings.table(recording, SCENE, TARGET, [REPORT, REPORT])
    assert rows["pointing error"].startswith("73.7 deg (1.29 rad) after 0.1 s")  # 2 acos 0.8
    assert rows["poses"].startswith("5 with their twists, 1 missing, stamps every 10 ms to 0 ns")
    assert rows["speed"] == "999.50 steps/s, real-time factor 0.99950, no step later than 3.1 ms"
    assert rows["energy mismatch"].startswith("0.0e+00 J")


def test_table_without_diagnostics(recording):
    assert "no diagnostics" in findings.table(recording, SCENE, TARGET, [])["speed"]


@pytest.mark.parametrize("commands", (0, 1))
def test_picture_is_drawn(recording, tmp_path, commands):
    pytest.importorskip("matplotlib")
    part = replace(recording, command_ns=recording.command_ns[:commands], torque=recording.torque[:commands])
    demo_plot.draw(part, TARGET, 0.05, "a title", tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 10_000  # bytes; measured 57 000 and 63 000
