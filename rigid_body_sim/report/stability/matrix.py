"""Theory 2.7's claim: an integrated rotation matrix stops being a rotation, a quaternion does not.

All take the same explicit Euler step at a constant spin, R ← R + h ω* R and q ← q + ½ h (0, ω) ⊗ q, with and without
being made a rotation again after each step.
"""

from collections.abc import Callable

import numpy as np

from ...kernels.arrays import Floats
from ...theory.rotation_matrix import departure, euler_step, nearest_rotation
from ...values import rotation

W_WORLD = (1.0, -2.0, 2.0)  # rad/s; its length is 3
H = 0.01  # s
SPIN = 3.0  # rad/s
KINDS = ("matrix", "matrix, re-orthonormalised", "quaternion", "quaternion, normalised")


def measure(kind: str, steps: int) -> dict[str, list[float]]:
    """Angle turned [rad], departure from a rotation and attitude error [rad], at about 60 moments.

    The departure is |det R − 1|, or ||q|² − 1|.
    """
    of_matrix = kind.startswith("matrix")
    value = np.eye(3) if of_matrix else np.array((1.0, 0.0, 0.0, 0.0))
    step = _STEPS[kind]
    moments = sorted({round(m) for m in np.geomspace(1, steps, 60)})
    found: dict[str, list[float]] = {"angles": [], "departures": [], "errors": []}
    for n in range(1, steps + 1):
        value = step(value)
        if n in moments:
            found["angles"].append(n * H * SPIN)
            found["departures"].append(_departure(value))
            found["errors"].append(_attitude_error(value, n))
    return found


def quaternion_step(q: Floats) -> Floats:
    """q + ½ h (0, ω) ⊗ q, theory (2.6.1): each step multiplies |q|² by 1 + ¼ h² |ω|²."""
    return q + 0.5 * H * rotation.multiply((0.0, *W_WORLD), q)


_STEPS: dict[str, Callable[[Floats], Floats]] = {
    "matrix": lambda R: euler_step(R, W_WORLD, H),
    "matrix, re-orthonormalised": lambda R: nearest_rotation(euler_step(R, W_WORLD, H)),
    "quaternion": quaternion_step,
    "quaternion, normalised": lambda q: rotation.normalize(quaternion_step(q)),
}


def _departure(value: Floats) -> float:
    return abs(departure(value)[0]) if value.ndim == 2 else abs(float(rotation.norm_squared(value)) - 1.0)


def _attitude_error(value: Floats, steps: int) -> float:
    q = rotation.from_matrix(nearest_rotation(value)) if value.ndim == 2 else value
    return rotation.angle_between(rotation.from_axis_angle(W_WORLD, steps * H * SPIN), q)
