"""Energy and momentum: what a motion keeps, and by how much the wrench changes it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import rotation
from .body import Body
from .resistance import Tether
from .state import BodyState, State
from .wrench import PointForce


def kinetic_energy(body: Body, state: State) -> float:
    """½ m v·v + ½ ω·I ω [J], with v the velocity of the centre of mass."""
    w_body = state.angular_velocity
    velocity = center_of_mass_velocity(body, state)
    return 0.5 * body.mass * float(velocity @ velocity) + 0.5 * float(w_body @ body.inertia @ w_body)


def potential_energy(
    body: Body,
    state: State,
    gravity: ArrayLike,
    forces: Sequence[PointForce] = (),
    tethers: Sequence[Tether] = (),
) -> float:
    """−m g·x − Σ f·p + Σ ½ k s² [J]: of gravity, of constant forces at body-fixed points, and of stretched tethers.

    With gravity g [m/s², world], the centre of mass x, a force f [N, world] at the point p, and a tether's stiffness k
    and stretch s, which is zero while it is slack. Gravity and forces have none at the world's origin.
    """
    energy = -body.mass * float(np.asarray(gravity, float) @ center_of_mass_position(body, state))
    for point, force in forces:
        energy -= float(np.asarray(force, float) @ point_position(state, point))
    for tether in tethers:
        stretch = float(np.linalg.norm(point_position(state, tether.body_point) - tether.anchor)) - tether.rest_length
        if stretch > 0.0 or not tether.slack:
            energy += 0.5 * tether.stiffness * stretch * stretch
    return energy


def point_position(state: State, point: ArrayLike) -> NDArray:
    """Position [m, world, shape (3,)] of a body-fixed point [m] given from the body frame's origin in body axes."""
    return state.position + rotation.rotate(state.orientation, point)


def center_of_mass_position(body: Body, state: State) -> NDArray:
    """Position [m] of the centre of mass, world axes, shape (3,)."""
    return point_position(state, body.center_of_mass)


def center_of_mass_velocity(body: Body, state: State) -> NDArray:
    """Velocity [m/s] of the centre of mass, world axes, shape (3,): v_o + R (ω × c)."""
    return state.velocity + rotation.rotate(state.orientation, np.cross(state.angular_velocity, body.center_of_mass))


def angular_momentum_about_origin(body: Body, state: BodyState) -> NDArray:
    """x × P + L [kg m²/s] about the world's origin, world axes, shape (3,)."""
    return np.cross(center_of_mass_position(body, state), state.momentum) + state.angular_momentum
