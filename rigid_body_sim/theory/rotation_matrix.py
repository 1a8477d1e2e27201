"""What happens to a rotation matrix that is integrated: the warning with which theory 2.7 introduces the quaternion.

These functions are a study, not a part of any simulation: the state carries a quaternion, so a matrix that has stopped
being a rotation has no place in it. The integrator ``matrix_euler`` takes the step below with re-orthonormalisation.
"""

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats
from ..values import rotation


def euler_step(R: ArrayLike, w_world: ArrayLike, h: float) -> Floats:
    """R + h ω* R, shape (3, 3): one explicit Euler step of R' = ω* R (theory 2.2.4) with ω [rad/s, world] and h [s].

    Each step multiplies the determinant by 1 + h² |ω|² and stretches the plane across ω by √(1 + h² |ω|²).
    """
    R = np.asarray(R, float)
    return R + h * (rotation.skew(w_world) @ R)


def nearest_rotation(R: ArrayLike) -> Floats:
    """The rotation matrix nearest to R, shape (3, 3): its polar factor. Raises ValueError for det R ≤ 0.

    Unlike the Gram-Schmidt process it prefers none of the axes. Source: Higham, SIAM J. Sci. Stat. Comput. 7 (1986)
    1160.
    """
    R = np.asarray(R, float)
    if not np.linalg.det(R) > 0.0:
        raise ValueError(f"matrix {R.tolist()} has no nearest rotation; its determinant must be greater than zero")
    left, _, right = np.linalg.svd(R)
    return left @ right


def departure(R: ArrayLike) -> tuple[float, float]:
    """How far R (3, 3) is from a rotation: det R − 1, and the largest entry of |Rᵀ R − 1|."""
    R = np.asarray(R, float)
    return float(np.linalg.det(R)) - 1.0, float(np.abs(R.T @ R - np.eye(3)).max())


def spin(w_world: ArrayLike, h: float, steps: int, *, orthonormalise: bool = False) -> Floats:
    """The matrix, shape (3, 3), that Euler steps make of the identity at a constant ω [rad/s, world]."""
    R = np.eye(3)
    for _ in range(steps):
        R = euler_step(R, w_world, h)
        if orthonormalise:
            R = nearest_rotation(R)
    return R
