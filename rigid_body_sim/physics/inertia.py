"""Inertia tensors about the centre of mass: reading, checking, principal axes (theory 2.4)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import rotation

# A tensor worked out in double precision, as R I₀ Rᵀ or by a CAD program, may miss symmetry, or the triangle inequality
# of a flat body, by a few units in the last place of its largest entry; real mistakes miss them by much more.
ROUND_OFF = 1e-12


def as_matrix(inertia: ArrayLike) -> NDArray:
    """Inertia tensor [kg m²], shape (3, 3), from 3 principal moments, 6 entries as in URDF, or the matrix itself.

    The six are (ixx, iyy, izz, ixy, ixz, iyz); off-diagonal entries are those of the matrix, theory (2.4.2), so ixy =
    −Σ m x y. Raises ValueError for any other shape, a value that is not finite, or a matrix that is not symmetric.
    """
    given = np.asarray(inertia, float)
    if given.shape == (3,):
        matrix = np.diag(given)
    elif given.shape == (6,):
        xx, yy, zz, xy, xz, yz = given
        matrix = np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    elif given.shape == (3, 3):
        matrix = given.copy()
    else:
        raise ValueError(
            f"inertia has shape {given.shape}; "
            "give 3 principal moments, 6 entries [ixx, iyy, izz, ixy, ixz, iyz] or a 3x3 matrix"
        )
    if not np.isfinite(matrix).all():
        raise ValueError(f"inertia {given.tolist()} has an entry that is not finite; every entry is a number in kg m²")
    if np.abs(matrix - matrix.T).max() > ROUND_OFF * np.abs(matrix).max():
        raise ValueError(f"inertia {given.tolist()} is not symmetric; entry (i, j) must equal entry (j, i)")
    return matrix / 2 + matrix.T / 2


def principal_axes(inertia: NDArray) -> tuple[NDArray, NDArray]:
    """Principal moments [kg m²], shape (3,), and unit quaternion, shape (4,), principal axes → body; theory (2.4.12).

    ``R(q) diag(moments) R(q)ᵀ`` is the given matrix, shape (3, 3). The axes are right-handed. A matrix that is diagonal
    keeps its axes and their order, so the quaternion is then exactly (1, 0, 0, 0).
    """
    if not (inertia - np.diag(np.diag(inertia))).any():
        return np.diag(inertia).copy(), np.array((1.0, 0.0, 0.0, 0.0))
    _, axes = np.linalg.eigh(inertia)
    axes = _nearest_to_body_axes(axes)
    q_body_principal = rotation.from_matrix(axes)
    R = rotation.to_matrix(q_body_principal)
    return np.diag(R.T @ inertia @ R).copy(), q_body_principal


def check(inertia: NDArray) -> None:
    """Refuse a tensor (3, 3) that no body can have: one ValueError for each rule, with the principal moments.

    A body's principal moments are positive, and none exceeds the sum of the other two (I_x + I_y − I_z = 2 Σ m z² ≥ 0).
    """
    moments = np.sort(principal_axes(inertia)[0])
    shown = ", ".join(f"{moment:.6g}" for moment in moments)
    if not moments[0] > 0.0:
        raise ValueError(
            f"inertia with principal moments [{shown}] kg m² is not positive definite; "
            "every principal moment of a body with extent is greater than zero"
        )
    if moments[2] > (moments[0] + moments[1]) * (1.0 + ROUND_OFF):
        raise ValueError(
            f"inertia with principal moments [{shown}] kg m² breaks the triangle inequality; "
            "no mass distribution has one moment greater than the sum of the other two"
        )


def _nearest_to_body_axes(axes: NDArray) -> NDArray:
    """Eigenvectors (columns) in the order and with the signs that bring each next to its body axis, right-handed."""
    weights = np.abs(axes)
    columns = [0, 0, 0]
    free = [0, 1, 2]
    for row in np.argsort(-weights.max(axis=1), kind="stable"):
        columns[row] = max(free, key=lambda column: weights[row, column])
        free.remove(columns[row])
    ordered = axes[:, columns]
    return ordered * np.where(np.diag(ordered) < 0.0, -1.0, 1.0)
