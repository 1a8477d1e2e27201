"""The equations of motion with every force there is, theory (2.6.1), and their exact Jacobian."""

import math

from .arrays import Floats
from .compiled import kernel
from .model import (
    CARRIED,
    DRAG,
    FORCE,
    MASS,
    N_CARRIED,
    N_TETHERS,
    Q_BODY_PRINCIPAL,
    RESISTED,
    TETHERS_AT,
    rates_principal,
)
from .resistance import TETHER_SIZE, add_drag_jacobian, add_tether_jacobian, drag_load, tether_load
from .state import L, P, Q, X
from .vectors import cross, qmultiply, qrotate, qrotate_back, unit_vector
from .wrench import arm_torque, force_world, torque_principal


@kernel
def unit_attitude(y: Floats, at: int) -> tuple[float, float, float, float]:
    """The quaternion of the state at ``y[at]``, scaled to unit length: between stages it is not."""
    w, x, y_, z = y[at + Q], y[at + Q + 1], y[at + Q + 2], y[at + Q + 3]
    unit = 1.0 / math.sqrt(w * w + x * x + y_ * y_ + z * z)
    return unit * w, unit * x, unit * y_, unit * z


@kernel
def body_attitude(model: Floats, qw: float, qx: float, qy: float, qz: float) -> tuple[float, float, float, float]:
    """Quaternion body axes → world from that of the principal axes."""
    b = Q_BODY_PRINCIPAL
    return qmultiply(qw, qx, qy, qz, model[b], -model[b + 1], -model[b + 2], -model[b + 3])


@kernel
def rates_world(
    model: Floats, y: Floats, at: int, qw: float, qx: float, qy: float, qz: float
) -> tuple[float, float, float]:
    """Angular velocity in the world: ω = R I₀⁻¹ Rᵀ L."""
    wx, wy, wz = rates_principal(model, qw, qx, qy, qz, y[at + L], y[at + L + 1], y[at + L + 2])
    return qrotate(qw, qx, qy, qz, wx, wy, wz)


@kernel
def loads(
    model: Floats, y: Floats, at: int, qw: float, qx: float, qy: float, qz: float
) -> tuple[float, float, float, float, float, float]:
    """Force and torque about the centre of mass, world axes, at the state y[at:at + 13] of unit attitude q."""
    fx, fy, fz = force_world(model, qw, qx, qy, qz)
    tx, ty, tz = torque_principal(model, qw, qx, qy, qz)
    tx, ty, tz = qrotate(qw, qx, qy, qz, tx, ty, tz)
    if model[RESISTED] == 0.0:
        return fx, fy, fz, tx, ty, tz
    m = model[MASS]
    vx, vy, vz = y[at + P] / m, y[at + P + 1] / m, y[at + P + 2] / m
    wx, wy, wz = rates_world(model, y, at, qw, qx, qy, qz)
    bw, bx, by, bz = body_attitude(model, qw, qx, qy, qz)
    ax, ay, az, ux, uy, uz = drag_load(model, DRAG, bw, bx, by, bz, vx, vy, vz, wx, wy, wz)
    fx, fy, fz, tx, ty, tz = fx + ax, fy + ay, fz + az, tx + ux, ty + uy, tz + uz
    for i in range(int(model[N_TETHERS])):
        k = int(model[TETHERS_AT]) + TETHER_SIZE * i
        ax, ay, az, ux, uy, uz = tether_load(
            model, k, bw, bx, by, bz, y[at + X], y[at + X + 1], y[at + X + 2], vx, vy, vz, wx, wy, wz
        )
        fx, fy, fz, tx, ty, tz = fx + ax, fy + ay, fz + az, tx + ux, ty + uy, tz + uz
    return fx, fy, fz, tx, ty, tz


@kernel
def derivative(model: Floats, y: Floats, at: int, slope: Floats, to: int) -> None:
    """dY/dt of the state that begins at ``y[at]`` into ``slope[to:to + 13]``; theory (2.6.1) with q for R.

    Between the stages of a method q is not of unit length, and a rotation needs it to be: without that, the error
    depends on which way the body axes were chosen to point.
    """
    qw, qx, qy, qz = unit_attitude(y, at)
    wx, wy, wz = rates_principal(model, qw, qx, qy, qz, y[at + L], y[at + L + 1], y[at + L + 2])
    for i in range(3):
        slope[to + X + i] = y[at + P + i] / model[MASS]
    q = at + Q
    slope[to + Q], slope[to + Q + 1], slope[to + Q + 2], slope[to + Q + 3] = qmultiply(
        y[q], y[q + 1], y[q + 2], y[q + 3], 0.0, 0.5 * wx, 0.5 * wy, 0.5 * wz
    )
    p, l = to + P, to + L
    slope[p], slope[p + 1], slope[p + 2], slope[l], slope[l + 1], slope[l + 2] = loads(model, y, at, qw, qx, qy, qz)


@kernel
def change_of_wrench(
    model: Floats, qw: float, qx: float, qy: float, qz: float, bx: float, by: float, bz: float
) -> tuple[float, float, float, float, float, float]:
    """Change of the held wrench's force and torque (world axes) for a small rotation b of the body."""
    fx, fy, fz = qrotate(qw, qx, qy, qz, model[FORCE], model[FORCE + 1], model[FORCE + 2])
    fx, fy, fz = cross(bx, by, bz, fx, fy, fz)
    tx, ty, tz = torque_principal(model, qw, qx, qy, qz)
    tx, ty, tz = qrotate(qw, qx, qy, qz, tx, ty, tz)
    tx, ty, tz = cross(bx, by, bz, tx, ty, tz)
    for i in range(int(model[N_CARRIED])):
        c = CARRIED + 3 * i
        sx, sy, sz = cross(model[c], model[c + 1], model[c + 2], bx, by, bz)  # Rᵀ B changes by Rᵀ (B × b)
        sx, sy, sz = qrotate_back(qw, qx, qy, qz, sx, sy, sz)
        sx, sy, sz = arm_torque(model, i, sx, sy, sz)
        sx, sy, sz = qrotate(qw, qx, qy, qz, sx, sy, sz)
        tx, ty, tz = tx + sx, ty + sy, tz + sz
    return fx, fy, fz, tx, ty, tz


@kernel
def jacobian(model: Floats, y: Floats, at: int, taut: bool, out: Floats, o: int) -> None:
    """Exact Jacobian of (δx, b, δP, δL)' in world axes, 12 rows of 12 in out[o:o + 144], at the state y[at:].

    The attitude is counted as exp(b) q from the present one, so its own equation is b' = ω − ½ b × ω + ...; with
    ω = A L and A = R I₀⁻¹ Rᵀ, ω changes by A δL + (A [L]× − [ω]×) b. ``taut`` counts slack tethers as pulling.
    """
    for i in range(144):
        out[o + i] = 0.0
    qw, qx, qy, qz = unit_attitude(y, at)
    lx, ly, lz = y[at + L], y[at + L + 1], y[at + L + 2]
    wx, wy, wz = rates_world(model, y, at, qw, qx, qy, qz)
    for i in range(3):
        ix, iy, iz = unit_vector(i)
        out[o + 12 * i + 6 + i] = 1.0 / model[MASS]
        ax, ay, az = rates_principal(model, qw, qx, qy, qz, ix, iy, iz)
        ax, ay, az = qrotate(qw, qx, qy, qz, ax, ay, az)
        bx, by, bz = cross(ax, ay, az, lx, ly, lz)
        cx, cy, cz = cross(ix, iy, iz, wx, wy, wz)
        row = o + 36 + 12 * i
        out[row + 3], out[row + 4], out[row + 5] = bx - 0.5 * cx, by - 0.5 * cy, bz - 0.5 * cz
        out[row + 9], out[row + 10], out[row + 11] = ax, ay, az
    if model[RESISTED] != 0.0:
        _add_resistance(model, y, at, taut, qw, qx, qy, qz, wx, wy, wz, out, o)
    for i in range(3):
        fx, fy, fz, tx, ty, tz = change_of_wrench(model, qw, qx, qy, qz, *unit_vector(i))
        c = o + 72 + 3 + i
        out[c], out[c + 12], out[c + 24] = out[c] + fx, out[c + 12] + fy, out[c + 24] + fz
        out[c + 36], out[c + 48], out[c + 60] = out[c + 36] + tx, out[c + 48] + ty, out[c + 60] + tz


@kernel
def _add_resistance(
    model: Floats,
    y: Floats,
    at: int,
    taut: bool,
    qw: float,
    qx: float,
    qy: float,
    qz: float,
    wx: float,
    wy: float,
    wz: float,
    out: Floats,
    o: int,
) -> None:
    """Rows of P and L: drag and tethers, first by velocity and rates, which then become momenta and attitude."""
    m = model[MASS]
    vx, vy, vz = y[at + P] / m, y[at + P + 1] / m, y[at + P + 2] / m
    rw, rx, ry, rz = body_attitude(model, qw, qx, qy, qz)
    add_drag_jacobian(model, DRAG, rw, rx, ry, rz, vx, vy, vz, wx, wy, wz, out, o + 72)
    x = at + X
    for i in range(int(model[N_TETHERS])):
        k = int(model[TETHERS_AT]) + TETHER_SIZE * i
        add_tether_jacobian(
            model, k, taut, rw, rx, ry, rz, y[x], y[x + 1], y[x + 2], vx, vy, vz, wx, wy, wz, out, o + 72
        )
    for row in range(o + 72, o + 144, 12):
        sx, sy, sz = out[row + 9], out[row + 10], out[row + 11]
        a = o + 36 + 9
        ax = sx * out[a] + sy * out[a + 12] + sz * out[a + 24]
        ay = sx * out[a + 1] + sy * out[a + 13] + sz * out[a + 25]
        az = sx * out[a + 2] + sy * out[a + 14] + sz * out[a + 26]
        bx, by, bz = cross(ax, ay, az, y[at + L], y[at + L + 1], y[at + L + 2])
        cx, cy, cz = cross(sx, sy, sz, wx, wy, wz)
        for i in range(3):
            out[row + 6 + i] /= m
        out[row + 3], out[row + 4], out[row + 5] = (
            out[row + 3] + bx - cx,
            out[row + 4] + by - cy,
            out[row + 5] + bz - cz,
        )
        out[row + 9], out[row + 10], out[row + 11] = ax, ay, az
