"""The state of a rigid body: the flat layout that the kernels advance.

Layout of the flat state, 26 numbers, theory (2.6.1): (x, q, P, L), then the low-order parts of the same 13 numbers,
which compensated summation keeps. A number's best value is the sum of the two.

The spin of a thin body about its long axis is a small component of Rᵀ L over a small moment: one unit of round-off in q
or L is an error of ε |L| / I in it. So for a thin body the low-order parts count whenever Rᵀ L is formed, and an
integrator that knows Rᵀ L better than q says writes it back into them (``align``).
"""

import math
from collections.abc import Sequence
from typing import Any

from .arrays import Floats
from .compiled import kernel
from .extended import xrotate_back, xunscale
from .model import (
    CENTER_OF_MASS,
    FASTEST,
    INTERNAL,
    MASS,
    MOMENTS,
    MOST_MOMENTUM,
    Q_BODY_PRINCIPAL,
    SAFE_ANGULAR_MOMENTUM,
    rates_of_whole,
    to_body,
    to_principal,
)
from .row_vectors import xrotated_back
from .straight_line import straight_line
from .symbols import Row, magnitude, row, set_row, sum_of
from .vectors import cross, qmultiply, qrotate, qrotate_back

X = 0  # position of the centre of mass [m, world], 3
Q = 3  # unit quaternion (w, x, y, z), principal axes → world, 4
P = 7  # momentum [kg m/s, world], 3
L = 10  # angular momentum about the centre of mass, with that of what spins inside [kg m²/s, world], 3
LOW = 13  # where the low-order parts begin
SIZE = 26
THIN = 10.0  # ratio of the moments above which a body counts as thin
NO_LOW_PARTS = 1e-280  # kg m²/s: below it, low-order parts underflow


@kernel
def is_thin(model: Floats) -> bool:
    """Whether the moments differ so much that the low-order parts of q and L count."""
    x, y, z = model[MOMENTS], model[MOMENTS + 1], model[MOMENTS + 2]
    return max(x, y, z) > THIN * min(x, y, z)


@straight_line
def body_momentum(state: Floats) -> tuple[float, float, float, float, float, float]:
    """Rᵀ L, principal axes, as three extended numbers, with the low-order parts of q and L."""
    momentum, low = (row(state, at + L - 1, 4)[[1, 2, 3, 1]] for at in (0, LOW))
    high, low = xrotated_back(row(state, Q, 4), row(state, LOW + Q, 4), momentum, low)
    return high[0], low[0], high[1], low[1], high[2], low[2]


@kernel
def rates(state: Floats, model: Floats) -> tuple[float, float, float]:
    """Angular velocity of the state in principal axes, to round-off for thin bodies too."""
    if is_thin(model):
        x, _, y, _, z, _ = body_momentum(state)
        i, m = INTERNAL, MOMENTS
        return (x - model[i]) / model[m], (y - model[i + 1]) / model[m + 1], (z - model[i + 2]) / model[m + 2]
    return rates_of_whole(
        model, state[Q], state[Q + 1], state[Q + 2], state[Q + 3], state[L], state[L + 1], state[L + 2]
    )


@kernel
def align(state: Floats, x: float, xl: float, y: float, yl: float, z: float, zl: float) -> None:
    """Turn the attitude by the round-off by which Rᵀ L misses the direction of (x, y, z), extended, principal axes."""
    a, al, b, bl, c, cl = body_momentum(state)
    size = max(abs(a), abs(b), abs(c))
    if not size > NO_LOW_PARTS:
        return
    # A small rotation δ of the body changes l = Rᵀ L by l × δ, and δ = d × l / l·l makes that d, less its part along l.
    dx, dy, dz = ((x - a) + (xl - al)) / size, ((y - b) + (yl - bl)) / size, ((z - c) + (zl - cl)) / size
    a, b, c = a / size, b / size, c / size
    dx, dy, dz = cross(dx, dy, dz, a, b, c)
    half = 0.5 / (a * a + b * b + c * c)
    w, x, y, z = qmultiply(state[Q], state[Q + 1], state[Q + 2], state[Q + 3], 0.0, half * dx, half * dy, half * dz)
    add_compensated(state, Q, w)
    add_compensated(state, Q + 1, x)
    add_compensated(state, Q + 2, y)
    add_compensated(state, Q + 3, z)


@kernel
def write_state(values: Sequence[float] | Floats, model: Floats, state: Floats) -> None:
    """The inverse of ``read_motion``: flat, from position, orientation, velocity and ω of the body frame (13 numbers).

    Position, orientation (w, x, y, z) and velocity are in the world, ω in body axes.
    """
    px, py, pz, qw, qx, qy, qz = values[0], values[1], values[2], values[3], values[4], values[5], values[6]
    wx, wy, wz, c, b, m = values[10], values[11], values[12], CENTER_OF_MASS, Q_BODY_PRINCIPAL, MOMENTS
    cx, cy, cz, mass = model[c], model[c + 1], model[c + 2], model[MASS]
    rx, ry, rz = qrotate(qw, qx, qy, qz, cx, cy, cz)
    ux, uy, uz = cross(wx, wy, wz, cx, cy, cz)
    ux, uy, uz = qrotate(qw, qx, qy, qz, ux, uy, uz)
    state[X], state[X + 1], state[X + 2] = px + rx, py + ry, pz + rz
    w, x, y, z = qmultiply(qw, qx, qy, qz, model[b], model[b + 1], model[b + 2], model[b + 3])
    state[Q], state[Q + 1], state[Q + 2], state[Q + 3] = w, x, y, z
    state[P], state[P + 1], state[P + 2] = mass * (values[7] + ux), mass * (values[8] + uy), mass * (values[9] + uz)
    lx, ly, lz = to_principal(model, wx, wy, wz)
    lx, ly, lz = model[m] * lx, model[m + 1] * ly, model[m + 2] * lz
    lx, ly, lz = lx + model[INTERNAL], ly + model[INTERNAL + 1], lz + model[INTERNAL + 2]
    # R l to the nearest floats and their low-order parts, with q of unit length but for round-off
    qq, qql, ax, axl, ay, ayl, az, azl = xrotate_back(w, 0.0, -x, 0.0, -y, 0.0, -z, 0.0, lx, 0.0, ly, 0.0, lz, 0.0)
    for i in range(LOW, SIZE):
        state[i] = 0.0
    state[L], state[LOW + L] = xunscale(ax, axl, qq, qql)
    state[L + 1], state[LOW + L + 1] = xunscale(ay, ayl, qq, qql)
    state[L + 2], state[LOW + L + 2] = xunscale(az, azl, qq, qql)


@kernel
def write_states(values: Floats, models: Floats, width: int, states: Floats) -> None:
    """``write_state`` of many bodies, from 13 numbers each; from one model to the next it is ``width`` numbers."""
    for i in range(len(states) // SIZE):
        write_state(values[13 * i : 13 * (i + 1)], models[width * i :], states[SIZE * i : SIZE * (i + 1)])


@kernel
def read_pose(state: Floats, model: Floats) -> tuple[float, float, float, float, float, float, float]:
    """(x, y, z, qw, qx, qy, qz) of the body frame in the world; its origin is at o = x − R c, with c in body axes."""
    b = Q_BODY_PRINCIPAL
    qw, qx, qy, qz = qmultiply(
        state[Q], state[Q + 1], state[Q + 2], state[Q + 3], model[b], -model[b + 1], -model[b + 2], -model[b + 3]
    )
    c = CENTER_OF_MASS
    rx, ry, rz = qrotate(qw, qx, qy, qz, model[c], model[c + 1], model[c + 2])
    return state[X] - rx, state[X + 1] - ry, state[X + 2] - rz, qw, qx, qy, qz


@kernel
def read_motion(
    state: Floats, model: Floats
) -> tuple[
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
]:
    """Pose (7) of the body frame, then velocity of its origin and ω in world axes (6), then both in body axes (6).

    The velocity of the origin is v_o = P/m − R (ω × c), with c and ω in body axes.
    """
    wx, wy, wz = rates(state, model)
    wx, wy, wz = to_body(model, wx, wy, wz)
    px, py, pz, qw, qx, qy, qz = read_pose(state, model)
    c, m = CENTER_OF_MASS, model[MASS]
    ux, uy, uz = cross(wx, wy, wz, model[c], model[c + 1], model[c + 2])
    ux, uy, uz = qrotate(qw, qx, qy, qz, ux, uy, uz)
    vx, vy, vz = state[P] / m - ux, state[P + 1] / m - uy, state[P + 2] / m - uz
    ux, uy, uz = qrotate_back(qw, qx, qy, qz, vx, vy, vz)
    sx, sy, sz = qrotate(qw, qx, qy, qz, wx, wy, wz)
    return px, py, pz, qw, qx, qy, qz, vx, vy, vz, sx, sy, sz, ux, uy, uz, wx, wy, wz


MOTION_SIZE = 19  # numbers of read_motion


@kernel
def read_motions(states: Floats, models: Floats, width: int, motions: Floats) -> None:
    """Put ``read_motion`` of each of many flat states, one after the other, into ``motions``.

    From one model to the next it is ``width`` numbers: 0 where all states are those of one body.
    """
    for i in range(len(states) // SIZE):
        motion = read_motion(states[SIZE * i : SIZE * (i + 1)], models[width * i :])
        for j in range(MOTION_SIZE):
            motions[MOTION_SIZE * i + j] = motion[j]


@straight_line
def add_compensated(state: Floats, i: int, d: float) -> None:
    """state[i] += d, keeping what round-off would drop in the low-order part: Knuth's TwoSum (TAOCP vol. 2, 4.2.2)."""
    high = state[i]
    d += state[LOW + i]
    total = high + d
    kept = total - high
    state[LOW + i] = (high - (total - kept)) + (d - kept)
    state[i] = total


def add_row(state: Any, at: int, gain: Row) -> None:
    """The same for the four numbers from state[at] on, in a straight_line kernel."""
    high, d = row(state, at, 4), gain + row(state, LOW + at, 4)
    total = high + d
    kept = total - high
    set_row(state, LOW + at, (high - (total - kept)) + (d - kept))
    set_row(state, at, total)


@kernel
def add_to_attitude(state: Floats, dw: float, dx: float, dy: float, dz: float) -> None:
    """Add to the quaternion and scale it to unit length; when nothing is added, not one bit changes."""
    if dw == 0.0 and dx == 0.0 and dy == 0.0 and dz == 0.0:
        return
    w, x, y, z = state[Q] + dw, state[Q + 1] + dx, state[Q + 2] + dy, state[Q + 3] + dz
    unit = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    state[Q], state[Q + 1], state[Q + 2], state[Q + 3] = unit * w, unit * x, unit * y, unit * z


@straight_line
def copy(source: Floats, at: int, target: Floats, to: int) -> None:
    """Copy the 26 numbers of a state from source[at:] to target[to:]."""
    for i in (0, 8, 16, SIZE - 8):
        set_row(target, to + i, row(source, at + i, 8))


@kernel
def is_finite(state: Floats, model: Floats) -> bool:
    """Whether all 13 numbers are finite, the attitude is one, and the velocities are finite in whatever axes.

    A change of the quaternion whose square overflows leaves it zero.
    """
    nothing, turn, momentum, angular_momentum = _sizes(state)
    if not (nothing == 0.0 and turn > 0.0):
        return False
    if momentum <= model[MOST_MOMENTUM] and angular_momentum <= model[SAFE_ANGULAR_MOMENTUM]:
        return True
    most = model[MOST_MOMENTUM]
    if abs(state[P]) > most or abs(state[P + 1]) > most or abs(state[P + 2]) > most:
        return False
    return _rates_are_finite(state, model)


def seems_finite(state: Any, model: Any) -> Any:
    """Of eight bodies in lanes: for which ``is_finite`` is true at once."""
    nothing, turn, momentum, angular_momentum = _sizes(state)
    small = (momentum <= model[MOST_MOMENTUM]) & (angular_momentum <= model[SAFE_ANGULAR_MOMENTUM])
    return (nothing <= 0.0) & (turn > 0.0) & small


@straight_line
def _sizes(state: Floats) -> tuple[float, float, float, float]:
    """0 where all is finite, else NaN; |q|²; sums of the absolute values of P and of L."""
    rows = [row(state, at, 4) for at in (X, Q, P, L - 1)]
    nothing = [one - one for one in rows]
    q, p, l = rows[1], magnitude(rows[2]), magnitude(rows[3])
    return (
        sum_of((nothing[0] + nothing[1]) + (nothing[2] + nothing[3])),
        sum_of(q * q),
        (p[0] + p[1]) + p[2],
        (l[1] + l[2]) + l[3],
    )


@kernel
def _rates_are_finite(state: Floats, model: Floats) -> bool:
    """Whether ω, and what it adds to the velocity of the body frame's origin, stay below FASTEST."""
    w, x, y, z, c = state[Q], state[Q + 1], state[Q + 2], state[Q + 3], CENTER_OF_MASS
    wx, wy, wz = rates_of_whole(model, w, x, y, z, state[L], state[L + 1], state[L + 2])
    lever = 1.0 + abs(model[c]) + abs(model[c + 1]) + abs(model[c + 2])
    return max(abs(wx), abs(wy), abs(wz)) <= FASTEST / lever
