"""Quaternions (theory 2.7), the skew matrix (theory 2.2.3) and rotation matrices.

Quaternions are scalar first, ``(w, x, y, z) = [s, v]`` as in theory (2.7.3), and turn components in the rotated frame
into components in the reference frame: ``v_world = rotate(q_world_body, v_body)``. Functions whose name begins with
``q`` work on scalars and are shared with the integrators' kernels; the others take and return arrays.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .compiled import kernel

SMALLEST_NORM = 1e-6  # A quaternion shorter than this says nothing about a direction: most likely it was never set.


@kernel
def qmultiply(
    aw: float, ax: float, ay: float, az: float, bw: float, bx: float, by: float, bz: float
) -> tuple[float, float, float, float]:
    """Product a ⊗ b of two quaternions, theory (2.7.6)."""
    return (
        aw * bw - (ax * bx + ay * by + az * bz),
        aw * bx + bw * ax + (ay * bz - az * by),
        aw * by + bw * ay + (az * bx - ax * bz),
        aw * bz + bw * az + (ax * by - ay * bx),
    )


@kernel
def cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    """Cross product a × b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@kernel
def unit_vector(i: int) -> tuple[float, float, float]:
    """Unit vector along axis 0, 1 or 2."""
    return 1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0


@kernel
def qrotate(w: float, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """q v q̄ for a unit quaternion, theory (2.7.21): v + w t + u × t with u = (x, y, z) and t = 2 u × v."""
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return vx + w * tx + (y * tz - z * ty), vy + w * ty + (z * tx - x * tz), vz + w * tz + (x * ty - y * tx)


@kernel
def qrotate_back(w: float, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """q̄ v q for a unit quaternion: the inverse of ``qrotate``."""
    return qrotate(w, -x, -y, -z, vx, vy, vz)


def multiply(a: ArrayLike, b: ArrayLike) -> Floats:
    """Product a ⊗ b, shape (4,), of two quaternions (w, x, y, z); theory (2.7.6). Rotates by b first, then by a."""
    return np.array(qmultiply(*_quaternion(a), *_quaternion(b)))


def add(a: ArrayLike, b: ArrayLike) -> Floats:
    """Sum a + b, shape (4,), component by component; theory (2.7.5)."""
    return np.add(_quaternion(a), _quaternion(b))


def subtract(a: ArrayLike, b: ArrayLike) -> Floats:
    """Difference a − b, shape (4,), component by component; theory (2.7.5)."""
    return np.subtract(_quaternion(a), _quaternion(b))


def conjugate(q: ArrayLike) -> Floats:
    """q̄ = [s, −v], shape (4,); theory (2.7.8)."""
    w, x, y, z = _quaternion(q)
    return np.array((w, -x, -y, -z))


def norm_squared(q: ArrayLike) -> float:
    """s² + v·v; theory (2.7.11), which calls it the norm."""
    w, x, y, z = _quaternion(q)
    return w * w + x * x + y * y + z * z


def norm(q: ArrayLike) -> float:
    """√(s² + v·v), without overflow or underflow; theory (2.7.13), which calls it the absolute value."""
    return math.hypot(*_quaternion(q))


def inverse(q: ArrayLike) -> Floats:
    """q⁻¹ = q̄ / (s² + v·v), shape (4,); theory (2.7.10). Raises ValueError for a quaternion without direction."""
    length = _length(q)
    return conjugate(np.asarray(q, float) / length) / length


def divide(a: ArrayLike, b: ArrayLike) -> Floats:
    """Quotient a ⊗ b⁻¹, shape (4,); theory (2.7.7). Raises ValueError where b has no inverse."""
    return multiply(a, inverse(b))


def normalize(q: ArrayLike) -> Floats:
    """Unit quaternion of the same direction, shape (4,). Raises ValueError when q is not finite or nearly zero."""
    return np.array(_quaternion(q)) / _length(q)


def from_axis_angle(axis: ArrayLike, angle: float) -> Floats:
    """Unit quaternion, shape (4,), of the rotation by ``angle`` [rad] about ``axis`` (any length); theory (2.7.20)."""
    x, y, z = _vector(axis, "axis")
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
    return np.array(qrotate(*normalize(q), *_vector(v, "vector")))


def rotate_back(q: ArrayLike, v: ArrayLike) -> Floats:
    """q⁻¹ v q, shape (3,): the inverse of ``rotate``."""
    return np.array(qrotate_back(*normalize(q), *_vector(v, "vector")))


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


def to_homogeneous(q: ArrayLike, translation: ArrayLike = (0.0, 0.0, 0.0)) -> Floats:
    """Homogeneous matrix, shape (4, 4), of a rotation and the ``translation`` [m] after it; theory (2.7.27).

    Points are columns (x, y, z, 1). Raises ValueError for a quaternion without direction or a wrong shape.
    """
    matrix = np.eye(4)
    matrix[:3, :3] = to_matrix(q)
    matrix[:3, 3] = _vector(translation, "translation")
    return matrix


def from_homogeneous(matrix: ArrayLike) -> tuple[Floats, Floats]:
    """Unit quaternion, shape (4,), and translation [m], shape (3,): the inverse of ``to_homogeneous``.

    Raises ValueError when the matrix is not (4, 4), its last row is not (0, 0, 0, 1) or its upper left is no rotation.
    """
    given = _matrix_4x4(matrix)
    if given[3].tolist() != [0.0, 0.0, 0.0, 1.0] or not np.isfinite(given).all():
        raise ValueError(f"matrix {given.tolist()} is not homogeneous; it must be finite, with last row (0, 0, 0, 1)")
    return from_matrix(given[:3, :3]), given[:3, 3].copy()


def to_matrix_4x4(q: ArrayLike) -> Floats:
    """Matrix of a quaternion of any length, shape (4, 4); theory (2.7.25). Its first row is the quaternion.

    Sums and products of these matrices are those of the quaternions: 1, i, j and k become the unit matrix and the
    matrices of theory (2.7.23) and (2.7.24).
    """
    s, x, y, z = _quaternion(q)
    return np.array(((s, x, y, z), (-x, s, -z, y), (-y, z, s, -x), (-z, -y, x, s)))


def from_matrix_4x4(matrix: ArrayLike) -> Floats:
    """Quaternion, shape (4,), of a matrix (4, 4) made as in theory (2.7.25).

    Raises ValueError when the matrix differs from that form by more than 1e-12 of its largest entry.
    """
    given = _matrix_4x4(matrix)
    q = given[0].copy()
    if not np.abs(given - to_matrix_4x4(q)).max() <= 1e-12 * np.abs(given).max():
        raise ValueError(
            f"matrix {given.tolist()} is not that of a quaternion; its rows must be those of theory (2.7.25)"
        )
    return q


def angle_between(a: ArrayLike, b: ArrayLike) -> float:
    """Angle [rad] in [0, π] of the rotation that leads from attitude a to attitude b; accurate for tiny angles too."""
    return to_axis_angle(multiply(conjugate(normalize(a)), normalize(b)))[1]


def skew(v: ArrayLike) -> Floats:
    """Skew matrix v*, shape (3, 3), with v* w = v × w; theory (2.2.3)."""
    a, b, c = _vector(v, "vector")
    return np.array(((0.0, -c, b), (c, 0.0, -a), (-b, a, 0.0)))


def _length(q: ArrayLike) -> float:
    length = norm(q)
    if not SMALLEST_NORM <= length < math.inf:
        raise ValueError(
            f"quaternion {np.asarray(q, float).tolist()} has norm {length:g}; "
            f"an attitude needs finite components and a norm of at least {SMALLEST_NORM:g}, such as w = 1 and else 0"
        )
    return length


def _quaternion(q: ArrayLike) -> list[float]:
    values = np.asarray(q, float)
    if values.shape != (4,):
        raise ValueError(f"quaternion has shape {values.shape}; four numbers (w, x, y, z) are needed")
    return values.tolist()


def _matrix_4x4(matrix: ArrayLike) -> Floats:
    values = np.asarray(matrix, float)
    if values.shape != (4, 4):
        raise ValueError(f"matrix has shape {values.shape}; four rows of four numbers are needed")
    return values


def _vector(v: ArrayLike, name: str) -> list[float]:
    values = np.asarray(v, float)
    if values.shape != (3,):
        raise ValueError(f"{name} has shape {values.shape}; three numbers (x, y, z) are needed")
    return values.tolist()
