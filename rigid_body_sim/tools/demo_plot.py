"""The demo's picture: attitude error, angular rate and torque over time. Imports matplotlib only when it draws."""

import os
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..runs.plot import AXES, BLACK
from .heard import Heard

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(heard: Heard, target: ArrayLike, max_torque: float, title: str, path: str | os.PathLike[str]) -> None:
    """Write the picture to ``path``; the file's ending tells the format. Raises ImportError without matplotlib."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 8.6), dpi=120, layout="constrained")
    panels = figure.subplots(3, 1, sharex=True, height_ratios=(1.2, 1.0, 1.0))
    figure.suptitle(title, fontsize=13)
    _draw_error(panels[0], heard, target)
    _draw_rates(panels[1], heard)
    _draw_torque(panels[2], heard, max_torque)
    for panel in panels:
        panel.grid(True, color="#DDDDDD", linewidth=0.7)
        panel.set_axisbelow(True)
        panel.tick_params(labelsize=11)
    panels[-1].set_xlabel("simulated time since the first pose [s]", fontsize=12)
    panels[-1].set_xlim(0.0, 1.005 * heard.time[-1])  # so that the last tick keeps its number
    figure.align_ylabels(panels)
    figure.savefig(path)


def _draw_error(panel: "Axes", heard: Heard, target: ArrayLike) -> None:
    error = np.maximum(np.degrees(heard.error(target)), 1e-15)  # zero has no place on a logarithmic axis
    panel.semilogy(heard.time, error, color=BLACK, linewidth=1.6)
    panel.set_ylabel("attitude error [deg]", fontsize=12)
    _mark_start(panel, heard)


def _mark_start(panel: "Axes", heard: Heard) -> None:
    """Mark where control begins, unless that is where the picture begins."""
    start = heard.command_time[0] if len(heard.command_time) else 0.0
    if start < 0.01 * heard.time[-1]:
        return
    panel.axvline(start, color="#666666", linestyle=":", linewidth=1.4)
    panel.annotate(
        "first command",
        (start, 0.06),
        xycoords=("data", "axes fraction"),
        xytext=(6, 0),
        textcoords="offset points",
        fontsize=11,
    )


def _draw_rates(panel: "Axes", heard: Heard) -> None:
    for index, (name, colour) in enumerate(AXES):
        rate = np.degrees(heard.angular_velocity[:, index])
        panel.plot(heard.time, rate, color=colour, linewidth=1.6, label=f"$\\omega_{name}$")
    panel.set_ylabel("angular rate [deg/s]\nbody axes", fontsize=12)
    _legend(panel)


def _draw_torque(panel: "Axes", heard: Heard, max_torque: float) -> None:
    time = np.concatenate(([0.0], heard.command_time, [heard.time[-1]]))
    torque = 1e3 * np.vstack((np.zeros(3), heard.torque))
    torque = np.vstack((torque, torque[-1]))
    for index, (name, colour) in enumerate(AXES):
        panel.step(time, torque[:, index], where="post", color=colour, linewidth=1.6, label=f"$\\tau_{name}$")
    length = np.linalg.norm(torque, axis=1)
    panel.step(time, length, where="post", color=BLACK, linewidth=1.2, linestyle="--", label="$|\\tau|$")
    panel.set_ylabel(f"torque [mN m], body axes\n(limit {1e3 * max_torque:g})", fontsize=12)
    _legend(panel)


def _legend(panel: "Axes") -> None:
    """Beside the panel, where it covers nothing."""
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=12)
