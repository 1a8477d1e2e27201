"""How fast the velocities change at a moment, with every force there is."""

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

from .arrays import Floats
from .compiled import kernel
from .model import CENTER_OF_MASS, EULER, INTERNAL, INTERNAL_SLOPE, MASS, MOMENTS, rates_of_whole, to_body
from .motion import Acting, body_attitude, loads
from .state import L, Q
from .tuples import Quat, Vec, rotate
from .vectors import cross, qrotate_back
from .wrench import reduce_wrench

Accelerations: TypeAlias = tuple[float, float, float, float, float, float]


@kernel
def read_acceleration(acting: Acting, state: Floats, model: Floats) -> Accelerations:
    """(a [m/s²], dω/dt [rad/s²]): of the body frame's origin, world axes, and in body axes; 6 numbers.

    By theory (2.1.2) for the centre of mass and Euler's equation (2.5.6) in principal axes, to whose torque what spins
    inside, with the angular momentum h, adds h × ω − h'. The origin is at −R c from the centre of mass, so
    a_o = F/m − R (ω' × c + ω × (ω × c)) with c, ω and ω' in body axes.
    """
    reduce_wrench(model)  # a wrench set since the last step is not reduced yet
    acting.drive.hold(model)
    acting.drive.settle(model)
    qw, qx, qy, qz = state[Q], state[Q + 1], state[Q + 2], state[Q + 3]
    q = Quat(qw, qx, qy, qz)
    force, torque = loads(acting, model, state, 0, q)
    tx, ty, tz = qrotate_back(qw, qx, qy, qz, torque.x, torque.y, torque.z)
    wx, wy, wz = rates_of_whole(model, qw, qx, qy, qz, state[L], state[L + 1], state[L + 2])
    hx, hy, hz = cross(model[INTERNAL], model[INTERNAL + 1], model[INTERNAL + 2], wx, wy, wz)
    i = INTERNAL_SLOPE
    tx, ty, tz = tx + (hx - model[i]), ty + (hy - model[i + 1]), tz + (hz - model[i + 2])
    ax, ay, az = to_body(
        model,
        tx / model[MOMENTS] + model[EULER] * wy * wz,
        ty / model[MOMENTS + 1] + model[EULER + 1] * wz * wx,
        tz / model[MOMENTS + 2] + model[EULER + 2] * wx * wy,
    )
    wx, wy, wz = to_body(model, wx, wy, wz)
    c, m = CENTER_OF_MASS, model[MASS]
    ux, uy, uz = cross(ax, ay, az, model[c], model[c + 1], model[c + 2])
    vx, vy, vz = cross(wx, wy, wz, model[c], model[c + 1], model[c + 2])
    vx, vy, vz = cross(wx, wy, wz, vx, vy, vz)
    u = rotate(body_attitude(model, q), Vec(ux + vx, uy + vy, uz + vz))
    return force.x / m - u.x, force.y / m - u.y, force.z / m - u.z, ax, ay, az


@cache
def acceleration_reader(acting: Acting) -> Callable[[Floats, Floats], Accelerations]:
    """The kernel ``read(state, model)`` under loads; see ``read_acceleration``."""

    def read(state: Floats, model: Floats) -> Accelerations:
        return read_acceleration(acting, state, model)

    return read
