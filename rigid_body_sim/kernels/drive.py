"""Actuators as kernels see them: what they do to a body as exact functions of time, between one event and the next.

An actuator's *level* follows its *target* with a lag, x' = (u − x) / T, so x = u + Δ e^(−t/T); its force and torque are
linear or quadratic in it, so all of them together are sums of exponentials: order 0 of each is its present value, and a
*slot* for each rate λ holds what changes with e^(−λt) − 1. What spins inside adds an internal angular momentum, linear
in a rotor's level; a wheel's grows by its level, the motor's torque, until it reaches its top speed.

A target changes when a delayed command arrives, and a wheel may reach its top speed or leave it: those are events.
Between two of them everything is smooth. Levels, targets, momenta of wheels and commands on their way are *memory*, at
the end of the model (see kernels.model): they go on from step to step.

What there is once for each actuator is a list, and lists are filled up to a multiple of four with actuators that do
nothing: a kernel takes four at a time. Rows of eight begin with a line of the cache, where Terms.model puts them.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .arrays import Floats
from .compiled import kernel
from .model import DRIVE, FORCE, INTERNAL, INTERNAL_SLOPE, MEMORY, ONLY_WORLD_TORQUE, TORQUE
from .straight_line import straight_line
from .symbols import Row, magnitude, repeated, row, set_row, sum_of

# What all actuators have in the model, from model[DRIVE] on
COUNT = 0  # a multiple of four
SLOTS = 1
TWISTS = 2  # 1 when one of them has a torque
PLAIN = 3  # 1 when none has a delay, and none is a wheel: nothing then happens within a step
FASTEST = 4  # λ of the fastest slot in which something changes [1/s]; 0 where nothing does
GAINS_FOR = 5  # the time for which the list of gains holds
HELD = 6  # reduced wrench without them: force 3, torque 3, and ONLY_WORLD_TORQUE
RAMP = 16  # growth of the internal momentum [N m], 4
VALUE = 24  # force, torque, internal momentum now: rows (x, y, z, x) in principal axes, 12
LISTS = 40  # time constants [s]; 1 where there is one, else 0; gains; momentum of a wheel at top speed [N m s]
TIME_CONSTANTS, LAGGING, GAINS, MOST_SPINS = 0, 1, 2, 3
N_LISTS = 4
# After the lists, of each: force and torque by level, 8, and by its square, 8; internal momentum by level, 4; the axis
# of a wheel's spin, 4.
LINEAR, SQUARE, MOMENTUM, AXIS, SIZE = 0, 8, 16, 20, 24
# Then the slots: λ [1/s]; the factor of the order that a series has come to; above 0 where something changes; what
# changes, 12; then two lists: 1 for those in whose change it is linear, and for those where it is the square. After the
# slots the lists that are KEPT, as they were at the beginning of a step.
FACTOR, ACTIVE, CHANGE, SHARES = 1, 2, 8, 24

# Lists of the memory; the first KEPT of them a step that cannot be done gets back.
COMMANDS, ARRIVING, TARGETS, LEVELS, LEVELS_LOW, SPINS, SPINS_LOW, LINE_AT = 0, 1, 2, 3, 4, 5, 6, 7
BLOCKED = 8  # 1 while a wheel is at its top speed
OFFSETS = 9  # of the time at which a command arrives, within its step [s]
LINES, LENGTHS = 10, 11  # commands on their way: where they lie, from the start of the memory, and how many
KEPT, N_MEMORY = 9, 12
SOON = 1e-9  # share of a piece: a level that passes zero so soon counts as past it
LAST_TERM = 2.0**-49  # of an exponential's series: the next one is far smaller
SHORT_MOMENT = 1e-4  # of the time in which something decays


class Drive(NamedTuple):
    """Kernels of actuators: see below for what they do. Of a scene without them each does nothing."""

    hold: Callable[[Floats], None]
    begin_step: Callable[[Floats], None]
    until: Callable[[Floats, float, float], float]
    settle: Callable[[Floats], None]
    show: Callable[[Floats, float], None]
    moment: Callable[[Floats], float]
    advance: Callable[[Floats, float], None]
    take_back: Callable[[Floats], None]


@kernel
def _list(model: Floats, which: int) -> int:
    """Where a list of the memory begins."""
    return int(model[MEMORY]) + which * int(model[int(model[DRIVE]) + COUNT])


@kernel
def _constants(model: Floats, which: int) -> int:
    """Where a list of what never changes begins, and the gains."""
    d = int(model[DRIVE])
    return d + LISTS + which * int(model[d + COUNT])


@kernel
def hold(model: Floats) -> None:
    """Remember what ``reduce_wrench`` made of the held wrench, and take the commands that act at once."""
    d = int(model[DRIVE])
    for i in range(3):
        model[d + HELD + i], model[d + HELD + 3 + i] = model[FORCE + i], model[TORQUE + i]
    model[d + HELD + 6] = model[ONLY_WORLD_TORQUE]
    if model[d + PLAIN] != 0.0:
        _aim_all(model, int(model[MEMORY]), _constants(model, LAGGING), int(model[d + COUNT]))
        return
    for i in range(int(model[d + COUNT])):
        if model[_list(model, OFFSETS) + i] == 0.0 and model[_list(model, LENGTHS) + i] == 0.0:
            model[_list(model, ARRIVING) + i] = model[_list(model, COMMANDS) + i]
            _aim(model, i)


@straight_line
def _aim_all(model: Floats, memory: int, lagging: int, count: int) -> None:
    """Let the commands be the targets."""

    def aim(k: Any) -> tuple[Any, ...]:
        i = 4 * k
        target, lags = row(model, memory + COMMANDS * count + i, 4), row(model, lagging + i, 4)
        set_row(model, memory + TARGETS * count + i, target)
        for which, at_once in ((LEVELS, target), (LEVELS_LOW, np.zeros(4))):
            place = memory + which * count + i
            set_row(model, place, lags * row(model, place, 4) + (1.0 - lags) * at_once)
        return ()

    repeated(0, count // 4, (), aim)


@kernel
def _aim(model: Floats, i: int) -> None:
    """Let the command that has arrived be the target; without a lag it is the level at once."""
    target = model[_list(model, ARRIVING) + i]
    model[_list(model, TARGETS) + i] = target
    if model[_constants(model, LAGGING) + i] == 0.0:
        model[_list(model, LEVELS) + i], model[_list(model, LEVELS_LOW) + i] = target, 0.0


@kernel
def begin_step(model: Floats) -> None:
    """Let each command set out, and say which arrives in this step."""
    d, memory = int(model[DRIVE]), int(model[MEMORY])
    count = int(model[d + COUNT])
    _, kept, _ = _slots(model)
    _copy_lists(model, memory, kept, KEPT * count // 4)
    if model[d + PLAIN] != 0.0:
        return
    for i in range(count):
        arriving, command = memory + ARRIVING * count + i, model[memory + i]
        length = int(model[memory + LENGTHS * count + i])
        if length == 0:
            model[arriving] = command
            continue
        line, at = memory + int(model[memory + LINES * count + i]), int(model[memory + LINE_AT * count + i])
        model[line + at] = command
        at = at + 1 if at < length else 0  # it has one place more than the steps that a command takes
        model[arriving] = model[line + at]
        model[memory + LINE_AT * count + i] = float(at)


@straight_line
def _copy_lists(model: Floats, at: int, to: int, rows: int) -> None:
    def copy(k: Any) -> tuple[Any, ...]:
        set_row(model, to + 4 * k, row(model, at + 4 * k, 4))
        return ()

    repeated(0, rows, (), copy)


@kernel
def take_back(model: Floats) -> None:
    """Undo what was done since ``begin_step``."""
    memory, count = int(model[MEMORY]), int(model[int(model[DRIVE]) + COUNT])
    _, kept, _ = _slots(model)
    _copy_lists(model, kept, memory, KEPT * count // 4)


@kernel
def until(model: Floats, passed: float, h: float) -> float:
    """Go on at the time ``passed`` of a step h [s]; returns that of the next event, or h."""
    d, end = int(model[DRIVE]), h
    if model[d + PLAIN] != 0.0:
        _aim_all(model, int(model[MEMORY]), _constants(model, LAGGING), int(model[d + COUNT]))
    else:
        end = _next_event(model, passed, h)
    settle(model)
    return end


@kernel
def _next_event(model: Floats, passed: float, h: float) -> float:
    end, count = h, int(model[int(model[DRIVE]) + COUNT])
    for i in range(count):
        offset = model[_list(model, OFFSETS) + i]
        if offset <= passed:
            _aim(model, i)
        elif offset < end:
            end = offset
    for i in range(count):
        if model[_constants(model, MOST_SPINS) + i] > 0.0:
            event = passed + _time_to_limit(model, i, end - passed)
            if passed < event < end:
                end = event
    return end


@kernel
def _time_to_limit(model: Floats, i: int, left: float) -> float:
    """Time until a wheel reaches its top speed or leaves it, or ``left``; notes whether it is at it now."""
    most, spin = model[_constants(model, MOST_SPINS) + i], model[_list(model, SPINS) + i]
    level, target = model[_list(model, LEVELS) + i], model[_list(model, TARGETS) + i]
    turn = _time_to_turn(model[_constants(model, TIME_CONSTANTS) + i], level, target)
    push = level if turn > SOON * left else target  # where it turns at once, it has turned but for round-off
    blocked = abs(spin) >= most and spin * push > 0.0
    model[_list(model, BLOCKED) + i] = 1.0 if blocked else 0.0
    early = min(turn, left)
    if blocked:
        return early
    if abs(_spin_after(model, i, early)) > most:
        return _time_of_limit(model, i, 0.0, early)
    if turn < left and abs(_spin_after(model, i, left)) > most:
        return _time_of_limit(model, i, turn, left)
    return left


@kernel
def _time_to_turn(lag: float, level: float, target: float) -> float:
    """When a level passes zero."""
    if lag == 0.0 or level * target >= 0.0:
        return math.inf
    return lag * math.log1p(-level / target)


@kernel
def _spin_after(model: Floats, i: int, t: float) -> float:
    """Momentum of a wheel [N m s] after t [s] under its motor alone."""
    lag, target = model[_constants(model, TIME_CONSTANTS) + i], model[_list(model, TARGETS) + i]
    late = (model[_list(model, LEVELS) + i] - target) * lag * -math.expm1(-t / lag) if lag > 0.0 else 0.0
    return model[_list(model, SPINS) + i] + (target * t + late)


@kernel
def _time_of_limit(model: Floats, i: int, low: float, high: float) -> float:
    """The time between two at which a wheel that speeds up reaches its top speed: bisection to the last bit."""
    most = model[_constants(model, MOST_SPINS) + i]
    for _ in range(1100):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if abs(_spin_after(model, i, middle)) > most:
            high = middle
        else:
            low = middle
    return high


@kernel
def settle(model: Floats) -> None:
    """Work out, from levels and targets, the values now and what changes."""
    d = int(model[DRIVE])
    count, slots = int(model[d + COUNT]), int(model[d + SLOTS])
    each, size = d + LISTS + N_LISTS * count, SHARES + 2 * count
    first, memory = each + SIZE * count, int(model[MEMORY])
    _add_up(model, d, count, each, memory)
    model[d + FASTEST] = 0.0
    for s in range(first, first + size * slots, size):
        _find_change(model, s, count, each, memory)
        if model[s + ACTIVE] > 0.0:
            model[d + FASTEST] = max(model[d + FASTEST], model[s])
    model[ONLY_WORLD_TORQUE] = model[d + HELD + 6] if model[d + TWISTS] == 0.0 else 0.0


@straight_line
def _add_up(model: Floats, d: int, count: int, each: int, memory: int) -> None:
    """What all actuators do now, and the growth of the internal momentum; the model holds it from here on."""

    def add_four(k: Any, wrench: Row, inside: Row, ramp: Row) -> tuple[Row, ...]:
        i = 4 * k
        level, spin, target = (row(model, memory + which * count + i, 4) for which in (LEVELS, SPINS, TARGETS))
        growth = (1.0 - row(model, memory + BLOCKED * count + i, 4)) * target
        square = level * level
        for lane in range(4):
            a = each + SIZE * (i + lane)
            wrench = wrench + (level[lane] * row(model, a + LINEAR, 8) + square[lane] * row(model, a + SQUARE, 8))
            axis = row(model, a + AXIS, 4)
            inside = inside + (level[lane] * row(model, a + MOMENTUM, 4) + spin[lane] * axis)
            ramp = ramp + growth[lane] * axis
        return wrench, inside, ramp

    wrench, inside, ramp = repeated(0, count // 4, (np.zeros(8), np.zeros(4), np.zeros(4)), add_four)
    set_row(model, d + VALUE, wrench)
    set_row(model, d + VALUE + 8, inside)
    set_row(model, d + RAMP, ramp)
    _set_shown(model, d, wrench, inside, ramp)


def _set_shown(model: Any, d: Any, wrench: Row, inside: Row, ramp: Row) -> None:
    for i in range(3):
        model[FORCE + i] = model[d + HELD + i] + wrench[i]
        model[TORQUE + i] = model[d + HELD + 3 + i] + wrench[4 + i]
    set_row(model, INTERNAL, inside)
    set_row(model, INTERNAL_SLOPE, ramp)


@straight_line
def _find_change(model: Floats, s: int, count: int, each: int, memory: int) -> None:
    """What changes in the slot at ``model[s]``, and how the internal momentum grows by it."""
    constants = each - N_LISTS * count

    def add_four(k: Any, wrench: Row, inside: Row, active: Any) -> tuple[Any, ...]:
        i = 4 * k
        level, low, target = (row(model, memory + which * count + i, 4) for which in (LEVELS, LEVELS_LOW, TARGETS))
        off, late = (level - target) + low, row(model, constants + TIME_CONSTANTS * count + i, 4)
        once, twice = row(model, s + SHARES + i, 4), row(model, s + SHARES + count + i, 4)
        linear = once * off
        square = linear * (2.0 * target) + twice * (off * off)
        spun = ((1.0 - row(model, memory + BLOCKED * count + i, 4)) * late) * linear
        for lane in range(4):
            a = each + SIZE * (i + lane)
            wrench = wrench + (linear[lane] * row(model, a + LINEAR, 8) + square[lane] * row(model, a + SQUARE, 8))
            inside = inside + (linear[lane] * row(model, a + MOMENTUM, 4) - spun[lane] * row(model, a + AXIS, 4))
        return wrench, inside, active + sum_of((once + twice) * magnitude(off))

    wrench, inside, active = repeated(0, count // 4, (np.zeros(8), np.zeros(4), 0.0), add_four)
    set_row(model, s + CHANGE, wrench)
    set_row(model, s + CHANGE + 8, inside)
    model[s + ACTIVE] = active
    set_row(model, INTERNAL_SLOPE, row(model, INTERNAL_SLOPE, 4) - model[s] * inside)


@kernel
def _slots(model: Floats) -> tuple[int, int, int]:
    """Where the slots begin and end, and the size of one."""
    d = int(model[DRIVE])
    count, slots = int(model[d + COUNT]), int(model[d + SLOTS])
    first, size = d + LISTS + (N_LISTS + SIZE) * count, SHARES + 2 * count
    return first, first + size * slots, size


@kernel
def show(model: Floats, t: float) -> None:
    """Let the model hold the wrench and the internal momentum of t [s] from when they were settled."""
    _show_ramp(model, int(model[DRIVE]), t)
    first, end, size = _slots(model)
    for s in range(first, end, size):
        _show_change(model, s, math.expm1(-model[s] * t) if model[s + ACTIVE] > 0.0 else 0.0)


@straight_line
def _show_ramp(model: Floats, d: int, t: float) -> None:
    ramp = row(model, d + RAMP, 4)
    _set_shown(model, d, row(model, d + VALUE, 8), row(model, d + VALUE + 8, 4) + t * ramp, ramp)


@straight_line
def _show_change(model: Floats, s: int, gone: float) -> None:
    for i in range(3):
        model[FORCE + i] = model[FORCE + i] + gone * model[s + CHANGE + i]
        model[TORQUE + i] = model[TORQUE + i] + gone * model[s + CHANGE + 4 + i]
    change = row(model, s + CHANGE + 8, 4)
    set_row(model, INTERNAL, row(model, INTERNAL, 4) + gone * change)
    set_row(model, INTERNAL_SLOPE, row(model, INTERNAL_SLOPE, 4) - (model[s] * (1.0 + gone)) * change)


@kernel
def moment(model: Floats) -> float:
    """A time [s] in which next to nothing changes; 0 where nothing does at all."""
    d = int(model[DRIVE])
    if model[d + FASTEST] > 0.0:
        return SHORT_MOMENT / model[d + FASTEST]
    ramps = model[d + RAMP] != 0.0 or model[d + RAMP + 1] != 0.0 or model[d + RAMP + 2] != 0.0
    return SHORT_MOMENT if ramps else 0.0


@kernel
def advance(model: Floats, t: float) -> None:
    """Let t [s] pass for levels and wheels; what the model shows stays as it was."""
    d = int(model[DRIVE])
    count = int(model[d + COUNT])
    if model[d + GAINS_FOR] != t:
        model[d + GAINS_FOR] = t
        for i in range(count):
            lag = model[_constants(model, TIME_CONSTANTS) + i]
            model[_constants(model, GAINS) + i] = -math.expm1(-t / lag) if lag > 0.0 else 1.0
    if model[d + PLAIN] == 0.0:
        for i in range(count):
            if model[_constants(model, MOST_SPINS) + i] > 0.0 and model[_list(model, BLOCKED) + i] == 0.0:
                _spin_up(model, i, t)
    _follow(model, int(model[MEMORY]), _constants(model, GAINS), count)


@kernel
def _spin_up(model: Floats, i: int, t: float) -> None:
    at, target = _list(model, SPINS) + i, model[_list(model, TARGETS) + i]
    off = (model[_list(model, LEVELS) + i] - target) + model[_list(model, LEVELS_LOW) + i]
    late = off * model[_constants(model, TIME_CONSTANTS) + i] * model[_constants(model, GAINS) + i]
    low = _list(model, SPINS_LOW) + i
    high, d = model[at], (target * t + late) + model[low]
    total = high + d
    kept = total - high
    model[at], model[low] = total, (high - (total - kept)) + (d - kept)
    most = model[_constants(model, MOST_SPINS) + i]
    if abs(total) > most:  # by round-off
        model[at], model[low] = math.copysign(most, total), 0.0


@straight_line
def _follow(model: Floats, memory: int, gains: int, count: int) -> None:
    """Let the levels come nearer to the targets, and keep what rounding drops (see kernels.state.add_compensated)."""

    def follow(k: Any) -> tuple[Any, ...]:
        i = 4 * k
        high, low, target = (row(model, memory + which * count + i, 4) for which in (LEVELS, LEVELS_LOW, TARGETS))
        d = low - row(model, gains + i, 4) * ((high - target) + low)
        total = high + d
        kept = total - high
        set_row(model, memory + LEVELS * count + i, total)
        set_row(model, memory + LEVELS_LOW * count + i, (high - (total - kept)) + (d - kept))
        return ()

    repeated(0, count // 4, (), follow)


@kernel
def fastest(model: Floats) -> float:
    """The fastest rate [1/s] at which something decays; 0 where nothing does."""
    return model[int(model[DRIVE]) + FASTEST]


@kernel
def is_expanded(model: Floats) -> bool:
    """Whether what a series leaves out of the exponentials, with the orders that it has come to, is below round-off."""
    enough, (first, end, size) = True, _slots(model)
    for s in range(first, end, size):
        enough = enough and not (model[s + ACTIVE] > 0.0 and abs(model[s + FACTOR]) > LAST_TERM)
    return enough


MORE_ORDERS = 4  # of a series, that are added at once
STRIDE = 16  # from one order to the next, of which twelve are used


@kernel
def expand(model: Floats, rows: Floats, to: int, h: float) -> None:
    """The first eight orders of the series of force, torque and internal momentum, in time by h [s].

    Twelve numbers an order, from rows[to + STRIDE k] on.
    """
    _begin_orders(model, rows, to + STRIDE, int(model[DRIVE]), h)
    first, end, size = _slots(model)
    for s in range(first, end, size):
        model[s + FACTOR] = 1.0
        _add_orders(model, rows, to, s, h, 1)
        _add_orders(model, rows, to, s, h, 1 + MORE_ORDERS)


@kernel
def expand_more(model: Floats, rows: Floats, to: int, h: float, first: int) -> None:
    """Four more, from order ``first`` on, one more than it has come to."""
    _clear_orders(rows, to + STRIDE * first)
    begin, end, size = _slots(model)
    for s in range(begin, end, size):
        _add_orders(model, rows, to, s, h, first)


@straight_line
def _begin_orders(model: Floats, rows: Floats, to: int, d: int, h: float) -> None:
    clear_orders(rows, to, 2 * MORE_ORDERS)
    set_row(rows, to + 8, h * row(model, d + RAMP, 4))


@straight_line
def _clear_orders(rows: Floats, to: int) -> None:
    clear_orders(rows, to, MORE_ORDERS)


def clear_orders(rows: Any, to: Any, orders: int) -> None:
    """Set as many orders to zero."""
    for at in range(0, STRIDE * orders, 8):
        set_row(rows, to + at, np.zeros(8))


@straight_line
def _add_orders(model: Floats, rows: Floats, to: int, s: int, h: float, first: int) -> None:
    """Add what one slot has of four orders."""
    factor, rate = model[s + FACTOR], -(model[s] * h)
    wrench, inside = row(model, s + CHANGE, 8), row(model, s + CHANGE + 8, 4)
    for more in range(MORE_ORDERS):
        k = first + more
        factor = factor * (rate / k)
        at = to + STRIDE * k
        set_row(rows, at, row(rows, at, 8) + factor * wrench)
        set_row(rows, at + 8, row(rows, at + 8, 4) + factor * inside)
    model[s + FACTOR] = factor


DRIVE_KERNELS = Drive(hold, begin_step, until, settle, show, moment, advance, take_back)


@kernel
def _nothing(model: Floats) -> None:
    return


@kernel
def _nothing_until(model: Floats, passed: float, h: float) -> float:
    return h


@kernel
def _nothing_at(model: Floats, t: float) -> None:
    return


@kernel
def _no_moment(model: Floats) -> float:
    return 0.0


NO_DRIVE = Drive(_nothing, _nothing, _nothing_until, _nothing, _nothing_at, _no_moment, _nothing_at, _nothing)
