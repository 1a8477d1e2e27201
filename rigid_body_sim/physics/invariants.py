"""Energy and momentum: what a motion keeps, and by how much the wrench changes it.

Products are formed as long doubles, which have room for any of them: an energy too large for a float is inf, not an
overflow or a difference of two infinities on the way.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import rotation
from .body import Body
from .state import BodyState, State


def kinetic_energy(body: Body, state: State) -> float:
    """½ m v·v + ½ ω·I ω [J], with v the velocity of the centre of mass."""
    w_body = state.angular_velocity.astype(np.longdouble)
    velocity = center_of_mass_velocity(body, state).astype(np.longdouble)
    return float((body.mass * (velocity @ velocity) + w_body @ body.inertia @ w_body) / 2)


def potential_energy(body: Body, state: State, gravity: ArrayLike) -> float:
    """−m g·x [J], with gravity g [m/s², world] and x the centre of mass; zero at the world's origin."""
    return float(-body.mass * (np.asarray(gravity, np.longdouble) @ center_of_mass_position(body, state)))


def center_of_mass_position(body: Body, state: State) -> NDArray:
    """Position [m] of the centre of mass, world axes, shape (3,)."""
    return state.position + rotation.rotate(state.orientation, body.center_of_mass)


def center_of_mass_velocity(body: Body, state: State) -> NDArray:
    """Velocity [m/s] of the centre of mass, world axes, shape (3,): v_o + R (ω × c)."""
    return state.velocity + rotation.rotate(state.orientation, np.cross(state.angular_velocity, body.center_of_mass))


def angular_momentum_about_origin(body: Body, state: BodyState) -> NDArray:
    """x × P + L [kg m²/s] about the world's origin, world axes, shape (3,)."""
    position = center_of_mass_position(body, state).astype(np.longdouble)
    return np.array([float(component) for component in np.cross(position, state.momentum) + state.angular_momentum])
