"""Quaternions (theory 2.7), the skew matrix (theory 2.2.3) and rotation matrices.

Quaternions are scalar first, ``(w, x, y, z) = [s, v]`` as in theory (2.7.3), and turn components in the rotated frame
into components in the reference frame: ``v_world = rotate(q_world_body, v_body)``. These functions take and return
arrays; the kernels on scalars are in kernels.vectors, and what of the algebra no program needs in theory.quaternion.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats
from ..kernels.vectors import cross, qmultiply, qrotate, qrotate_back

SMALLEST_NORM = 1e-6  # A quaternion shorter than this says nothing about a direction: most likely it was never set.


def multiply(a: ArrayLike, b: ArrayLike) -> Floats:
    """Product a ⊗ b, shape (4,), of two quaternions (w, x, y, z); theory (2.7.6). Rotates by b first, then by a."""
    return np.array(qmultiply(*as_quaternion(a), *as_quaternion(b)))


def conjugate(q: ArrayLike) -> Floats:
    """q̄ = [s, −v], shape (4,); theory (2.7.8)."""
    w, x, y, z = as_quaternion(q)
    return np.array((w, -x, -y, -z))


def norm_squared(q: ArrayLike) -> float:
    """s² + v·v; theory (2.7.11), which calls it the norm."""
    w, x, y, z = as_quaternion(q)
    return w * w + x * x + y * y + z * z


def norm(q: ArrayLike) -> float:
    """√(s² + v·v), without overflow or underflow; theory (2.7.13), which calls it the absolute value."""
    return math.hypot(*as_quaternion(q))


def normalize(q: ArrayLike) -> Floats:
    """Unit quaternion of the same direction, shape (4,). Raises ValueError when q is not finite or nearly zero."""
    return np.array(as_quaternion(q)) / checked_norm(q)


def from_axis_angle(axis: ArrayLike, angle: float) -> Floats:
    """Unit quaternion, shape (4,), of the rotation by ``angle`` [rad] about ``axis`` (any length); theory (2.7.20)."""
    x, y, z = as_vector(axis, "axis")
    length = math.hypot(x, y, z)
    if not length > 0.0:
        raise ValueError(f"axis {[x, y, z]} has no direction; give a vector that is not zero")
    half = math.sin(0.5 * angle)
    return np.array((math.cos(0.5 * angle), half * (x / length), half * (y / length), half * (z / length)))


def from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Floats:
    """Unit quaternion, shape (4,), of turns [rad] about the fixed axes x, then y, then z: R_z R_y R_x, as in URDF."""
    about_x, about_y, about_z = (
        from_axis_angle(axis, angle) for axis, angle in zip(np.eye(3), (roll, pitch, yaw), strict=True)
    )
    return multiply(about_z, multiply(about_y, about_x))


def to_axis_angle(q: ArrayLike) -> tuple[Floats, float]:
    """Axis, shape (3,), of unit length and angle [rad] in [0, π] of a rotation; inverse of theory (2.7.20).

    The identity has no axis of its own: (1, 0, 0) is given with the angle 0.
    """
    w, x, y, z = normalize(q)
    sine = math.hypot(x, y, z)
    if sine == 0.0:
        return np.array((1.0, 0.0, 0.0)), 0.0
    sign = -1.0 if w < 0.0 else 1.0
    return sign * np.array((x, y, z)) / sine, 2.0 * math.atan2(sine, abs(w))


def rotate(q: ArrayLike, v: ArrayLike) -> Floats:
    """Rot(q, v) = q v q⁻¹, shape (3,), for a quaternion of any length; theory (2.7.21)."""
    return np.array(qrotate(*normalize(q).tolist(), *as_vector(v, "vector")))


def rotate_each(q: Floats, v: Floats) -> Floats:
    """q v q̄ for unit quaternions (..., 4) and vectors (..., 3), shape (..., 3)."""
    return _each(qrotate, q, v)


def cross_each(a: Floats, b: Floats) -> Floats:
    """a × b for vectors (..., 3), with the bits of ``np.cross``."""
    return _each(cross, a, b)


def _each(kernel: Callable[..., tuple[Any, ...]], *arrays: Floats) -> Floats:
    """What a kernel makes of numbers, for rows of them; of single ones as floats, a tenth of the cost."""
    if all(one.ndim == 1 for one in arrays):
        return np.array(kernel(*(number for one in arrays for number in one.tolist())))
    return np.stack(kernel(*(column for one in arrays for column in np.moveaxis(one, -1, 0))), axis=-1)


def rotate_back(q: ArrayLike, v: ArrayLike) -> Floats:
    """q⁻¹ v q, shape (3,): the inverse of ``rotate``."""
    return np.array(qrotate_back(*normalize(q).tolist(), *as_vector(v, "vector")))


def to_matrix(q: ArrayLike) -> Floats:
    """Rotation matrix, shape (3, 3), of a quaternion of any length; theory (2.7.27)."""
    w, x, y, z = (float(c) for c in normalize(q))
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )


# An entry of a rotation matrix in the order of its rows: one, or nothing, and two products of a quaternion's entries.
_ONES = np.eye(3)
_FIRST = np.array([[(2, 2), (1, 2), (1, 3)], [(1, 2), (1, 1), (2, 3)], [(1, 3), (2, 3), (1, 1)]])
_SECOND = np.array([[(3, 3), (0, 3), (0, 2)], [(0, 3), (3, 3), (0, 1)], [(0, 2), (0, 1), (2, 2)]])
_TIMES_FIRST = 2.0 - 4.0 * _ONES
_TIMES_SECOND = np.array([[-2.0, -2.0, 2.0], [2.0, -2.0, -2.0], [-2.0, 2.0, -2.0]])


def to_matrix_each(q: Floats) -> Floats:
    """Rotation matrices, shape (..., 3, 3), of unit quaternions (..., 4): the same bits for one as for many."""
    first = q[..., _FIRST[..., 0]] * q[..., _FIRST[..., 1]]
    second = q[..., _SECOND[..., 0]] * q[..., _SECOND[..., 1]]
    return _ONES + (_TIMES_FIRST * first + _TIMES_SECOND * second)


def from_matrix(R: ArrayLike) -> Floats:
    """Unit quaternion, shape (4,), of a rotation matrix (3, 3): the row of 4 q qᵀ with the largest diagonal entry.

    Source: Shepperd, J. Guidance and Control 1 (1978) 223. Raises ValueError when R is not orthogonal to 1e-6, or a
    reflection.
    """
    R = np.asarray(R, float)
    if R.shape != (3, 3) or not np.allclose(R @ R.T, np.eye(3), rtol=0, atol=1e-6) or np.linalg.det(R) < 0:
        raise ValueError(f"matrix {R.tolist()} is not a rotation; its columns must be orthonormal and right-handed")
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    rows = (
        (1 + a + e + i, h - f, c - g, d - b),
        (h - f, 1 + a - e - i, b + d, c + g),
        (c - g, b + d, 1 - a + e - i, f + h),
        (d - b, c + g, f + h, 1 - a - e + i),
    )
    return normalize(max(enumerate(rows), key=lambda row: row[1][row[0]])[1])


def angle_between(a: ArrayLike, b: ArrayLike) -> float:
    """Angle [rad] in [0, π] of the rotation that leads from attitude a to attitude b; accurate for tiny angles too."""
    return to_axis_angle(multiply(conjugate(normalize(a)), normalize(b)))[1]


def angles_between(a: Floats, b: Floats) -> Floats:
    """The same of many attitudes of any length, each of shape (n, 4), shape (n,)."""
    scalar = np.abs((a * b).sum(axis=1))
    v, w = a[:, 1:], b[:, 1:]
    vector = a[:, :1] * w - b[:, :1] * v - np.cross(v, w)
    return 2.0 * np.arctan2(np.linalg.norm(vector, axis=1), scalar)


def skew(v: ArrayLike) -> Floats:
    """Skew matrix v*, shape (3, 3), with v* w = v × w; theory (2.2.3)."""
    a, b, c = as_vector(v, "vector")
    return np.array(((0.0, -c, b), (c, 0.0, -a), (-b, a, 0.0)))


def checked_norm(q: ArrayLike) -> float:
    """|q|. Raises ValueError for a quaternion without direction."""
    length = norm(q)
    if not SMALLEST_NORM <= length < math.inf:
        raise ValueError(
            f"quaternion {np.asarray(q, float).tolist()} has norm {length:g}; "
            f"an attitude needs finite components and a norm of at least {SMALLEST_NORM:g}, such as w = 1 and else 0"
        )
    return length


def as_quaternion(q: ArrayLike) -> list[float]:
    """Four floats (w, x, y, z). Raises ValueError for another shape."""
    values = np.asarray(q, float)
    if values.shape != (4,):
        raise ValueError(f"quaternion has shape {values.shape}; four numbers (w, x, y, z) are needed")
    return values.tolist()


def as_vector(v: ArrayLike, name: str) -> list[float]:
    """Three floats (x, y, z). Raises ValueError, naming it, for another shape."""
    values = np.asarray(v, float)
    if values.shape != (3,):
        raise ValueError(f"{name} has shape {values.shape}; three numbers (x, y, z) are needed")
    return values.tolist()
