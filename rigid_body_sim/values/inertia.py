"""Inertia tensors: reading, checking, principal axes, another attitude or another point (theory 2.4)."""

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats, Vector
from . import rotation

# A tensor worked out in double precision may miss symmetry by a few units in the last place of its largest entry.
ROUND_OFF = 1e-12

# A flat body whose tensor is written with six digits, as URDF exporters do, may miss the triangle inequality by this
# much: at most 1e-5 by arithmetic, 8e-6 found in 20 000 trials. Real mistakes miss it by much more.
SIX_DIGITS = 1e-5

# Moments this close, relative to the largest, differ by the round-off of whatever computed the tensor; and where axes
# had to be found, a moment this small is the round-off of zero (5e-16 found in 3000 turned rods).
EQUAL_MOMENTS = 1e-14

# A smallest moment below this, relative to the largest, was not lost by rounding: it is that of an ideal rod. A wire of
# 1 m has this when it is 0.26 mm thick.
THINNEST = 1e-7

# Masses [kg], moments [kg m²] and lengths [m] of a body lie between these: beyond them, products of a few floats under-
# or overflow. The electron has 9e-31 kg, the Galaxy 3e42.
LEAST, MOST = 1e-100, 1e100


def as_matrix(inertia: ArrayLike) -> Floats:
    """Inertia tensor [kg m²], shape (3, 3), from 3 principal moments, 6 entries as in URDF, or the matrix itself.

    The six are (ixx, iyy, izz, ixy, ixz, iyz); off-diagonal entries are those of the matrix, theory (2.4.2), so ixy =
    −Σ m x y. Raises ValueError for any other shape, a value that is not finite or beyond MOST, or a matrix that is not
    symmetric.
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
    if np.abs(matrix).max() > MOST:
        raise ValueError(
            f"inertia {given.tolist()} has an entry beyond {MOST:g} kg m²; products of larger ones overflow"
        )
    if np.abs(matrix - matrix.T).max() > ROUND_OFF * np.abs(matrix).max():
        raise ValueError(f"inertia {given.tolist()} is not symmetric; entry (i, j) must equal entry (j, i)")
    return (matrix + matrix.T) / 2


def from_second_moment(second_moment: ArrayLike) -> Floats:
    """Inertia tensor [kg m²], shape (3, 3), of ``Σ m r rᵀ`` [kg m²], shape (3, 3); theory (2.4.8): tr(S) 1 − S."""
    S = np.asarray(second_moment, float)
    S = (S + S.T) / 2.0
    return np.trace(S) * np.eye(3) - S


def of_point_masses(masses: ArrayLike, positions: ArrayLike) -> Floats:
    """Inertia tensor [kg m²], shape (3, 3), about the origin of ``positions`` [m], shape (n, 3), and in their axes.

    Theory (2.4.2), (2.4.8) and, in body axes, (2.4.10): Σ m (rᵀr 1 − r rᵀ). ``masses`` [kg] has shape (n,). Raises
    ValueError for other shapes, a mass that is negative, or a value that is not finite.
    """
    m, r = np.asarray(masses, float), np.asarray(positions, float)
    if m.ndim != 1 or r.shape != (len(m), 3):
        raise ValueError(f"masses have shape {m.shape} and positions {r.shape}; (n,) and (n, 3) belong together")
    if not (np.isfinite(m).all() and np.isfinite(r).all() and (m >= 0.0).all()):
        raise ValueError("a point mass is negative or not finite; masses are at least zero, positions finite")
    return from_second_moment((m[:, None] * r).T @ r)


def turned(inertia: Floats, q: ArrayLike) -> Floats:
    """R I₀ Rᵀ, shape (3, 3): the tensor in the axes to which the quaternion q leads; theory (2.4.11).

    Not one bit changes when q is exactly the identity. Raises ValueError for a quaternion without direction.
    """
    R = rotation.to_matrix(q)
    matrix = R @ inertia @ R.T
    return (matrix + matrix.T) / 2.0


def about_point(inertia: Floats, mass: float, arm: Vector) -> Floats:
    """Tensor (3, 3) about a point at ``arm`` [m] from the centre of mass, from that about the centre of mass.

    The parallel-axis theorem: I + m (aᵀa 1 − a aᵀ), which is theory (2.4.8) for the whole mass at the distance a.
    """
    return inertia + of_point_masses([mass], np.asarray(arm, float)[None])


def principal_axes(inertia: Floats) -> tuple[Floats, Floats]:
    """Principal moments [kg m²], shape (3,), and unit quaternion, shape (4,), principal axes → body; theory (2.4.12).

    ``R(q) diag(moments) R(q)ᵀ`` is the given matrix, shape (3, 3). The axes are right-handed, each next to its body
    axis. A matrix that is diagonal keeps its axes and their order, so the quaternion is then exactly (1, 0, 0,
    0). Where two moments are equal to EQUAL_MOMENTS, any axes in their plane would do: those are taken to which the
    smallest rotation leads that brings a body axis to the third one, and the moments are made equal. Where all three
    are, the body axes are taken.
    """
    if not (inertia - np.diag(np.diag(inertia))).any():
        return np.diag(inertia).copy(), np.array((1.0, 0.0, 0.0, 0.0))
    moments, axes = np.linalg.eigh(inertia)
    low, high = np.diff(moments) <= EQUAL_MOMENTS * np.abs(moments).max()
    if low and high:
        return np.full(3, np.trace(inertia) / 3.0), np.array((1.0, 0.0, 0.0, 0.0))
    if low or high:
        return _symmetric(inertia, axes[:, 2 if low else 0])
    q_body_principal = rotation.from_matrix(_nearest_to_body_axes(axes))
    return _moments_along(inertia, q_body_principal), q_body_principal


def check(inertia: Floats) -> None:
    """Refuse a tensor (3, 3) that no body can have: one ValueError for each rule, with the principal moments.

    A body's principal moments are positive, and none exceeds the sum of the other two (I_x + I_y − I_z = 2 Σ m z² ≥ 0).
    """
    moments = np.sort(principal_axes(inertia)[0])
    shown = ", ".join(f"{moment:.6g}" for moment in moments)
    found = 0.0 if (inertia == np.diag(np.diag(inertia))).all() else EQUAL_MOMENTS * moments[2]
    if abs(moments[0]) <= found:
        raise ValueError(
            f"inertia with principal moments [{shown}] kg m² is not positive definite: one is zero, or round-off, so "
            "the spin L/I about its axis is undefined; give a thin rod its radius r (I = m r²/2), a point an extent"
        )
    if moments[0] < 0.0:
        raise ValueError(
            f"inertia with principal moments [{shown}] kg m² is not positive definite; "
            "every principal moment of a body with extent is greater than zero"
        )
    if moments[0] < LEAST:
        raise ValueError(
            f"inertia with principal moments [{shown}] kg m² has one below {LEAST:g} kg m², where products underflow; "
            "give a body of at least that"
        )
    if moments[2] > (moments[0] + moments[1]) * (1.0 + SIX_DIGITS):
        raise ValueError(
            f"inertia with principal moments [{shown}] kg m² breaks the triangle inequality; "
            "no mass distribution has one moment greater than the sum of the other two, "
            f"here {moments[0] + moments[1]:.6g} kg m²: give more digits, if they were rounded"
        )


def within_rounding(inertia: Floats, rounding: ArrayLike) -> Floats:
    """A tensor [kg m²], shape (3, 3), that a body can have, whose moments are the given one's within its rounding.

    ``rounding`` [kg m²], shape (3, 3), is how far each entry may be from the number that was rounded to it. A tensor
    that ``check`` takes, one that rounding does not explain, and one with a zero or less on its diagonal are given back
    as they are, to the last bit.

    Along a principal axis e the rounding is at most r = Σ |e_i| rounding_ij |e_j|. So the tensor before rounding, if it
    was that of a body, had a smallest moment of at most I₁ + r₁, and I₁ + I₂ − I₃ was greater by at most r₁ + r₂ + r₃:
    what misses zero, or the triangle inequality, by more was wrong before. The principal axes are kept, and the moments
    change as little as they can in proportion to their rounding, so that none leaves it and a small one stays small.
    Of a smallest moment that is lost, as of a thin rod at an angle, nothing is known but that it is between zero and
    I₁ + r₁: the middle is taken. Where that is below THINNEST of the largest, nothing was lost: that is an ideal rod.
    """
    try:
        check(inertia)
    except ValueError:
        return _mended(inertia, np.asarray(rounding, float))
    return inertia


def _mended(inertia: Floats, rounding: Floats) -> Floats:
    moments, axes = np.linalg.eigh(inertia)
    slack = np.einsum("ik,ij,jk->k", np.abs(axes), rounding, np.abs(axes))
    greatest = moments[0] + slack[0]
    lost = moments[0] <= EQUAL_MOMENTS * moments[2]
    if lost:
        moments[0] = slack[0] = greatest / 2.0
    missing = max(moments[2] - moments[1] - moments[0], 0.0)
    extended = np.diag(inertia).min() > 0.0 and moments[0] > (THINNEST if lost else 0.0) * moments[2]
    if not extended or missing > slack.sum() or not (lost or missing):
        return inertia
    moments += np.array((1.0, 1.0, -1.0)) * slack * (missing / slack.sum())
    mended = axes @ np.diag(moments) @ axes.T
    return (mended + mended.T) / 2.0


def _symmetric(inertia: Floats, axis: Floats) -> tuple[Floats, Floats]:
    """principal_axes when the moments across ``axis``, shape (3,), are equal: that axis decides everything."""
    body_axis = int(np.argmax(_weights(axis)))
    axis = axis * np.sign(axis[body_axis])
    # The quaternion 1 − n e of unit vectors e and n turns by the angle from e to n, twice that of theory (2.7.14).
    q_body_principal = rotation.normalize((1.0 + axis[body_axis], *np.cross(np.eye(3)[body_axis], axis)))
    moments = _moments_along(inertia, q_body_principal)
    across = np.arange(3) != body_axis
    moments[across] = moments[across].mean()
    return moments, q_body_principal


def _moments_along(inertia: Floats, q_body_principal: Floats) -> Floats:
    """Moments [kg m²], shape (3,), about the axes of that attitude; more accurate than the eigenvalues of eigh."""
    R = rotation.to_matrix(q_body_principal)
    return np.diag(R.T @ inertia @ R).copy()


def _nearest_to_body_axes(axes: Floats) -> Floats:
    """Eigenvectors (columns) in the order and with the signs that bring each next to its body axis, right-handed."""
    weights = _weights(axes)
    columns = [0, 0, 0]
    free = [0, 1, 2]
    for row in np.argsort(-weights.max(axis=1), kind="stable"):
        columns[row] = max(free, key=lambda column: weights[row, column])
        free.remove(columns[row])
    ordered = axes[:, columns]
    return ordered * np.where(np.diag(ordered) < 0.0, -1.0, 1.0)


def _weights(axes: Floats) -> Floats:
    """How near axes are to body axes, without the last digits: among equals the first one must win, not round-off."""
    return np.asarray(np.round(np.abs(axes), 9), float)
