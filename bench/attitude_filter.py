"""Runs the attitude filter of docs/how-to/sensors.md as it is printed there, and draws its error into docs/images."""

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigid_body_sim.command_line import Parser

PAGE, PICTURE = "how-to/sensors.md", "images/attitude_filter.png"
LINES = {"drifting": ("gyroscopes alone", "#b0413e"), "filtered": ("with weight and north", "#27517d")}


def computed(page: str) -> dict[str, Any]:
    """What the page's program has come to, by the names in it."""
    (text,) = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    names: dict[str, Any] = {}
    exec(compile(text, PAGE, "exec"), names)
    return names


def main(args: Sequence[str] | None = None) -> int:
    """Draw it."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    parser = Parser("attitude_filter", "Draws the error of the attitude filter in the documentation.")
    parser.add_argument("folder", type=Path, nargs="?", default=Path("docs"), help="of the pages (default %(default)s)")
    folder = parser.parse_args(args).folder
    found = computed((folder / PAGE).read_text(encoding="utf-8"))
    figure, axes = pyplot.subplots(figsize=(8.0, 3.6), layout="constrained")
    for name, (label, colour) in LINES.items():
        axes.semilogy(found["run"].time, np.degrees(found[name]), color=colour, lw=1.2, label=label)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("error of the attitude [°]")
    axes.set_xlim(0.0, found["run"].time[-1])
    axes.grid(which="both", color="0.92")
    axes.legend(frameon=False, loc="center right", bbox_to_anchor=(1.0, 0.74))
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.savefig(folder / PICTURE, dpi=120)
    return 0


if __name__ == "__main__":
    sys.exit(main())
