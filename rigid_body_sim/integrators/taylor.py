"""Taylor series of the rigid-body equations, with order and sub-steps chosen in each step: the error is round-off.

For a held wrench the equations are polynomial in the attitude relative to the start of the step, the rates in principal
axes and the carried vectors, so their series follow from Cauchy products (kernels.series). Time is scaled to the trial
step, so term k is what order k contributes to it, without a unit. A step takes the order that is enough for it; where
the highest is not, a part of it is taken.

A step adds increments only, never a value computed afresh, and adds them with compensated summation. What is known in
closed form is not integrated: L under a torque fixed in the world, P and x under a force fixed in the world.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..kernels import driven_series, series
from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.drive import is_expanded
from ..kernels.extended import xadd
from ..kernels.model import (
    CARRIED,
    FORCE,
    FORCE_WORLD,
    INTERNAL,
    MASS,
    MOMENT_ROW,
    MOMENTS,
    N_CARRIED,
    ONLY_WORLD_TORQUE,
)
from ..kernels.motion import Acting
from ..kernels.row_vectors import crossed, rotated
from ..kernels.series import HIGHEST_ORDER, NARROW
from ..kernels.state import L, P, Q, X, add_compensated, add_row, align, body_momentum, is_thin
from ..kernels.straight_line import straight_line
from ..kernels.symbols import Row, picked, row
from .base import SCRATCH, TINY, Integrator, Step

SHORT = 0.02  # rad; a step that turns the body by less takes eight orders, nearly always
TRIAL_ANGLE = 0.8  # rad; a trial step turns the body by about this much at most
MOST_SUBSTEPS = 100_000  # about 10⁵ rad in one step; more than that is refused rather than computed for minutes
# A sub-step so many times shorter than what MOST_SUBSTEPS can get through is refused at once: under 1e150 N m they are
# subnormal numbers, which took 18 s to give up. A spin may slow down within a step, but not by that much.
HOPELESS = 1000.0
# Truncation relative to a step's own increments. It adds up over the steps, so it lies far below one unit of round-off:
# most of all in short steps, of which there are many. In a long one it is the size of the last two terms, not the next.
TOLERANCE = 2.0**-68
LONG_TOLERANCE = 2.0**-60
# The same of a short step in which actuators follow their commands: what is cut off of an exponential decays with it.
DRIVEN_TOLERANCE = 2.0**-56
# Share of |q| − 1 taken back in a step: enough to hold it, too little to pass on the noise of measuring it.
NORM_GAIN = 2.0**-4

_NOTHING = np.zeros(4)
# In a product of quaternions, theory (2.7.6): what x, y and z of the second factor multiply, for w, x, y and z of it.
_FACTORS = (
    ([1, 0, 3, 2], np.array([-1.0, 1.0, 1.0, -1.0])),
    ([2, 3, 0, 1], np.array([-1.0, -1.0, 1.0, 1.0])),
    ([3, 2, 1, 0], np.array([-1.0, 1.0, -1.0, 1.0])),
)

_SPIN = SCRATCH  # Rᵀ L of a thin body at the start of the sub-step: 3 high parts, 3 low parts
_SERIES = SCRATCH + 6  # of kernels.series
WORK_SIZE = _SERIES + series.SIZE


class Parts(NamedTuple):
    """What a sub-step is made of, without actuators or with them."""

    set_rates: Callable[[Floats, Floats, Floats], None]
    set_thin_rates: Callable[[Floats, Floats, Floats, Floats], None]
    turning: Callable[[Floats, Floats, Floats], float]
    series: Callable[[Floats, Floats, float, float], tuple[int, float]]
    translate: Callable[[Floats, Floats, Floats, int, float, float], None]
    add_body_momentum: Callable[[Floats, Floats, Floats, float], None]


def _substep_of(parts: Parts) -> Callable[[Floats, Floats, Floats, float], float]:
    set_rates, set_thin_rates, turning, fill, translate, add_body_momentum = parts

    @kernel
    def substep(state: Floats, model: Floats, work: Floats, left: float) -> float:
        """Advance by as much of ``left`` [s] as one series covers, and return it."""
        rows = work[_SERIES:]
        if is_thin(model):
            set_thin_rates(state, model, work, rows)
        else:
            set_rates(state, model, rows)
        rate = math.sqrt(turning(state, model, rows))
        if rate == 0.0:
            _set_constant_impulse(model, rows)
            _fall_andpush(state, model, rows, left)
            return left
        # Taken from ``left`` without round-off: in a long step the sub-steps add up to the step, not to nearly that.
        trial = left if rate * left <= TRIAL_ANGLE else left - (left - TRIAL_ANGLE / rate)
        order, fraction = fill(rows, model, trial, rate * trial)
        taken = trial if fraction == 1.0 else left - (left - fraction * trial)
        fraction = taken / trial
        if order == HIGHEST_ORDER:
            series.gain_part(rows, fraction)
        else:
            series.gain_whole(rows)
        translate(state, model, rows, order, fraction, taken)
        if model[ONLY_WORLD_TORQUE] == 0.0:
            add_body_momentum(state, model, rows, 0.5 * trial)
        elif model[N_CARRIED] != 0.0:
            for i in range(3):
                add_compensated(state, L + i, taken * model[CARRIED + i])
        _turn(state, rows)
        if is_thin(model):
            _align_thin(state, model, work, 0.5 * trial)
        return taken

    return substep


@kernel
def _set_thin_rates(state: Floats, model: Floats, work: Floats, rows: Floats) -> None:
    """Set ω from Rᵀ L in twice the precision, which stays in ``work``."""
    s = _SPIN
    work[s], work[s + 3], work[s + 1], work[s + 4], work[s + 2], work[s + 5] = body_momentum(state)
    for i in range(3):
        rows[series.RATES + i] = work[s + i] / model[MOMENTS + i]
    rows[series.RATES + 3] = rows[series.RATES]


@kernel
def _set_thin_whole(state: Floats, model: Floats, work: Floats, rows: Floats) -> None:
    """The same with what spins inside, whose h is no part of I₀ ω."""
    s = _SPIN
    work[s], work[s + 3], work[s + 1], work[s + 4], work[s + 2], work[s + 5] = body_momentum(state)
    for i in range(3):
        rows[series.WHOLE + i] = work[s + i]
        rows[series.RATES + i] = ((work[s + i] - model[INTERNAL + i]) + work[s + 3 + i]) / model[MOMENTS + i]
    rows[series.WHOLE + 3], rows[series.RATES + 3] = rows[series.WHOLE], rows[series.RATES]


def _turning_with(carry: Callable[[int], Callable[[Floats, Floats, Floats], float]]) -> Any:
    none, one, three = carry(0), carry(1), carry(3)

    @kernel
    def turning(state: Floats, model: Floats, rows: Floats) -> float:
        if model[N_CARRIED] == 0.0:
            return none(state, model, rows)
        if model[N_CARRIED] == 1.0:
            return one(state, model, rows)
        return three(state, model, rows)

    return turning


class Kind(NamedTuple):
    """How a series is begun and gone on with, by the number of carried vectors."""

    begin: Callable[[int], Callable[[Floats, Floats, float], float]]
    more: Callable[[int], Callable[[Floats, Floats, int, int], tuple[float, float]]]
    equations: type[series.Equations]
    tolerance: float  # of short steps
    is_enough: Callable[[Floats], bool]  # whether the orders are, of what is no part of q and what is gained


@kernel
def _always(model: Floats) -> bool:
    return True


def _series_with(carried: int, kind: Kind) -> Callable[[Floats, Floats, float, float], tuple[int, float]]:
    begin, more = kind.begin(carried), kind.more(carried)
    to_6, to_8 = (series.first_orders(carried, last, 2, kind.equations) for last in (6, NARROW))
    to_8_with_care = series.first_orders(carried, NARROW, 5, kind.equations)
    tolerance, is_enough = kind.tolerance, kind.is_enough

    @kernel
    def fill(rows: Floats, model: Floats, trial: float, angle: float) -> tuple[int, float]:
        first = begin(rows, model, trial)
        if angle < TINY:
            last, before = to_6(rows, model)
            if last * last <= tolerance * first * before:
                return 6, 1.0
        if angle < SHORT:
            last, before = to_8(rows, model)
            if last * last <= tolerance * first * before:
                return NARROW, 1.0
        order, (last, before) = NARROW, to_8_with_care(rows, model)
        while not (last * last <= TOLERANCE * first * before and is_enough(model)):
            if order == HIGHEST_ORDER:
                return order, min(1.0, (LONG_TOLERANCE / last) ** (1.0 / HIGHEST_ORDER))
            last, before = more(rows, model, order, order + 4)
            order += 4
        return order, 1.0

    return fill


def _series_of(kind: Kind) -> Callable[[Floats, Floats, float, float], tuple[int, float]]:
    none, one, three = (_series_with(carried, kind) for carried in (0, 1, 3))

    @kernel
    def fill(rows: Floats, model: Floats, trial: float, angle: float) -> tuple[int, float]:
        """Fill the series; the order that is enough, and the share of the trial step for which it is."""
        if model[N_CARRIED] == 0.0:
            return none(rows, model, trial, angle)
        if model[N_CARRIED] == 1.0:
            return one(rows, model, trial, angle)
        return three(rows, model, trial, angle)

    return fill


Impulse = Callable[[Floats, Floats, int, float], None]


def _impulse_with(short: Callable[[int], Callable[[Floats, Floats], None]], long: Impulse) -> Impulse:
    tiny, narrow = short(6), short(NARROW)

    @kernel
    def set_impulse(rows: Floats, model: Floats, order: int, f: float) -> None:
        """Set that of the force in body axes over a share f of the trial step."""
        if order == 6:
            tiny(rows, model)
        elif order == NARROW:
            narrow(rows, model)
        else:
            long(rows, model, order, f)

    return set_impulse


_set_impulse = _impulse_with(series.short_impulse, series.set_impulse)
_set_driven_impulse = _impulse_with(driven_series.short_impulse, driven_series.set_impulse)


@kernel
def _translate(state: Floats, model: Floats, rows: Floats, order: int, f: float, h: float) -> None:
    """Advance P and x by h [s]: in closed form under the world-axes force, by quadrature under that in body axes."""
    if model[FORCE] == 0.0 and model[FORCE + 1] == 0.0 and model[FORCE + 2] == 0.0:
        _fall(state, model, h)
    else:
        _set_impulse(rows, model, order, f)
        _fall_andpush(state, model, rows, h)


@kernel
def _translate_driven(state: Floats, model: Floats, rows: Floats, order: int, f: float, h: float) -> None:
    """The same under a force in body axes that actuators change."""
    _set_driven_impulse(rows, model, order, f)
    _fall_andpush(state, model, rows, h)


@straight_line
def _set_constant_impulse(model: Floats, rows: Floats) -> None:
    """Set that of the force in body axes on a body that does not turn."""
    for axis in range(3):
        rows[series.IMPULSE + axis] = model[FORCE + axis]
        rows[series.IMPULSE + 4 + axis] = 0.5 * model[FORCE + axis]


@straight_line
def _fall(state: Floats, model: Floats, h: float) -> None:
    force = row(model, FORCE_WORLD, 4)
    push(state, model, h, force, 0.5 * force)


@straight_line
def _fall_andpush(state: Floats, model: Floats, rows: Floats, h: float) -> None:
    once, twice = (row(rows, series.IMPULSE + at, 4)[[0, 1, 2, 0]] for at in (0, 4))
    fall_pushed(state, model, h, once, twice)


def fall_pushed(state: Any, model: Any, h: Any, once: Row, twice: Row) -> None:
    """Add to P and x what the world force does in h [s], and that in body axes by ∫ R F dθ and ∬ R F dθ²."""
    force, q = row(model, FORCE_WORLD, 4), row(state, Q, 4)
    once, twice = rotated(q, once), rotated(q, twice)
    push(state, model, h, force + once, 0.5 * force + twice)


def push(state: Any, model: Any, h: Any, once: Row, twice: Row) -> None:
    """Add to P and x what the forces ∫ F dθ and ∬ F dθ² do in h [s]."""
    moved = (h / model[MASS]) * (row(state, P, 4) + h * twice)
    add_row(state, X, picked(moved, _NOTHING, [0, 1, 2, 4]))
    add_row(state, P, picked(h * once, _NOTHING, [0, 1, 2, 4]))


@straight_line
def _turn(state: Floats, rows: Floats) -> None:
    """Advance q by the relative attitude 1 + d."""
    turn_by(state, row(rows, series.GAIN, 4))


def turn_by(state: Any, d: Row) -> None:
    """The same."""
    q = row(state, Q, 4)
    squares = q * q
    size = (squares[[0] * 4] + squares[[1] * 4]) + (squares[[2] * 4] + squares[[3] * 4])
    w = d[[3] * 4] + (0.5 * NORM_GAIN) * (1.0 - size)
    x, y, z = ((q[lanes] * d[[i] * 4]) * sign for i, (lanes, sign) in enumerate(_FACTORS))
    add_row(state, Q, q * w + ((x + y) + z))


@straight_line
def _add_body_momentum(state: Floats, model: Floats, rows: Floats, half: float) -> None:
    """Advance L from the body's own; ``half`` of the trial step [s]."""
    whole = row(model, MOMENT_ROW, 4) * row(rows, series.RATES, 4)
    add_momentum(state, model, whole, row(rows, series.GAIN, 4), row(rows, series.GAIN + 4, 4), half)


@straight_line
def _add_whole_momentum(state: Floats, model: Floats, rows: Floats, half: float) -> None:
    """The same with what spins inside."""
    whole = row(rows, series.WHOLE, 4)
    add_momentum(state, model, whole, row(rows, series.GAIN, 4), row(rows, series.GAIN + 4, 4), half)


def add_momentum(state: Any, model: Any, whole: Row, d: Row, eta: Row, half: Any) -> None:
    """With l the angular momentum in principal axes, ΔL = R (Q l Q̄ − l₀) = R (Δl + 2 (s v × l + v × (v × l)))."""
    gained = row(model, MOMENT_ROW, 4) * (eta / half)  # 1 / half would err the same way in each step
    a = crossed(d, whole + gained)
    turned = rotated(row(state, Q, 4), gained + 2.0 * ((a + d[[3] * 4] * a) + crossed(d, a)))
    add_row(state, L - 1, picked(_NOTHING, turned, [0, 4, 5, 6]))


@kernel
def _align_thin(state: Floats, model: Floats, work: Floats, half: float) -> None:
    """Give q the Rᵀ L that Euler's equation led to: there the spin about the thin axis lost no digits."""
    s, m, e = _SPIN, MOMENTS, _SERIES + series.GAIN + 4
    lx, lxl = xadd(work[s], work[s + 3], model[m] * work[e] / half, 0.0)
    ly, lyl = xadd(work[s + 1], work[s + 4], model[m + 1] * work[e + 1] / half, 0.0)
    lz, lzl = xadd(work[s + 2], work[s + 5], model[m + 2] * work[e + 2] / half, 0.0)
    align(state, lx, lxl, ly, lyl, lz, lzl)


_PLAIN = _substep_of(
    Parts(
        series.set_rates,
        _set_thin_rates,
        _turning_with(series.carry),
        _series_of(Kind(series.begin, series.more_orders, series.Equations, TOLERANCE, _always)),
        _translate,
        _add_body_momentum,
    )
)
_DRIVEN = _substep_of(
    Parts(
        driven_series.set_whole,
        _set_thin_whole,
        _turning_with(driven_series.carry),
        _series_of(
            Kind(
                driven_series.begin_driven,
                driven_series.more_driven_orders,
                driven_series.Driven,
                DRIVEN_TOLERANCE,
                is_expanded,
            )
        ),
        _translate_driven,
        _add_whole_momentum,
    )
)


def _step_of(substep: Callable[[Floats, Floats, Floats, float], float]) -> Step:
    @kernel
    def step(acting: Acting, state: Floats, model: Floats, work: Floats, h: float) -> bool:
        """One step in as many sub-steps as its series needs; False when it cannot be done.

        Time passes for actuators, too; without any that is nothing.
        """
        left = h
        for _ in range(MOST_SUBSTEPS):
            taken = substep(state, model, work, left)
            acting.drive.advance(model, taken)
            if not taken * (HOPELESS * MOST_SUBSTEPS) > left:
                return False
            left -= taken
            if left <= 0.0:
                return True
            acting.drive.settle(model)
        return False

    return step


step = _step_of(_PLAIN)

INTEGRATOR = Integrator(
    name="taylor",
    order=None,
    explicit=True,
    step=step,
    driven=_step_of(_DRIVEN),
    work_size=WORK_SIZE,
    reversible=True,
    text=(
        "Taylor series of the equations of motion with order and sub-steps chosen in each step, and compensated "
        "summation. Exact to round-off at every rate for every wrench that is held between commands."
    ),
)
