"""The chapter's equations of motion one by one, on arrays: for checks, teaching and tools.

The kernels in forces.py and the integrators compute the same things for speed. Vectors have shape (3,); those of one
call are in one set of axes, the world's unless a name says otherwise.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Floats, Vector
from ..values import inertia, rotation
from ..values.wrench import three_finite


def particle_rates(mass: float, momentum: ArrayLike, force: ArrayLike) -> tuple[Floats, Floats]:
    """(x', P') = (P/m [m/s], F [N]) of a point mass [kg] whose state is (x, P [kg m/s]); theory (2.1.2), (2.1.4).

    As a state of its own, theory (2.1.3), it is a rigid body's without attitude and angular momentum.
    """
    return np.asarray(momentum, float) / mass, np.array(force, float)


def rotation_matrix_rate(R_world_body: ArrayLike, w_world: ArrayLike) -> Floats:
    """dR/dt = ω* R [1/s], shape (3, 3), of a rotation matrix body → world and ω [rad/s, world]; theory (2.2.5)."""
    return rotation.skew(w_world) @ np.asarray(R_world_body, float)


def angular_momentum_of_points(masses: ArrayLike, positions: ArrayLike, velocities: ArrayLike) -> Floats:
    """Σ m r × v [kg m²/s], shape (3,), about the origin, of masses [kg] (n,), r [m] and v [m/s] (n, 3); theory (2.3.1).

    For the volume element of a solid, with m = ρ dV, it is the dL of theory (2.4.4).
    """
    moments = np.cross(np.reshape(positions, (-1, 3)), np.reshape(velocities, (-1, 3)))
    return np.asarray(masses, float).reshape(-1) @ moments


def force_at_point(force: Vector, arm: Vector) -> tuple[Floats, Floats]:
    """Force [N] and torque r × F [N m] about a point, of a force that acts at the arm r [m] from it; theory (2.3.4).

    Raises ValueError for anything but three finite numbers.
    """
    F, r = np.array(three_finite(force, "force")), np.array(three_finite(arm, "arm"))
    return F, np.cross(r, F)


def impulse_at_point(impulse: Vector, arm: Vector) -> tuple[Floats, Floats]:
    """Change of momentum J [N s] and of angular momentum r × J [N m s] by an impulse at the arm r [m].

    The chapter's symbol J: the time integral of (2.1.2) and (2.3.4) over a blow too short for the body to move. With r
    from the centre of mass, the second is the change of L; velocities jump by J/m and I⁻¹ (r × J).
    """
    J, r = np.array(three_finite(impulse, "impulse")), np.array(three_finite(arm, "arm"))
    return J, np.cross(r, J)


def total_torque(forces: Iterable[tuple[Vector, Vector]]) -> Floats:
    """Σ r × F [N m], shape (3,), of pairs (force [N], arm [m]); theory (2.3.3), (2.3.4). By (2.3.5) it is dL/dt."""
    return sum((force_at_point(force, arm)[1] for force, arm in forces), np.zeros(3))


def angular_momentum(tensor: Floats, w: ArrayLike) -> Floats:
    """L = I ω [kg m²/s] of a tensor [kg m²], shape (3, 3), and ω [rad/s] in the same axes; theory (2.4.3)."""
    return tensor @ np.asarray(w, float)


def angular_velocity(tensor: Floats, L: ArrayLike) -> Floats:
    """ω = I⁻¹ L [rad/s]: theory (2.4.3) the other way. Raises numpy.linalg.LinAlgError where a moment is zero."""
    return np.linalg.solve(tensor, np.asarray(L, float))


def inertia_rate(tensor_world: Floats, w_world: ArrayLike) -> Floats:
    """dI/dt = ω* I − I ω* [kg m²/s], shape (3, 3), of the tensor in the world while the body turns; theory (2.5.2)."""
    spin = rotation.skew(w_world)
    return spin @ tensor_world - tensor_world @ spin


def angular_acceleration_euler(tensor: Floats, w_body: ArrayLike, torque_body: ArrayLike) -> Floats:
    """dω/dt [rad/s², body axes] by Euler's equation I₀ ω' = τ − (ω* I₀ − I₀ ω*) ω; theory (2.5.5), (2.5.6).

    The tensor [kg m²], shape (3, 3), need not be diagonal; with a diagonal one this is (2.5.6). Because ω* ω = 0, the
    bracket is ω × I₀ ω. Raises numpy.linalg.LinAlgError where a moment is zero.
    """
    w = np.asarray(w_body, float)
    return np.linalg.solve(tensor, np.asarray(torque_body, float) - np.cross(w, tensor @ w))


def angular_acceleration_from_momentum(
    tensor: Floats, q_world_body: ArrayLike, L_world: ArrayLike, torque_world: ArrayLike
) -> Floats:
    """dω/dt [rad/s², world axes] from L and τ in the world, the second route; theory (2.5.1): I ω' = τ − I' ω.

    With I = R I₀ Rᵀ (2.4.11) of the tensor I₀ in body axes, (3, 3), the attitude q_world_body, and ω = I⁻¹ L (2.4.3).
    """
    I = inertia.turned(tensor, q_world_body)
    w = angular_velocity(I, L_world)
    return np.asarray(np.linalg.solve(I, np.asarray(torque_world, float) - inertia_rate(I, w) @ w), float)


def state_rates(
    mass: float, tensor: Floats, R: ArrayLike, P: ArrayLike, L: ArrayLike, force: ArrayLike, torque: ArrayLike
) -> tuple[Floats, Floats, Floats, Floats]:
    """(x', R', P', L') of a rigid body; theory (2.6.1), with the attitude as a matrix R body → world, shape (3, 3).

    ``tensor`` is I₀ [kg m²] in body axes; P [kg m/s], L [kg m²/s], force [N] and torque [N m] are in the world, about
    the centre of mass. R is used as it is: a matrix that has decayed gives what the equations give.
    """
    R = np.asarray(R, float)
    w = R @ angular_velocity(tensor, R.T @ np.asarray(L, float))
    velocity, momentum_rate = particle_rates(mass, P, force)
    return velocity, rotation_matrix_rate(R, w), momentum_rate, np.array(torque, float)
