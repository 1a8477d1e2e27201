"""What error-controlled integrators share: the unknowns of a sub-step, how an error is weighed, the next size.

The attitude is counted from the beginning of the sub-step by a rotation vector θ in world axes, q = exp(θ) q₀, with
θ' = dexp⁻¹_θ ω. So the unknowns are the twelve increments (δx, θ, δP, δL), and the quaternion stays of unit length.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.model import MASS, MOMENTS, RTOL
from ..kernels.motion import Acting, Passed, body_attitude, loads_as_settled, motion, rates_of, rates_world
from ..kernels.state import L, P, Q, X, add_compensated, add_to_attitude
from ..kernels.tuples import Load, Motion, Quat, Vec, plus, vec
from ..kernels.vectors import cross, exponential_minus_one, qmultiply

UNKNOWNS = 12
LARGEST_TURN = 1.0  # rad in one sub-step: beyond it the rotation vector is a poor coordinate
TOO_FAR = 16.0  # the error of a sub-step that turns further than that, at least
SLOWEST = 1e-3  # 1/s: motions slower than this (times the radius of gyration) count as rest when errors are weighed
# The errors of sub-steps add up, so each may make its share of what the step may; but no less than this: thousands of
# sub-steps follow something that oscillates, whose errors cancel in part.
SMALLEST_SHARE = 1e-3
# Times the step: a sub-step so short is taken whatever its error. There a tether begins or ends to pull, and no
# smaller one would be smoother.
SHORTEST = 1e-13
ENOUGH_TO_TELL = 0.1  # of the most sub-steps: after those, their mean size says how many will be needed
ROUND_OFF = 2.0**-50  # a few units in the last place
JUST_PAST = 2.0  # by how many times what round-off may hide a sub-step goes past the event at which it ends


class Search(NamedTuple):
    """For the size of a sub-step that ends at an event: the one to try, and what is known of others.

    ``before`` is a size that ends before it and ``beyond`` one that goes past it, 0 where none is known yet, with how
    far they are off in ``short`` and ``over``. ``side`` says which of the two is newer.
    """

    size: float
    before: float
    short: float
    beyond: float
    over: float
    side: float


NO_SEARCH = Search(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def settle(acting: Acting, state: Floats, model: Floats) -> None:
    """Say which loads with events act in the sub-step that begins here."""
    acting.settle(model, motion_at(state, model))


@kernel
def motion_at(state: Floats, model: Floats) -> Motion:
    """How the body moves at the beginning of the sub-step."""
    return motion(model, state, 0, Quat(state[Q], state[Q + 1], state[Q + 2], state[Q + 3]))


@kernel
def sought(acting: Acting, state: Floats, model: Floats, work: Floats, z: int, size: float, found: Search) -> Search:
    """After a sub-step of that size with the increments work[z:]: it is to be accepted where ``size`` stays the same.

    Past an event, it is done again to end there: to have passed it by what round-off cannot hide, and by little more.
    """
    return searched(passed, acting, state, model, work, z, size, found)


@kernel
def searched(
    passed: Callable[..., Passed],
    acting: Any,
    state: Floats,
    model: Floats,
    work: Floats,
    z: int,
    size: float,
    found: Search,
) -> Search:
    """The same for whatever ``passed`` is of: see below."""
    by, peak = passed(acting, state, model, work, z, size)
    if found.beyond == 0.0:
        if by <= 0.0:
            return Search(peak * size, 0.0, 0.0, 0.0, 0.0, 0.0)
        if by < JUST_PAST:
            return _ends_at(size)
        found = Search(size, 0.0, passed(acting, state, model, work, z, 0.0).by - JUST_PAST, 0.0, 0.0, 0.0)
    return _narrowed(found, size, by - JUST_PAST)


@kernel
def passed(acting: Acting, state: Floats, model: Floats, work: Floats, z: int, size: float) -> Passed:
    """By how much a sub-step of that size with the increments work[z:] went past an event; 0 for that at its start."""
    if size == 0.0:
        begin = motion_at(state, model)
        return acting.passed(model, begin, begin, 0.0)
    end = moved(state, model, work, z)  # under what actuators show of the last stage, which is at the end
    acting.drive.show(model, 0.0)
    return acting.passed(model, motion_at(state, model), end, size)


@kernel
def _ends_at(size: float) -> Search:
    """No better size is to be had."""
    return Search(size, size, 0.0, size, 0.0, 0.0)


@kernel
def _narrowed(found: Search, size: float, off: float) -> Search:
    """The next size to try, by the Illinois method (Dowell & Jarratt, BIT 11 (1971) 168), once one was off by that."""
    before, short, beyond, over = found.before, found.short, found.beyond, found.over
    if abs(off) < 0.5 * JUST_PAST or before == beyond > 0.0:
        return _ends_at(size)
    if off < 0.0:
        before, short, over = size, off, 0.5 * over if found.side < 0.0 else over
    else:
        beyond, over, short = size, off, 0.5 * short if found.side > 0.0 else short
    if beyond - before <= ROUND_OFF * beyond:
        return _ends_at(beyond)
    middle = before + (beyond - before) * short / (short - over)
    if not before < middle < beyond:
        middle = 0.5 * (before + beyond)
    return Search(middle, before, short, beyond, over, off)


@kernel
def moved(state: Floats, model: Floats, work: Floats, z: int) -> Motion:
    """How the body moves after the increments work[z:z + 12]."""
    dw, dx, dy, dz = exponential_minus_one(work[z + 3], work[z + 4], work[z + 5])
    qw, qx, qy, qz = qmultiply(1.0 + dw, dx, dy, dz, state[Q], state[Q + 1], state[Q + 2], state[Q + 3])
    q, m = Quat(qw, qx, qy, qz), model[MASS]
    p, l = plus(vec(state, P), vec(work, z + 6)), plus(vec(state, L), vec(work, z + 9))
    w = rates_of(model, q, l)
    return Motion(body_attitude(model, q), plus(vec(state, X), vec(work, z)), Vec(p.x / m, p.y / m, p.z / m), w)


@kernel
def slope(acting: Acting, state: Floats, model: Floats, work: Floats, z: int, y: int, to: int) -> None:
    """Time derivative of the unknowns at work[z:z + 12] into work[to:to + 12]; their state goes to work[y:y + 13]."""
    q = place(state, work, z, y)
    w = rates_world(model, work, y, q)
    write_slope(model, work, z, y, to, w, loads_as_settled(acting, model, work, y, q))


@kernel
def place(state: Floats, work: Floats, z: int, y: int) -> Quat:
    """The state after the increments work[z:z + 12] into work[y:y + 13], but for its attitude, which is returned."""
    dw, dx, dy, dz = exponential_minus_one(work[z + 3], work[z + 4], work[z + 5])
    qw, qx, qy, qz = qmultiply(1.0 + dw, dx, dy, dz, state[Q], state[Q + 1], state[Q + 2], state[Q + 3])
    for i in range(3):
        work[y + X + i] = state[X + i] + work[z + i]
        work[y + P + i] = state[P + i] + work[z + 6 + i]
        work[y + L + i] = state[L + i] + work[z + 9 + i]
    return Quat(qw, qx, qy, qz)


@kernel
def write_slope(model: Floats, work: Floats, z: int, y: int, to: int, w: Vec, load: Load) -> None:
    """``slope`` from the angular velocity and all that acts; world axes."""
    for i in range(3):
        work[to + i] = work[y + P + i] / model[MASS]
    work[to + 3], work[to + 4], work[to + 5] = inverse_dexp(work[z + 3], work[z + 4], work[z + 5], w.x, w.y, w.z)
    work[to + 6], work[to + 7], work[to + 8] = load.force
    work[to + 9], work[to + 10], work[to + 11] = load.torque


@kernel
def inverse_dexp(tx: float, ty: float, tz: float, wx: float, wy: float, wz: float) -> tuple[float, float, float]:
    """dexp⁻¹_θ ω = ω − ½ θ × ω + (1 − ½ t cot ½t) / t² θ × (θ × ω), t = |θ| (Iserles et al., Acta Numerica 2000)."""
    square = tx * tx + ty * ty + tz * tz
    if square < 1e-4:
        factor = 1.0 / 12.0 + square * (1.0 / 720.0 + square / 30240.0)
    else:
        half = 0.5 * math.sqrt(square)
        factor = (1.0 - half * math.cos(half) / math.sin(half)) / square
    ax, ay, az = cross(tx, ty, tz, wx, wy, wz)
    bx, by, bz = cross(tx, ty, tz, ax, ay, az)
    return wx - 0.5 * ax + factor * bx, wy - 0.5 * ay + factor * by, wz - 0.5 * az + factor * bz


@kernel
def usable(work: Floats, z: int) -> bool:
    """Whether the unknowns at work[z:] are finite and turn by so little that ``slope`` can be asked for."""
    total = 0.0
    for i in range(UNKNOWNS):
        total += work[z + i] - work[z + i]
    tx, ty, tz = work[z + 3], work[z + 4], work[z + 5]
    return total == 0.0 and tx * tx + ty * ty + tz * tz < 16.0 * LARGEST_TURN * LARGEST_TURN


@kernel
def radius_of_gyration(model: Floats) -> float:
    """√((I_x + I_y + I_z) / 2m) [m]: the length that a body has of its own."""
    return math.sqrt((model[MOMENTS] + model[MOMENTS + 1] + model[MOMENTS + 2]) / (2.0 * model[MASS]))


@kernel
def weighed(state: Floats, model: Floats, work: Floats, z: int, e: int, share: float, rate: float) -> float:
    """The error work[e:e + 12] of the increments work[z:z + 12] as a multiple of the tolerance, ``share`` of rtol.

    Momenta are weighed against the larger of the present one, the one after the sub-step, and what SLOWEST amounts to;
    lengths against the radius of gyration and angles against 1 rad, or less: ``rate`` [1/s] is how fast an error of
    them becomes one of the velocities, and a stiff spring makes a large one of a small one. To the tolerance comes what
    round-off does to position and attitude, and ``rate`` times as much to the velocities: far from the origin the force
    of a stiff tether is noise, which no shorter sub-step takes away.
    """
    m, radius = model[MASS], radius_of_gyration(model)
    momentum, spin, far, turn = 0.0, 0.0, radius, 0.0
    for i in range(3):
        far = max(far, abs(state[X + i]))
        momentum = max(momentum, abs(state[P + i]), abs(state[P + i] + work[z + 6 + i]))
        spin = max(spin, abs(state[L + i]), abs(state[L + i] + work[z + 9 + i]))
        turn = max(turn, abs(work[z + 3 + i]))
    tolerance, noise = share * model[RTOL], ROUND_OFF * far
    momentum += spin / radius + m * radius * SLOWEST
    angle = tolerance * min(1.0, momentum / (m * radius * rate)) if rate > 0.0 else tolerance
    size = tolerance * momentum + m * noise * rate
    worst = 0.0
    for i in range(3):
        worst = max(worst, abs(work[e + i]) / (radius * angle + noise), abs(work[e + 3 + i]) / (angle + ROUND_OFF))
        worst = max(worst, abs(work[e + 6 + i]) / size, abs(work[e + 9 + i]) / (size * radius))
    return max(worst, TOO_FAR) if turn > LARGEST_TURN else worst


@kernel
def next_size(trial: float, error: float, order: int, most: float) -> float:
    """Size of the sub-step to try after one of size ``trial`` with that weighed error: at most ``most`` times it."""
    if not error < math.inf:
        return 0.1 * trial
    return trial * min(most, max(0.1, 0.9 * max(error, 1e-8) ** (-1.0 / order)))


@kernel
def is_hopeless(passed: float, h: float, tried: int, most: int) -> bool:
    """Whether a step h, of which ``passed`` took the sub-steps ``tried`` so far, will take more than ``most``."""
    return tried > ENOUGH_TO_TELL * most and passed * most < h * tried


@kernel
def accept(state: Floats, work: Floats, z: int) -> None:
    """Add the increments work[z:z + 12] to the state."""
    for i in range(3):
        add_compensated(state, X + i, work[z + i])
        add_compensated(state, P + i, work[z + 6 + i])
        add_compensated(state, L + i, work[z + 9 + i])
    dw, dx, dy, dz = exponential_minus_one(work[z + 3], work[z + 4], work[z + 5])
    q = Q
    dw, dx, dy, dz = qmultiply(dw, dx, dy, dz, state[q], state[q + 1], state[q + 2], state[q + 3])
    add_to_attitude(state, dw, dx, dy, dz)
