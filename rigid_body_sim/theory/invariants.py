"""Energy and momentum: what a motion keeps, and by how much the wrench changes it.

Products are formed as long doubles, which have room for any of them: an energy too large for a float is inf, not an
overflow or a difference of two infinities on the way.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..effects.tether import Tether
from ..kernels.arrays import Floats
from ..values import rotation
from ..values.body import Body
from ..values.state import BodyState, State
from ..values.wrench import PointForce


def kinetic_energy(body: Body, state: State) -> float:
    """½ m v·v + ½ ω·I ω [J], with v the velocity of the centre of mass."""
    w_body = state.angular_velocity.astype(np.longdouble)
    velocity = center_of_mass_velocity(body, state).astype(np.longdouble)
    return float((body.mass * (velocity @ velocity) + w_body @ body.inertia @ w_body) / 2)


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
    energy = -body.mass * (np.asarray(gravity, np.longdouble) @ center_of_mass_position(body, state))
    for point, force in forces:
        energy -= np.asarray(force, np.longdouble) @ point_position(state, point)
    for tether in tethers:
        away = point_position(state, tether.body_point).astype(np.longdouble) - tether.anchor
        stretch = np.sqrt(away @ away) - tether.rest_length
        if stretch > 0.0 or not tether.slack:
            energy += tether.stiffness * stretch * stretch / 2
    return float(energy)


def point_position(state: State, point: ArrayLike) -> Floats:
    """Position [m, world, shape (3,)] of a body-fixed point [m] given from the body frame's origin in body axes."""
    return state.position + rotation.rotate(state.orientation, point)


def center_of_mass_position(body: Body, state: State) -> Floats:
    """Position [m] of the centre of mass, world axes, shape (3,)."""
    return point_position(state, body.center_of_mass)


def center_of_mass_velocity(body: Body, state: State) -> Floats:
    """Velocity [m/s] of the centre of mass, world axes, shape (3,): v_o + R (ω × c)."""
    return state.velocity + rotation.rotate(state.orientation, np.cross(state.angular_velocity, body.center_of_mass))


def angular_momentum_about_origin(body: Body, state: BodyState) -> Floats:
    """x × P + L [kg m²/s] about the world's origin, world axes, shape (3,)."""
    position = center_of_mass_position(body, state).astype(np.longdouble)
    return np.array([float(component) for component in np.cross(position, state.momentum) + state.angular_momentum])
