"""The picture of a trajectory: position, attitude, angular velocity and energy. Imports matplotlib when it draws."""

from typing import Any

import numpy as np

from ..kernels.arrays import Floats

# Okabe and Ito's colours: told apart with any colour vision, and in grey.
BLACK, ORANGE, BLUE, GREEN = "#000000", "#E69F00", "#0072B2", "#009E73"
AXES = (("x", BLUE), ("y", ORANGE), ("z", GREEN))
_ANGLES = (("roll", BLUE), ("pitch", ORANGE), ("yaw", GREEN))


def figure(trajectory: Any) -> Any:
    """A matplotlib Figure of a Trajectory, with a panel for each."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(10.0, 10.0), dpi=110, layout="constrained")
    panels = drawn.subplots(4, 1, sharex=True)
    time = trajectory.time
    _lines(panels[0], "position [m]", time, trajectory.position, AXES)
    _lines(panels[1], "attitude [deg]", time, np.degrees(roll_pitch_yaw(trajectory.orientation)), _ANGLES)
    _lines(panels[2], "angular velocity\n[rad/s, body axes]", time, trajectory.angular_velocity, AXES)
    kinetic, potential = trajectory.kinetic_energy, trajectory.potential_energy
    energies = np.column_stack((kinetic, potential, kinetic + potential))
    _lines(panels[3], "energy [J]", time, energies, (("kinetic", BLUE), ("potential", ORANGE), ("sum", BLACK)))
    panels[-1].set_xlabel("simulated time [s]", fontsize=12)
    panels[-1].set_xlim(time[0], time[-1] if time[-1] > time[0] else time[0] + 1.0)
    drawn.align_ylabels(panels)
    return drawn


def _lines(panel: Any, name: str, time: Floats, values: Floats, lines: tuple[tuple[str, str], ...]) -> None:
    for (label, color), column in zip(lines, values.T, strict=True):
        panel.plot(time, column, color=color, label=label, linewidth=1.4)
    panel.set_ylabel(name, fontsize=12)
    panel.grid(True, color="#DDDDDD", linewidth=0.7)
    panel.set_axisbelow(True)
    panel.tick_params(labelsize=11)
    # A line that does not change is drawn across the middle, without round-off blown up.
    low, high = values.min(), values.max()
    least = 1e-6 * max(abs(low), abs(high), 1e-6)
    if high - low < least:
        panel.set_ylim(low - least, high + least)
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=11)


def roll_pitch_yaw(q: Floats) -> Floats:
    """Turns [rad] about the fixed axes x, y, z (R_z R_y R_x, as in URDF) of unit quaternions (n, 4), shape (n, 3).

    Roll and yaw go on beyond ±π instead of jumping.
    """
    w, x, y, z = q.T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.column_stack((np.unwrap(roll), pitch, np.unwrap(yaw)))
