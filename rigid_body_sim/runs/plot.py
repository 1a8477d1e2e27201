"""Pictures of a motion: a panel each for position, attitude, velocities and so on. Imports matplotlib when it draws."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..kernels.arrays import Floats
from ..values.state import Motions

# Okabe and Ito's colours: told apart with any colour vision, and in grey.
BLACK, ORANGE, BLUE, GREEN = "#000000", "#E69F00", "#0072B2", "#009E73"
COLOURS = (BLUE, ORANGE, GREEN, "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", BLACK)
AXES = (("x", BLUE), ("y", ORANGE), ("z", GREEN))
_ANGLES = (("roll", BLUE), ("pitch", ORANGE), ("yaw", GREEN))
MOST_POINTS = 4000  # in a line; of more, the least and the largest of each group of neighbours


class Panel(NamedTuple):
    """Lines over one axis of time [s], shape (n,): columns of ``values``, shape (n, k); names and colours."""

    name: str
    time: Floats
    values: Floats
    lines: Sequence[tuple[str, str]]
    held: bool = False  # each value until the next one


def figure(trajectory: Any) -> Any:
    """A matplotlib Figure of a Trajectory, with a panel for each."""
    time = trajectory.time
    energies = energy(time, trajectory.kinetic_energy, trajectory.potential_energy)
    return stacked([*poses(time, trajectory), turning(time, trajectory), energies])


def poses(time: Floats, motion: Any) -> list[Panel]:
    """Position, and attitude as roll, pitch and yaw."""
    return [
        Panel("position [m]", time, motion.position, AXES),
        Panel("attitude [deg]", time, np.degrees(roll_pitch_yaw(motion.orientation)), _ANGLES),
    ]


def turning(time: Floats, motion: Motions) -> Panel:
    """Angular velocity."""
    return Panel("angular velocity\n[rad/s, body axes]", time, motion.angular_velocity, AXES)


def energy(time: Floats, kinetic: Floats, potential: Floats) -> Panel:
    """Both kinds, and their sum."""
    energies = np.column_stack((kinetic, potential, kinetic + potential))
    return Panel("energy [J]", time, energies, (("kinetic", BLUE), ("potential", ORANGE), ("sum", BLACK)))


def stacked(panels: Sequence[Panel], title: str = "") -> Any:
    """A matplotlib Figure of panels above each other, over the time of the first."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(10.0, 2.5 * len(panels)), dpi=110, layout="constrained")
    axes = drawn.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for panel, each in zip(axes, panels, strict=True):
        _draw(panel, each)
    time = panels[0].time
    axes[-1].set_xlabel("simulated time [s]", fontsize=12)
    axes[-1].set_xlim(time[0], time[-1] if time[-1] > time[0] else time[0] + 1.0)
    drawn.align_ylabels(axes)
    if title:
        drawn.suptitle(title, fontsize=13)
    return drawn


def _draw(panel: Any, each: Panel) -> None:
    style = "steps-post" if each.held else "default"
    for (label, colour), column in zip(each.lines, each.values.T, strict=True):
        panel.plot(*outline(each.time, column), color=colour, label=label, linewidth=1.4, drawstyle=style)
    panel.set_ylabel(each.name, fontsize=12)
    panel.grid(True, color="#DDDDDD", linewidth=0.7)
    panel.set_axisbelow(True)
    panel.tick_params(labelsize=11)
    # A line that does not change is drawn across the middle, without round-off blown up.
    finite = each.values[np.isfinite(each.values)]
    if finite.size:
        low, high = finite.min(), finite.max()
        least = 1e-6 * max(abs(low), abs(high), 1e-3)
        if high - low < least:
            panel.set_ylim(low - least, high + least)
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=11)


def outline(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """A line of at most MOST_POINTS that has the least and the largest value of each group of neighbours."""
    if len(time) <= MOST_POINTS:
        return time, values
    groups = np.array_split(np.arange(len(time)), MOST_POINTS // 2)
    kept = sorted({int(group[at(values[group])]) for group in groups for at in (np.argmin, np.argmax)})
    return time[kept], values[kept]


def roll_pitch_yaw(q: Floats) -> Floats:
    """Turns [rad] about the fixed axes x, y, z (R_z R_y R_x, as in URDF) of unit quaternions (n, 4), shape (n, 3).

    Roll and yaw go on beyond ±π instead of jumping.
    """
    w, x, y, z = q.T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.column_stack((np.unwrap(roll), pitch, np.unwrap(yaw)))
