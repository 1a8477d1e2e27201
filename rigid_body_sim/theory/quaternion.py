"""The rest of the quaternion algebra of theory 2.7, which no program here needs; see values.rotation."""

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats
from ..values.rotation import (
    as_quaternion,
    as_vector,
    checked_norm,
    conjugate,
    from_matrix,
    multiply,
    to_matrix,
)


def add(a: ArrayLike, b: ArrayLike) -> Floats:
    """Sum a + b, shape (4,), component by component; theory (2.7.5)."""
    return np.add(as_quaternion(a), as_quaternion(b))


def subtract(a: ArrayLike, b: ArrayLike) -> Floats:
    """Difference a − b, shape (4,), component by component; theory (2.7.5)."""
    return np.subtract(as_quaternion(a), as_quaternion(b))


def inverse(q: ArrayLike) -> Floats:
    """q⁻¹ = q̄ / (s² + v·v), shape (4,); theory (2.7.10). Raises ValueError for a quaternion without direction."""
    length = checked_norm(q)
    return conjugate(np.asarray(q, float) / length) / length


def divide(a: ArrayLike, b: ArrayLike) -> Floats:
    """Quotient a ⊗ b⁻¹, shape (4,); theory (2.7.7). Raises ValueError where b has no inverse."""
    return multiply(a, inverse(b))


def to_homogeneous(q: ArrayLike, translation: ArrayLike = (0.0, 0.0, 0.0)) -> Floats:
    """Homogeneous matrix, shape (4, 4), of a rotation and the ``translation`` [m] after it; theory (2.7.27).

    Points are columns (x, y, z, 1). Raises ValueError for a quaternion without direction or a wrong shape.
    """
    matrix = np.eye(4)
    matrix[:3, :3] = to_matrix(q)
    matrix[:3, 3] = as_vector(translation, "translation")
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
    s, x, y, z = as_quaternion(q)
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


def _matrix_4x4(matrix: ArrayLike) -> Floats:
    values = np.asarray(matrix, float)
    if values.shape != (4, 4):
        raise ValueError(f"matrix has shape {values.shape}; four rows of four numbers are needed")
    return values
