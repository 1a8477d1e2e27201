"""A step of ``taylor`` for eight bodies at once, of those for which 6, 8 or 12 orders are enough: the same bits.

It is the same arithmetic on the same rows, whose numbers are those of eight bodies (see kernels.symbols). Each body's
step takes as many orders as it would by itself: what the others need is not used for it.
"""

from collections.abc import Callable
from typing import Any

from ..kernels import series
from ..kernels.arrays import Floats
from ..kernels.compiled import kernel
from ..kernels.model import CARRIED, FORCE_WORLD, MOMENT_ROW
from ..kernels.series import NARROW, Equations, Order
from ..kernels.state import L, add_compensated, seems_finite
from ..kernels.straight_line import in_lanes
from ..kernels.symbols import Row, chosen, row, set_row
from .base import TINY
from .taylor import SHORT, TOLERANCE, add_momentum, fall_pushed, push, turn_by

MOST = 12

# Where numbers of eight bodies lie, from the start of what a caller sets aside.
_RATES, _GAIN, _ORDER, _TERMS = 0, 4, 12, 13
SIZE = _TERMS + 4 * MOST

Step = Callable[[Floats, Floats, Floats, float, bool, bool], int]


def step(carried: int, orders: int) -> Step:
    """The kernel that advances eight bodies with so many carried vectors by h [s], in up to so many orders.

    All are pushed by a force in body axes or none, and for all or none the torque is fixed in the world. It returns for
    which bodies it is done, as bits; of the others the state is spoilt.
    """
    fill, push_them = _series(carried, orders), _impulse(orders)

    @kernel
    def advance(state: Floats, model: Floats, scratch: Floats, h: float, pushed: bool, only_world_torque: bool) -> int:
        done = fill(state, model, scratch, h)
        if pushed:
            push_them(state, model, scratch, h)
        else:
            _fall(state, model, h)
        if not only_world_torque:
            _add_momentum(state, model, scratch, h)
        elif carried == 1:
            _add_world_torque(state, model, h)
        _turn(state, scratch)
        return done & _are_finite(state, model)

    return advance


def _series(carried: int, last: int) -> Callable[[Floats, Floats, Floats, float], int]:
    """The kernel that fills the scratch space, and returns for which bodies the orders are enough."""

    @in_lanes
    def fill(state: Floats, model: Floats, scratch: Floats, h: float) -> int:
        w = series.rates(state, model)
        vectors, torque = series.carried_vectors(state, model, carried)
        angle = series.turning(w, torque, model).root * h
        equations = series.trial(model, h, carried)
        orders = list(equations.first_two((0.5 * h) * w, torque, vectors))
        fewer, most = _long(equations, orders, angle) if last == MOST else _short(equations, orders, angle, last)
        few = 6 if last < MOST else NARROW
        pairs = zip(series.gain(orders, few), series.gain(orders, last), strict=True)
        for i, (less, more) in enumerate(pairs):
            set_row(scratch, _GAIN + 4 * i, chosen(fewer, less, more))
        set_row(scratch, _RATES, w)
        set_row(scratch, _ORDER, chosen(fewer, [float(few)], [float(last)]))
        for k in range(1, last + 1):
            set_row(scratch, _TERMS + 4 * (k - 1), orders[k].q)
        return ((fewer | most) & (angle > 0.0)).bits

    return fill


def _short(equations: Equations, orders: list[Order], angle: Any, last: int) -> tuple[Any, Any]:
    """For which bodies six orders are enough, and for which as many as are added."""
    series.added_up_to(last, 2, equations, orders)
    six = (angle < TINY) & _are_enough(orders, 6)
    return six, six if last == 6 else (angle < SHORT) & _are_enough(orders, last)


def _long(equations: Equations, orders: list[Order], angle: Any) -> tuple[Any, Any]:
    """For which bodies eight orders are enough, formed with care, and for which twelve."""
    series.added_up_to(NARROW, 5, equations, orders)
    series.added_as_wide(MOST, equations, orders)
    beyond = angle >= SHORT
    return beyond & _are_enough(orders, NARROW), beyond & _are_enough(orders, MOST)


def _are_enough(orders: list[Order], last: int) -> Any:
    then, before = series.sizes(orders, last)
    return then * then <= TOLERANCE * orders[1].size * before


def _impulse(last: int) -> Callable[[Floats, Floats, Floats, float], None]:
    """The kernel that moves bodies that are pushed by a force in body axes, each by its orders."""

    @in_lanes
    def push_them(state: Floats, model: Floats, scratch: Floats, h: float) -> None:
        terms = [row(scratch, _TERMS + 4 * k, 4) for k in range(last)]
        of_order = {6: series.few_orders_impulse, NARROW: series.few_orders_impulse, MOST: series.impulse_of}
        impulse = of_order[last](model, terms)
        if last > 6:
            few = 6 if last == NARROW else NARROW
            fewer = scratch[_ORDER] < last - 1.0
            impulse = _either(fewer, of_order[few](model, terms[:few]), impulse)
        fall_pushed(state, model, h, *impulse)

    return push_them


def _either(condition: Any, these: tuple[Row, Row], those: tuple[Row, Row]) -> tuple[Row, Row]:
    once, twice = (chosen(condition, one, other) for one, other in zip(these, those, strict=True))
    return once, twice


@in_lanes
def _fall(state: Floats, model: Floats, h: float) -> None:
    force = row(model, FORCE_WORLD, 4)
    push(state, model, h, force, 0.5 * force)


@in_lanes
def _add_momentum(state: Floats, model: Floats, scratch: Floats, h: float) -> None:
    w, d, eta = (row(scratch, at, 4) for at in (_RATES, _GAIN, _GAIN + 4))
    add_momentum(state, model, row(model, MOMENT_ROW, 4) * w, d, eta, 0.5 * h)


@in_lanes
def _add_world_torque(state: Floats, model: Floats, h: float) -> None:
    for i in range(3):
        add_compensated(state, L + i, h * model[CARRIED + i])


@in_lanes
def _turn(state: Floats, scratch: Floats) -> None:
    turn_by(state, row(scratch, _GAIN, 4))


@in_lanes
def _are_finite(state: Floats, model: Floats) -> int:
    return seems_finite(state, model).bits
