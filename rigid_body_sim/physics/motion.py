"""The equations of motion with every force there is, theory (2.6.1), and their exact derivative along a direction."""

import math

from .compiled import kernel
from .forces import (
    CARRIED,
    DRAG,
    FORCE,
    MASS,
    N_CARRIED,
    N_TETHERS,
    Q_BODY_PRINCIPAL,
    RESISTED,
    TETHERS_AT,
    arm_torque,
    force_world,
    rates_principal,
    torque_principal,
)
from .resistance import TETHER_SIZE, damp, drag_load, tether_change, tether_load
from .rotation import cross, qmultiply, qrotate, qrotate_back
from .state import L, P, Q, X


@kernel
def unit_attitude(y, at):
    """The quaternion of the state at ``y[at]``, scaled to unit length: between stages it is not."""
    w, x, y_, z = y[at + Q], y[at + Q + 1], y[at + Q + 2], y[at + Q + 3]
    unit = 1.0 / math.sqrt(w * w + x * x + y_ * y_ + z * z)
    return unit * w, unit * x, unit * y_, unit * z


@kernel
def body_attitude(model, qw, qx, qy, qz):
    """Quaternion body axes → world from that of the principal axes."""
    b = Q_BODY_PRINCIPAL
    return qmultiply(qw, qx, qy, qz, model[b], -model[b + 1], -model[b + 2], -model[b + 3])


@kernel
def rates_world(model, y, at, qw, qx, qy, qz):
    """Angular velocity in the world: ω = R I₀⁻¹ Rᵀ L."""
    wx, wy, wz = rates_principal(model, qw, qx, qy, qz, y[at + L], y[at + L + 1], y[at + L + 2])
    return qrotate(qw, qx, qy, qz, wx, wy, wz)


@kernel
def loads(model, y, at, qw, qx, qy, qz):
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
def derivative(model, y, at, slope, to):
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
def change_of_rates(model, y, at, qw, qx, qy, qz, wx, wy, wz, bx, by, bz, lx, ly, lz):
    """R I₀⁻¹ Rᵀ (δL − b × L): change of ω less its turning b × ω, for changes b of attitude and δL of L (world)."""
    mx, my, mz = cross(bx, by, bz, y[at + L], y[at + L + 1], y[at + L + 2])
    sx, sy, sz = rates_principal(model, qw, qx, qy, qz, lx - mx, ly - my, lz - mz)
    return qrotate(qw, qx, qy, qz, sx, sy, sz)


@kernel
def change_of_wrench(model, qw, qx, qy, qz, bx, by, bz):
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
def change_of_resistance(model, y, at, qw, qx, qy, qz, wx, wy, wz, d, i, ex, ey, ez):
    """Change of drag and tether forces and torques (world axes) for the change d[i:i + 12] of the state.

    (ex, ey, ez) is what ``change_of_rates`` gives for it.
    """
    m = model[MASS]
    vx, vy, vz = y[at + P] / m, y[at + P + 1] / m, y[at + P + 2] / m
    bx, by, bz = d[i + 3], d[i + 4], d[i + 5]
    cx, cy, cz = d[i + 6] / m, d[i + 7] / m, d[i + 8] / m
    rw, rx, ry, rz = body_attitude(model, qw, qx, qy, qz)
    fx, fy, fz, tx, ty, tz = drag_load(model, DRAG, rw, rx, ry, rz, vx, vy, vz, wx, wy, wz)
    fx, fy, fz = cross(bx, by, bz, fx, fy, fz)
    tx, ty, tz = cross(bx, by, bz, tx, ty, tz)
    sx, sy, sz = cross(bx, by, bz, vx, vy, vz)
    gx, gy, gz = damp(model, DRAG, rw, rx, ry, rz, vx, vy, vz, cx - sx, cy - sy, cz - sz)
    hx, hy, hz = damp(model, DRAG + 6, rw, rx, ry, rz, wx, wy, wz, ex, ey, ez)
    fx, fy, fz, tx, ty, tz = fx + gx, fy + gy, fz + gz, tx + hx, ty + hy, tz + hz
    sx, sy, sz = cross(bx, by, bz, wx, wy, wz)
    for n in range(int(model[N_TETHERS])):
        k = int(model[TETHERS_AT]) + TETHER_SIZE * n
        gx, gy, gz, hx, hy, hz = tether_change(
            model,
            k,
            rw,
            rx,
            ry,
            rz,
            y[at + X],
            y[at + X + 1],
            y[at + X + 2],
            vx,
            vy,
            vz,
            wx,
            wy,
            wz,
            d[i],
            d[i + 1],
            d[i + 2],
            bx,
            by,
            bz,
            cx,
            cy,
            cz,
            ex + sx,
            ey + sy,
            ez + sz,
        )
        fx, fy, fz, tx, ty, tz = fx + gx, fy + gy, fz + gz, tx + hx, ty + hy, tz + hz
    return fx, fy, fz, tx, ty, tz


@kernel
def change(model, y, at, d, i, out, o):
    """Derivative of the motion along d[i:i + 12] = (δx, b, δP, δL), all in world axes, into out[o:o + 12].

    The attitude is counted as exp(b) q from the present one, so its own equation is b' = ω − ½ b × ω + ...; exact, by
    the chain rule.
    """
    qw, qx, qy, qz = unit_attitude(y, at)
    wx, wy, wz = rates_world(model, y, at, qw, qx, qy, qz)
    bx, by, bz = d[i + 3], d[i + 4], d[i + 5]
    ex, ey, ez = change_of_rates(model, y, at, qw, qx, qy, qz, wx, wy, wz, bx, by, bz, d[i + 9], d[i + 10], d[i + 11])
    sx, sy, sz = cross(bx, by, bz, wx, wy, wz)
    fx, fy, fz, tx, ty, tz = change_of_wrench(model, qw, qx, qy, qz, bx, by, bz)
    if model[RESISTED] != 0.0:
        gx, gy, gz, hx, hy, hz = change_of_resistance(model, y, at, qw, qx, qy, qz, wx, wy, wz, d, i, ex, ey, ez)
        fx, fy, fz, tx, ty, tz = fx + gx, fy + gy, fz + gz, tx + hx, ty + hy, tz + hz
    for j in range(3):
        out[o + j] = d[i + 6 + j] / model[MASS]
    out[o + 3], out[o + 4], out[o + 5] = ex + 0.5 * sx, ey + 0.5 * sy, ez + 0.5 * sz
    out[o + 6], out[o + 7], out[o + 8] = fx, fy, fz
    out[o + 9], out[o + 10], out[o + 11] = tx, ty, tz
