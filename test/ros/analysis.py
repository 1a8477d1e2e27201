"""Expected motions, worked out without the package: closed forms, an ODE for planar motion, derivatives of samples."""

import numpy as np
from scipy.integrate import solve_ivp

# Ninth central difference: exact for polynomials of degree 8.
_WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


def derivative(samples, h):
    """Time derivative of rows spaced by h, for rows 4 to −5."""
    return sum(w * samples[i : len(samples) - 8 + i] for i, w in enumerate(_WEIGHTS)) / h


def matrices(orientation):
    """Rotation matrices body → world of quaternions w, x, y, z (rows)."""
    w, x, y, z = orientation.T
    return np.moveaxis(
        np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        ),
        -1,
        0,
    )


def spin_of(orientation, h):
    """Angular velocity in world axes, from the rotation matrices alone: skew part of R' Rᵀ; rows 4 to −5."""
    R = matrices(orientation)
    S = derivative(R, h) @ np.swapaxes(R[4:-4], 1, 2)
    return np.stack([S[:, 2, 1] - S[:, 1, 2], S[:, 0, 2] - S[:, 2, 0], S[:, 1, 0] - S[:, 0, 1]], axis=1) / 2


def angle_about_z(orientation):
    return 2 * np.arctan2(orientation[:, 3], orientation[:, 0])


def turn(angle):
    """2×2 rotation matrix."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def planar_motion(times, angle, origin, com, mass, moment, wrench):
    """Angle, position and velocity of the body frame's origin, from rest, in the world's x-y plane.

    ``wrench(angle)`` gives the force in world axes and the torque about the centre of mass; ``com`` is in body axes.
    """

    def slope(_, y):
        force, torque = wrench(y[0])
        return [y[1], torque / moment, y[4], y[5], *(force / mass)]

    start = [angle, 0.0, *(origin + turn(angle) @ com), 0.0, 0.0]
    y = solve_ivp(slope, (0.0, times[-1]), start, "DOP853", times, rtol=3e-14, atol=1e-14).y
    arm = np.array([turn(a) @ com for a in y[0]])
    spin = y[1][:, None] * np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    return y[0], y[1], y[2:4].T - arm, y[4:6].T - spin
