"""The picture of rigid_body_resim: errors of position and attitude over time, or the motion where there are none.

Imports matplotlib only when it draws.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..kernels.arrays import Floats
from ..resim.comparison import Comparison, Tolerance
from ..runs import plot
from ..runs.plot import BLACK, BLUE, ORANGE
from . import picture

MOST_POINTS = 4000  # in a line; of more, the largest of each group of neighbours
_FLOOR = 1e-18  # what is zero has no place on a logarithmic axis


def draw(comparison: Comparison, tolerance: Tolerance, title: str, path: Path) -> None:
    """Write the picture to ``path``; its ending tells the format."""
    picture.save(
        _equal(comparison, title) if comparison.first_unequal is None else _errors(comparison, tolerance, title), path
    )


def _equal(comparison: Comparison, title: str) -> Any:
    """The motion, which both have."""
    motion = SimpleNamespace(position=comparison.recorded[:, :3], orientation=comparison.recorded[:, 3:7])
    count = len(comparison.recorded)
    return plot.stacked(plot.poses(comparison.time, motion), f"{title}: all {count} poses are equal to the bit")


def _errors(comparison: Comparison, tolerance: Tolerance, title: str) -> Any:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.4), dpi=120, layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    figure.suptitle(title, fontsize=13)
    diverged = comparison.divergence(tolerance)
    for panel, name, errors, most in (
        (panels[0], "position error [m]", comparison.position_error, tolerance.position),
        (panels[1], "attitude error [rad]", comparison.attitude_error, tolerance.attitude),
    ):
        _draw_errors(panel, name, comparison.time, errors, most)
        if diverged is not None:
            panel.axvline(comparison.time[diverged], color=ORANGE, linewidth=1.6)
    if diverged is not None:
        _name_divergence(panels[int(comparison.position_error[diverged] <= tolerance.position)], comparison, diverged)
    panels[-1].set_xlabel("simulated time since the first pose [s]", fontsize=12)
    panels[-1].set_xlim(0.0, 1.005 * comparison.time[-1] or 1.0)
    figure.align_ylabels(panels)
    return figure


def _draw_errors(panel: Any, name: str, time: Floats, errors: Floats, most: float) -> None:
    panel.set_ylabel(name, fontsize=12)
    panel.grid(True, color="#DDDDDD", linewidth=0.7)
    panel.set_axisbelow(True)
    panel.tick_params(labelsize=11)
    if errors.max() == 0.0:
        panel.set_yticks([])
        panel.text(0.5, 0.5, "zero throughout", transform=panel.transAxes, ha="center", va="center", fontsize=12)
        return
    panel.semilogy(*thinned(time, np.maximum(errors, _FLOOR)), color=BLUE, linewidth=1.4)
    shown = errors[errors > 0.0]
    low, high = shown.min(), max(shown.max(), most)
    panel.set_ylim(0.3 * min(low, most or low), 5.0 * high)
    if most > 0.0:
        panel.axhline(most, color=BLACK, linestyle="--", linewidth=1.2)
        panel.annotate(
            "tolerance", (1.0, most), xycoords=("axes fraction", "data"), xytext=(-4, 3), textcoords="offset points",
            ha="right", fontsize=11,
        )  # fmt: skip


def _name_divergence(panel: Any, comparison: Comparison, diverged: int) -> None:
    time = comparison.time[diverged]
    left = time > 0.7 * comparison.time[-1]
    panel.annotate(
        f"diverges at {time:.6g} s", (time, 0.04), xycoords=("data", "axes fraction"),
        xytext=(-6 if left else 6, 0), textcoords="offset points", ha="right" if left else "left", fontsize=11,
    )  # fmt: skip


def thinned(time: Floats, errors: Floats) -> tuple[Floats, Floats]:
    """A line of at most MOST_POINTS that shows every peak."""
    group = -(-len(time) // MOST_POINTS)
    if group == 1:
        return time, errors
    starts = np.arange(0, len(time), group)
    return time[starts], np.maximum.reduceat(errors, starts)
