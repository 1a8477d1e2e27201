"""Energy and momentum: what a motion keeps, and by how much the wrench changes it.

Products are formed as long doubles, which have room for any of them: an energy too large for a float is inf, not an
overflow or a difference of two infinities on the way.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..effects import REGISTRY
from ..kernels.arrays import Floats
from ..terms import Terms
from ..values import rotation
from ..values.body import Body
from ..values.state import BodyState, Motions


def kinetic_energy(body: Body, state: Motions) -> Any:
    """½ m v·v + ½ ω·I ω [J], with v the velocity of the centre of mass: a float, or an array for many states."""
    w_body = state.angular_velocity.astype(np.longdouble)
    velocity = center_of_mass_velocity(body, state).astype(np.longdouble)
    twice = body.mass * (velocity * velocity).sum(-1) + (w_body * (w_body @ body.inertia)).sum(-1)
    return _as_floats(twice / 2)


def energy_of_motion(terms: Terms, state: Motions) -> Any:
    """The same [J] with what the motion adds to the kinetic energy of the fluid around, where there is added mass."""
    energy, u = kinetic_energy(terms.body, state), terms.given["fluid"].velocity
    for name, acting in terms.acting.items():
        if (kinetic_of := REGISTRY[name].kinetic) is not None:
            energy = energy + sum(_as_floats(kinetic_of(one, terms.body, state, u)) for one in acting)
    return energy


def potential_energy(terms: Terms, state: Motions) -> Any:
    """−m g·x [J] of gravity, with the centre of mass x, and that of each effect: see its file.

    Gravity and constant forces have none at the world's origin. A float, or an array for many states.
    """
    body = terms.body
    energy = -body.mass * (center_of_mass_position(body, state) @ np.asarray(terms.gravity, np.longdouble))
    for name, acting in terms.acting.items():
        if (energy_of := REGISTRY[name].energy) is not None:
            energy = energy + sum(energy_of(one, body, state) for one in acting)
    return _as_floats(energy)


def _as_floats(energy: Any) -> Any:
    with np.errstate(over="ignore"):
        return float(energy) if np.ndim(energy) == 0 else energy.astype(float)


def point_position(state: Motions, point: ArrayLike) -> Floats:
    """Position [m, world, shape (..., 3)] of a body-fixed point [m] given from the body frame's origin, body axes."""
    return state.position + rotation.rotate_each(state.orientation, np.asarray(point, float))


def center_of_mass_position(body: Body, state: Motions) -> Floats:
    """Position [m] of the centre of mass, world axes, shape (..., 3)."""
    return point_position(state, body.center_of_mass)


def center_of_mass_velocity(body: Body, state: Motions) -> Floats:
    """Velocity [m/s] of the centre of mass, world axes, shape (..., 3): v_o + R (ω × c)."""
    around = rotation.cross_each(state.angular_velocity, body.center_of_mass)
    return state.velocity + rotation.rotate_each(state.orientation, around)


def angular_momentum_about_origin(body: Body, state: BodyState) -> Floats:
    """x × P + L [kg m²/s] about the world's origin, world axes, shape (3,)."""
    position = center_of_mass_position(body, state).astype(np.longdouble)
    return np.array([float(component) for component in np.cross(position, state.momentum) + state.angular_momentum])
