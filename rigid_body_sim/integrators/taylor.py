"""Taylor series of the rigid-body equations, with order and sub-steps chosen in each step: the error is round-off.

For a held wrench the equations are polynomial in the attitude relative to the start of the step ``Q`` (which begins at
1), the rates ω in principal axes and the carried vectors b = Rᵀ B (see kernels.wrench):

    Q' = ½ Q ⊗ ω        I₀ ω' = (I₀ ω) × ω + τ_body + Σ A_i b_i        b_i' = b_i × ω

(theory 2.5.5), so their series coefficients follow from Cauchy products. Time is scaled to the trial step h, and ω to
the half angles η = ½ h ω, which leaves all coefficients without units: term k is what order k contributes to the step.

A step adds increments only, never a value computed afresh, and adds them with compensated summation. What is known in
closed form is not integrated: L under a torque fixed in the world, P and x under a force fixed in the world.
"""

import math

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.extended import xadd
from ..kernels.model import (
    CARRIED,
    EULER,
    FORCE,
    FORCE_WORLD,
    MASS,
    MOMENTS,
    N_CARRIED,
    ONLY_WORLD_TORQUE,
    TORQUE,
    rates_principal,
)
from ..kernels.motion import Acting
from ..kernels.state import L, P, Q, X, add_compensated, align, body_momentum, is_thin
from ..kernels.tuples import Quat, Vec
from ..kernels.vectors import cross, qmultiply, qrotate, qrotate_back
from ..kernels.wrench import arm_torque, torque_principal
from .base import SCRATCH, Integrator

HIGHEST_ORDER = 24
TRIAL_ANGLE = 0.6  # rad; a trial step turns the body by about this much at most (cheapest of 0.3 to 1.5, measured)
MOST_SUBSTEPS = 200_000  # about 10⁵ rad in one step; more than that is refused rather than computed for minutes
# A sub-step so many times shorter than what MOST_SUBSTEPS can get through is refused at once: under 1e150 N m they are
# subnormal numbers, which took 18 s to give up. A spin may slow down within a step, but not by that much.
HOPELESS = 1000.0
# Truncation relative to a step's own increments. It adds up over the steps, so it lies far below one unit of round-off.
TOLERANCE = 2.0**-68
# Share of |q| − 1 taken back in a step: enough to hold it, too little to pass on the noise of measuring it.
NORM_GAIN = 2.0**-4

_TERMS = HIGHEST_ORDER + 1
_QT = SCRATCH  # series of the relative attitude Q, 4 a term
_ETA = _QT + 4 * _TERMS  # series of η, 3 a term
_BT = _ETA + 3 * _TERMS  # series of the carried vectors, 9 a term
_AT = _BT + 9 * _TERMS  # series of v × F for a body-axes force, 3 a term
_SPIN = _AT + 3 * _TERMS  # Rᵀ L of a thin body at the start of the sub-step: 3 high parts, 3 low parts
WORK_SIZE = _SPIN + 6


@kernel
def step(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
    """One step in as many sub-steps as its series needs; False when it cannot be done."""
    left = h
    for _ in range(MOST_SUBSTEPS):
        taken = _substep(state, model, work, left)
        if not taken * (HOPELESS * MOST_SUBSTEPS) > left:
            return False
        left -= taken
        if left <= 0.0:
            return True
    return False


@kernel
def _substep(state: Floats, model: Floats, work: Floats, left: float) -> float:
    """Advance by as much of ``left`` [s] as one series covers, and return it."""
    q = Quat(state[Q], state[Q + 1], state[Q + 2], state[Q + 3])
    wx, wy, wz = _rates(state, model, work)
    tx, ty, tz = torque_principal(model, q.w, q.x, q.y, q.z)
    trial = _trial_step(model, Vec(wx, wy, wz), Vec(tx, ty, tz), left)
    if wx == 0.0 and wy == 0.0 and wz == 0.0 and tx == 0.0 and ty == 0.0 and tz == 0.0:
        _translate(state, model, work, 0, 1.0, trial, q)
        return trial
    half = 0.5 * trial
    order = _series(model, work, trial, Vec(half * wx, half * wy, half * wz), q)
    # Taken from ``left`` without round-off: in a long step the sub-steps add up to the step, not to nearly that.
    taken = left - (left - _converged_fraction(work, order) * trial)
    fraction = taken / trial
    _translate(state, model, work, order, fraction, trial, q)
    _turn(state, model, work, order, fraction, trial, q)
    return taken


@kernel
def _rates(state: Floats, model: Floats, work: Floats) -> tuple[float, float, float]:
    """Rates in principal axes; those of a thin body from Rᵀ L in twice the precision, which stays in ``work``."""
    s, m = _SPIN, MOMENTS
    if not is_thin(model):
        return rates_principal(
            model, state[Q], state[Q + 1], state[Q + 2], state[Q + 3], state[L], state[L + 1], state[L + 2]
        )
    work[s], work[s + 3], work[s + 1], work[s + 4], work[s + 2], work[s + 5] = body_momentum(state)
    return work[s] / model[m], work[s + 1] / model[m + 1], work[s + 2] / model[m + 2]


@kernel
def _trial_step(model: Floats, w: Vec, t: Vec, left: float) -> float:
    """``left``, or the time [s] in which spin and torque turn the body by TRIAL_ANGLE, when that is shorter."""
    alpha = abs(t.x / model[MOMENTS]) + abs(t.y / model[MOMENTS + 1]) + abs(t.z / model[MOMENTS + 2])
    rate = abs(w.x) + abs(w.y) + abs(w.z) + math.sqrt(alpha)
    if rate * left <= TRIAL_ANGLE:
        return left
    return TRIAL_ANGLE / rate


@kernel
def _series(model: Floats, work: Floats, h: float, eta: Vec, q: Quat) -> int:
    """Fill the series for a trial step h from η = (ex, ey, ez) and the attitude; return the order that is enough."""
    carried = int(model[N_CARRIED])
    work[_QT], work[_QT + 1], work[_QT + 2], work[_QT + 3] = 1.0, 0.0, 0.0, 0.0
    work[_ETA], work[_ETA + 1], work[_ETA + 2] = eta.x, eta.y, eta.z
    for i in range(carried):
        b = CARRIED + 3 * i
        work[_BT + 3 * i], work[_BT + 3 * i + 1], work[_BT + 3 * i + 2] = qrotate_back(
            q.w, q.x, q.y, q.z, model[b], model[b + 1], model[b + 2]
        )
    cx, cy, cz = 2.0 * model[EULER], 2.0 * model[EULER + 1], 2.0 * model[EULER + 2]
    scale = 0.5 * h * h
    gx, gy, gz = scale / model[MOMENTS], scale / model[MOMENTS + 1], scale / model[MOMENTS + 2]
    tx, ty, tz = gx * model[TORQUE], gy * model[TORQUE + 1], gz * model[TORQUE + 2]
    # A sphere has no gyroscopic term: under a torque that turns with it, η has two coefficients and no more.
    last_eta = 1 if carried == 0 and cx == 0.0 and cy == 0.0 and cz == 0.0 else HIGHEST_ORDER
    first, e3, e2, e1, e0 = 0.0, 0.0, 0.0, 0.0, abs(eta.x) + abs(eta.y) + abs(eta.z)
    for k in range(HIGHEST_ORDER):
        share = 1.0 / (k + 1)
        aw, ax, ay, az, bx, by, bz = _products(work, k, max(1, k - last_eta))
        bx, by, bz = cx * bx + tx, cy * by + ty, cz * bz + tz
        tx, ty, tz = 0.0, 0.0, 0.0  # the body-axes torque is constant: it enters the first coefficient only
        for i in range(carried):
            ux, uy, uz = arm_torque(model, i, *_carried(work, k, i))
            bx, by, bz = bx + gx * ux, by + gy * uy, bz + gz * uz
        a, b = _QT + 4 * k + 4, _ETA + 3 * k + 3
        work[a], work[a + 1], work[a + 2], work[a + 3] = share * aw, share * ax, share * ay, share * az
        work[b], work[b + 1], work[b + 2] = share * bx, share * by, share * bz
        e3, e2, e1 = e2, e1, e0
        e0 = share * ((abs(aw) + abs(ax) + abs(ay) + abs(az)) + (abs(bx) + abs(by) + abs(bz)))
        if k == 0:
            first = max(e0, e1)
        # Terms may vanish in turn (spin-up from rest), so pairs are compared: the next pair is about last² / before.
        # The scalar part counts too: in exp(v t²) every second power has no other.
        last, before = max(e0, e1), max(e2, e3)
        if k >= 3 and last * last <= TOLERANCE * first * before:
            return k + 1
    return HIGHEST_ORDER


@kernel
def _products(work: Floats, k: int, start: int) -> tuple[float, float, float, float, float, float, float]:
    """Coefficient k of Q ⊗ η and (η_y η_z, η_z η_x, η_x η_y); before ``start``, all terms but that with Q_0 are 0."""
    e = _ETA + 3 * k
    aw, ax, ay, az = 0.0, work[e], work[e + 1], work[e + 2]  # the term with Q_0 = 1
    bx, by, bz = work[_ETA + 1] * az, work[_ETA + 2] * ax, work[_ETA] * ay
    for j in range(start, k + 1):
        q, e, f = _QT + 4 * j, _ETA + 3 * (k - j), _ETA + 3 * j
        w, x, y, z = work[q], work[q + 1], work[q + 2], work[q + 3]
        ex, ey, ez = work[e], work[e + 1], work[e + 2]
        aw -= x * ex + y * ey + z * ez
        ax += w * ex + (y * ez - z * ey)
        ay += w * ey + (z * ex - x * ez)
        az += w * ez + (x * ey - y * ex)
        bx += work[f + 1] * ez
        by += work[f + 2] * ex
        bz += work[f] * ey
    return aw, ax, ay, az, bx, by, bz


@kernel
def _carried(work: Floats, k: int, i: int) -> tuple[float, float, float]:
    """Coefficient k of carried vector i, from b' = 2 b × η."""
    b = _BT + 9 * k + 3 * i
    if k > 0:
        sx, sy, sz = 0.0, 0.0, 0.0
        for j in range(k):
            a, e = _BT + 9 * j + 3 * i, _ETA + 3 * (k - 1 - j)
            x, y, z = cross(work[a], work[a + 1], work[a + 2], work[e], work[e + 1], work[e + 2])
            sx, sy, sz = sx + x, sy + y, sz + z
        share = 2.0 / k
        work[b], work[b + 1], work[b + 2] = share * sx, share * sy, share * sz
    return work[b], work[b + 1], work[b + 2]


@kernel
def _converged_fraction(work: Floats, order: int) -> float:
    """Share of the trial step on which the series converge to round-off: 1 unless the highest order was not enough."""
    if order < HIGHEST_ORDER:
        return 1.0
    size = 0.0
    for k in range(order - 1, order + 1):
        for i in range(4):
            size = max(size, abs(work[_QT + 4 * k + i]))
        for i in range(3):
            size = max(size, abs(work[_ETA + 3 * k + i]))
    if size <= TOLERANCE:
        return 1.0
    return 0.8 * (TOLERANCE / size) ** (1.0 / (HIGHEST_ORDER - 1))


@kernel
def _translate(
    state: Floats,
    model: Floats,
    work: Floats,
    order: int,
    fraction: float,
    trial: float,
    q: Quat,
) -> None:
    """Advance P and x over fraction · trial [s]: closed form for the world-axes force, series for the body-axes one."""
    h = fraction * trial
    m = model[MASS]
    ix, iy, iz, jx, jy, jz = _body_force_integrals(model, work, order, fraction)
    ix, iy, iz = qrotate(q.w, q.x, q.y, q.z, ix, iy, iz)
    jx, jy, jz = qrotate(q.w, q.x, q.y, q.z, jx, jy, jz)
    fx, fy, fz = model[FORCE_WORLD], model[FORCE_WORLD + 1], model[FORCE_WORLD + 2]
    add_compensated(state, X, state[P] * h / m + h * h * (0.5 * fx + jx) / m)
    add_compensated(state, X + 1, state[P + 1] * h / m + h * h * (0.5 * fy + jy) / m)
    add_compensated(state, X + 2, state[P + 2] * h / m + h * h * (0.5 * fz + jz) / m)
    add_compensated(state, P, h * (fx + ix))
    add_compensated(state, P + 1, h * (fy + iy))
    add_compensated(state, P + 2, h * (fz + iz))


@kernel
def _body_force_integrals(
    model: Floats, work: Floats, order: int, fraction: float
) -> tuple[float, float, float, float, float, float]:
    """∫ R F dθ and ∬ R F dθ² over a step of unit length, in the axes at its start, for the body-axes force F.

    With Q = [s, v] and a = v × F, R F = F + 2 (s a + v × a); the series of a is linear in that of v.
    """
    fx, fy, fz = model[FORCE], model[FORCE + 1], model[FORCE + 2]
    if fx == 0.0 and fy == 0.0 and fz == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    ix, iy, iz, jx, jy, jz = fx, fy, fz, 0.5 * fx, 0.5 * fy, 0.5 * fz
    power = fraction
    # The last two orders are left out: over (k + 1) they are below the round-off of P, and no equation amplifies them.
    for k in range(1, order - 1):
        q, a = _QT + 4 * k, _AT + 3 * k
        work[a], work[a + 1], work[a + 2] = cross(work[q + 1], work[q + 2], work[q + 3], fx, fy, fz)
        sx, sy, sz = _turned_force(work, k)
        once = 2.0 * power / (k + 1)
        twice = once / (k + 2)
        ix, iy, iz = ix + once * sx, iy + once * sy, iz + once * sz
        jx, jy, jz = jx + twice * sx, jy + twice * sy, jz + twice * sz
        power *= fraction
    return ix, iy, iz, jx, jy, jz


@kernel
def _turned_force(work: Floats, k: int) -> tuple[float, float, float]:
    """Coefficient k of s a + v × a, where s begins with 1 and v and a with 0."""
    a = _AT + 3 * k
    sx, sy, sz = work[a], work[a + 1], work[a + 2]
    for j in range(1, k):
        q, a = _QT + 4 * (k - j), _AT + 3 * j
        w, x, y, z = work[q], work[q + 1], work[q + 2], work[q + 3]
        ax, ay, az = work[a], work[a + 1], work[a + 2]
        sx += w * ax + (y * az - z * ay)
        sy += w * ay + (z * ax - x * az)
        sz += w * az + (x * ay - y * ax)
    return sx, sy, sz


@kernel
def _turn(
    state: Floats,
    model: Floats,
    work: Floats,
    order: int,
    fraction: float,
    trial: float,
    q: Quat,
) -> None:
    """Advance q and L over fraction · trial [s]: sums of their series without the constant term, smallest first."""
    dw, dx, dy, dz, ex, ey, ez = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(order, 0, -1):
        a, b = _QT + 4 * k, _ETA + 3 * k
        dw, dx = fraction * (dw + work[a]), fraction * (dx + work[a + 1])
        dy, dz = fraction * (dy + work[a + 2]), fraction * (dz + work[a + 3])
        ex, ey, ez = fraction * (ex + work[b]), fraction * (ey + work[b + 1]), fraction * (ez + work[b + 2])
    _add_angular_momentum(state, model, work, fraction, trial, q, Quat(dw, dx, dy, dz), Vec(ex, ey, ez))
    back = NORM_GAIN * 0.5 * (1.0 - (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z))
    aw, ax, ay, az = qmultiply(q.w, q.x, q.y, q.z, dw + back, dx, dy, dz)
    add_compensated(state, Q, aw)
    add_compensated(state, Q + 1, ax)
    add_compensated(state, Q + 2, ay)
    add_compensated(state, Q + 3, az)
    if is_thin(model):
        _align_thin(state, model, work, trial, ex, ey, ez)


@kernel
def _align_thin(state: Floats, model: Floats, work: Floats, trial: float, ex: float, ey: float, ez: float) -> None:
    """Give q the Rᵀ L that Euler's equation led to: there the spin about the thin axis lost no digits."""
    s, r = _SPIN, 2.0 / trial
    lx, lxl = xadd(work[s], work[s + 3], r * model[MOMENTS] * ex, 0.0)
    ly, lyl = xadd(work[s + 1], work[s + 4], r * model[MOMENTS + 1] * ey, 0.0)
    lz, lzl = xadd(work[s + 2], work[s + 5], r * model[MOMENTS + 2] * ez, 0.0)
    align(state, lx, lxl, ly, lyl, lz, lzl)


@kernel
def _add_angular_momentum(
    state: Floats,
    model: Floats,
    work: Floats,
    fraction: float,
    trial: float,
    q: Quat,
    d: Quat,
    e: Vec,
) -> None:
    """Advance L: closed form under a torque fixed in the world (none at all: not one bit), else from the body's own L.

    With l the angular momentum in principal axes, ΔL = R (Q l Q̄ − l₀) = R (Δl + 2 (s v × l + v × (v × l))).
    """
    if model[ONLY_WORLD_TORQUE] != 0.0:
        if model[N_CARRIED] != 0.0:
            h = fraction * trial
            for i in range(3):
                add_compensated(state, L + i, h * model[CARRIED + i])
        return
    r = 2.0 / trial
    rx, ry, rz = r * model[MOMENTS], r * model[MOMENTS + 1], r * model[MOMENTS + 2]
    lx, ly, lz = rx * (work[_ETA] + e.x), ry * (work[_ETA + 1] + e.y), rz * (work[_ETA + 2] + e.z)
    ax, ay, az = cross(d.x, d.y, d.z, lx, ly, lz)
    bx, by, bz = cross(d.x, d.y, d.z, ax, ay, az)
    s = 1.0 + d.w
    gx, gy, gz = rx * e.x + 2.0 * (s * ax + bx), ry * e.y + 2.0 * (s * ay + by), rz * e.z + 2.0 * (s * az + bz)
    gx, gy, gz = qrotate(q.w, q.x, q.y, q.z, gx, gy, gz)
    add_compensated(state, L, gx)
    add_compensated(state, L + 1, gy)
    add_compensated(state, L + 2, gz)


INTEGRATOR = Integrator(
    name="taylor",
    order=None,
    explicit=True,
    step=step,
    work_size=WORK_SIZE,
    reversible=True,
    text=(
        "Taylor series of the equations of motion with order and sub-steps chosen in each step, and compensated "
        "summation. Exact to round-off at every rate for every wrench that is held between commands."
    ),
)
