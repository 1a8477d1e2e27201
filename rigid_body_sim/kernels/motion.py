"""The equations of motion with every force there is, theory (2.6.1), and their exact Jacobian."""

import math
from collections.abc import Callable
from typing import NamedTuple

from .arrays import Floats
from .compiled import kernel
from .drive import Drive
from .model import CARRIED, FLUID, FORCE, MASS, N_CARRIED, Q_BODY_PRINCIPAL, rates_of_whole, rates_principal, to_body
from .state import L, P, Q, X
from .straight_line import straight_line
from .tuples import Load, Motion, Quat, Vec, crossed, minus, rotate_back, scaled, vec
from .vectors import cross, exponential_minus_one, qmultiply, qrotate, qrotate_back, unit_vector
from .wrench import arm_torque, force_world, torque_principal


class Passed(NamedTuple):
    """By how much a sub-step went past the first event in it, and where in it another may begin and end.

    ``by`` counts what round-off may hide: 0 or less where there was no event. ``peak``: the share of the sub-step after
    which a load that did not act comes closest to acting, 1 where it stays away.
    """

    by: float
    peak: float


class Acting(NamedTuple):
    """Kernels of all loads that act in a scene, one after the other, of each kind of question; see effects.base.

    ``advance`` lets a step pass for what goes on from step to step; ``drive`` are the kernels of actuators.
    """

    add_load: Callable[[Floats, Motion, Load], Load]
    add_jacobian: Callable[[Floats, Motion, bool, Floats, int], None]
    passes_kink: Callable[[Floats, Floats, Floats, int], bool]
    ringing: Callable[[Floats, Floats, float], float]
    settle: Callable[[Floats, Motion], None]
    passed: Callable[[Floats, Motion, Motion, float], Passed]
    advance: Callable[[Floats, float], None]
    drive: Drive
    transform: Callable[[Floats, Motion, Load], Load]
    transform_jacobian: Callable[[Floats, Quat, Motion, Floats, int], None]


@kernel
def unit_attitude(y: Floats, at: int) -> Quat:
    """The quaternion of the state at ``y[at]``, scaled to unit length: between stages it is not."""
    w, x, y_, z = y[at + Q], y[at + Q + 1], y[at + Q + 2], y[at + Q + 3]
    unit = 1.0 / math.sqrt(w * w + x * x + y_ * y_ + z * z)
    return Quat(unit * w, unit * x, unit * y_, unit * z)


@kernel
def fluid_velocity(model: Floats) -> Vec:
    """Velocity of the fluid around [m/s], world axes."""
    return vec(model, int(model[FLUID]))


@straight_line
def body_attitude(model: Floats, q: Quat) -> Quat:
    """Quaternion body axes → world from that of the principal axes."""
    b = Q_BODY_PRINCIPAL
    w, x, y, z = qmultiply(q.w, q.x, q.y, q.z, model[b], -model[b + 1], -model[b + 2], -model[b + 3])
    return Quat(w, x, y, z)


@straight_line
def rates_of(model: Floats, q: Quat, l_world: Vec) -> Vec:
    """Angular velocity in the world from L: ω = R I₀⁻¹ (Rᵀ L − h)."""
    wx, wy, wz = rates_of_whole(model, q.w, q.x, q.y, q.z, l_world.x, l_world.y, l_world.z)
    wx, wy, wz = qrotate(q.w, q.x, q.y, q.z, wx, wy, wz)
    return Vec(wx, wy, wz)


@straight_line
def rates_world(model: Floats, y: Floats, at: int, q: Quat) -> Vec:
    """The same of the state at ``y[at]``."""
    return rates_of(model, q, vec(y, at + L))


@kernel
def motion(model: Floats, y: Floats, at: int, q: Quat) -> Motion:
    """How the body moves at the state ``y[at]`` of unit attitude q."""
    m, p = model[MASS], at + P
    velocity = Vec(y[p] / m, y[p + 1] / m, y[p + 2] / m)
    return Motion(body_attitude(model, q), vec(y, at + X), velocity, rates_world(model, y, at, q))


@kernel
def mobility(model: Floats, q: Quat, arm: Vec, n: Vec) -> float:
    """Acceleration of a body point along the unit vector n by a force of 1 N along it [1/kg]; world axes.

    ``q`` is from the principal axes, ``arm`` from the centre of mass.
    """
    t = crossed(arm, n)
    wx, wy, wz = rates_principal(model, q.w, q.x, q.y, q.z, t.x, t.y, t.z)
    tx, ty, tz = qrotate_back(q.w, q.x, q.y, q.z, t.x, t.y, t.z)
    return 1.0 / model[MASS] + tx * wx + ty * wy + tz * wz


@kernel
def held_load(model: Floats, q: Quat) -> Load:
    """Force and torque of the held wrench, of gravity and of levers, at the attitude q (principal axes → world)."""
    fx, fy, fz = force_world(model, q.w, q.x, q.y, q.z)
    tx, ty, tz = torque_principal(model, q.w, q.x, q.y, q.z)
    tx, ty, tz = qrotate(q.w, q.x, q.y, q.z, tx, ty, tz)
    return Load(Vec(fx, fy, fz), Vec(tx, ty, tz))


@kernel
def loads(acting: Acting, model: Floats, y: Floats, at: int, q: Quat) -> Load:
    """Force and torque about the centre of mass, world axes, at the state y[at:at + 13] of unit attitude q."""
    acting.settle(model, motion(model, y, at, q))
    return loads_as_settled(acting, model, y, at, q)


@kernel
def loads_as_settled(acting: Acting, model: Floats, y: Floats, at: int, q: Quat) -> Load:
    """The same with what acts and what does not as it was settled, so that it is smooth within a sub-step."""
    return acting.add_load(model, motion(model, y, at, q), held_load(model, q))


@kernel
def derivative(acting: Acting, model: Floats, y: Floats, at: int, slope: Floats, to: int) -> None:
    """dY/dt of the state that begins at ``y[at]`` into ``slope[to:to + 13]``; theory (2.6.1) with q for R.

    Between the stages of a method q is not of unit length, and a rotation needs it to be: without that, the error
    depends on which way the body axes were chosen to point.
    """
    unit = unit_attitude(y, at)
    wx, wy, wz = rates_of_whole(model, unit.w, unit.x, unit.y, unit.z, y[at + L], y[at + L + 1], y[at + L + 2])
    for i in range(3):
        slope[to + X + i] = y[at + P + i] / model[MASS]
    q = at + Q
    slope[to + Q], slope[to + Q + 1], slope[to + Q + 2], slope[to + Q + 3] = qmultiply(
        y[q], y[q + 1], y[q + 2], y[q + 3], 0.0, 0.5 * wx, 0.5 * wy, 0.5 * wz
    )
    load = loads(acting, model, y, at, unit)
    p, l = to + P, to + L
    slope[p], slope[p + 1], slope[p + 2] = load.force
    slope[l], slope[l + 1], slope[l + 2] = load.torque


@kernel
def velocities_body(state: Floats, model: Floats, work: Floats, z: int, share: float) -> tuple[Vec, Vec]:
    """Momentum of the centre of mass and ω, body axes, at a share of the increments work[z:z + 12] (δx, θ, δP, δL).

    The momentum is that of the velocity through the fluid.
    """
    dw, dx, dy, dz = exponential_minus_one(share * work[z + 3], share * work[z + 4], share * work[z + 5])
    qw, qx, qy, qz = qmultiply(1.0 + dw, dx, dy, dz, state[Q], state[Q + 1], state[Q + 2], state[Q + 3])
    p = Vec(state[P] + share * work[z + 6], state[P + 1] + share * work[z + 7], state[P + 2] + share * work[z + 8])
    p = minus(p, scaled(model[MASS], fluid_velocity(model)))
    lx, ly, lz = (
        state[L] + share * work[z + 9],
        state[L + 1] + share * work[z + 10],
        state[L + 2] + share * work[z + 11],
    )
    wx, wy, wz = rates_of_whole(model, qw, qx, qy, qz, lx, ly, lz)
    wx, wy, wz = to_body(model, wx, wy, wz)
    return rotate_back(body_attitude(model, Quat(qw, qx, qy, qz)), p), Vec(wx, wy, wz)


@kernel
def change_of_wrench(model: Floats, q: Quat, b: Vec) -> Load:
    """Change of the held wrench's force and torque (world axes) for a small rotation b of the body."""
    fx, fy, fz = qrotate(q.w, q.x, q.y, q.z, model[FORCE], model[FORCE + 1], model[FORCE + 2])
    fx, fy, fz = cross(b.x, b.y, b.z, fx, fy, fz)
    tx, ty, tz = torque_principal(model, q.w, q.x, q.y, q.z)
    tx, ty, tz = qrotate(q.w, q.x, q.y, q.z, tx, ty, tz)
    tx, ty, tz = cross(b.x, b.y, b.z, tx, ty, tz)
    for i in range(int(model[N_CARRIED])):
        c = CARRIED + 3 * i
        sx, sy, sz = cross(model[c], model[c + 1], model[c + 2], b.x, b.y, b.z)  # Rᵀ B changes by Rᵀ (B × b)
        sx, sy, sz = qrotate_back(q.w, q.x, q.y, q.z, sx, sy, sz)
        sx, sy, sz = arm_torque(model, i, sx, sy, sz)
        sx, sy, sz = qrotate(q.w, q.x, q.y, q.z, sx, sy, sz)
        tx, ty, tz = tx + sx, ty + sy, tz + sz
    return Load(Vec(fx, fy, fz), Vec(tx, ty, tz))


@kernel
def jacobian(acting: Acting, model: Floats, y: Floats, at: int, taut: bool, out: Floats, o: int) -> None:
    """Exact Jacobian of (δx, b, δP, δL)' in world axes, 12 rows of 12 in out[o:o + 144], at the state y[at:].

    The attitude is counted as exp(b) q from the present one, so its own equation is b' = ω − ½ b × ω + ...; with
    ω = A L − R I₀⁻¹ h and A = R I₀⁻¹ Rᵀ, ω changes by A δL + (A [L]× − [ω]×) b. ``taut``: slack tethers pull, too, and
    a body rests on each contact.
    """
    for i in range(144):
        out[o + i] = 0.0
    q = unit_attitude(y, at)
    body = motion(model, y, at, q)
    lx, ly, lz, w = y[at + L], y[at + L + 1], y[at + L + 2], body.w
    for i in range(3):
        ix, iy, iz = unit_vector(i)
        out[o + 12 * i + 6 + i] = 1.0 / model[MASS]
        ax, ay, az = rates_principal(model, q.w, q.x, q.y, q.z, ix, iy, iz)
        ax, ay, az = qrotate(q.w, q.x, q.y, q.z, ax, ay, az)
        bx, by, bz = cross(ax, ay, az, lx, ly, lz)
        cx, cy, cz = cross(ix, iy, iz, w.x, w.y, w.z)
        row = o + 36 + 12 * i
        out[row + 3], out[row + 4], out[row + 5] = bx - 0.5 * cx, by - 0.5 * cy, bz - 0.5 * cz
        out[row + 9], out[row + 10], out[row + 11] = ax, ay, az
    acting.add_jacobian(model, body, taut, out, o + 72)
    _by_momenta(model, vec(y, at + L), w, out, o)
    for i in range(3):
        x, y_, z = unit_vector(i)
        change = change_of_wrench(model, q, Vec(x, y_, z))
        c = o + 72 + 3 + i
        f, t = change.force, change.torque
        out[c], out[c + 12], out[c + 24] = out[c] + f.x, out[c + 12] + f.y, out[c + 24] + f.z
        out[c + 36], out[c + 48], out[c + 60] = out[c + 36] + t.x, out[c + 48] + t.y, out[c + 60] + t.z
    acting.transform_jacobian(model, q, body, out, o)


@kernel
def _by_momenta(model: Floats, l_world: Vec, w_world: Vec, out: Floats, o: int) -> None:
    """Rows of P and L, so far by velocity and rates: those become momenta and attitude."""
    for row in range(o + 72, o + 144, 12):
        sx, sy, sz = out[row + 9], out[row + 10], out[row + 11]
        a = o + 36 + 9
        ax = sx * out[a] + sy * out[a + 12] + sz * out[a + 24]
        ay = sx * out[a + 1] + sy * out[a + 13] + sz * out[a + 25]
        az = sx * out[a + 2] + sy * out[a + 14] + sz * out[a + 26]
        bx, by, bz = cross(ax, ay, az, l_world.x, l_world.y, l_world.z)
        cx, cy, cz = cross(sx, sy, sz, w_world.x, w_world.y, w_world.z)
        for i in range(3):
            out[row + 6 + i] /= model[MASS]
        out[row + 3], out[row + 4], out[row + 5] = (
            out[row + 3] + bx - cx,
            out[row + 4] + by - cy,
            out[row + 5] + bz - cz,
        )
        out[row + 9], out[row + 10], out[row + 11] = ax, ay, az
