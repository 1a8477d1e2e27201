"""Many bodies in one call: one after the other, or eight at once where few orders of the series are enough for each.

States and models are rows of two arrays. What is done to a body, and its bits, do not depend on the others: eight at
once is the same kernel as one by itself, with a body in each lane (see kernels.symbols).
"""

import math
from collections.abc import Callable, Sequence
from functools import cache

from ..kernels.arrays import Floats, Integers
from ..kernels.compiled import kernel
from ..kernels.lock import give_up_lock, take_back_lock
from ..kernels.model import (
    ARM_ROWS,
    CARRIED,
    FORCE,
    GYRO,
    LEVERS,
    MASS,
    MOMENT_ROW,
    MOST_MOMENTUM,
    N_CARRIED,
    ONLY_WORLD_TORQUE,
    REDUCED,
    SAFE_ANGULAR_MOMENTUM,
    WRENCH,
)
from ..kernels.motion import Acting
from ..kernels.state import SIZE, L
from ..kernels.straight_line import straight_line
from ..kernels.symbols import BODIES
from ..kernels.wrench import reduce_wrench
from .base import TINY, Integrator, Kind, loop_of
from .script import COMMAND_SIZE, scripted

BLOCK_SIZE = BODIES * (2 * SIZE + LEVERS)  # floats: states of eight, the same before a step, models

# ``advance(states, models, width, which, counts, work, block, h, commands, kept, stride, since, every)``: each body of
# ``which`` (indices) by as many steps as its entry in ``counts`` says, which then says how many were done; ``width`` is
# the length of a row of the models. The rest is as in script.scripted, the same for all; what is kept of body i begins
# at ``kept[26 * i]``.
Many = Callable[..., None]


def write_wrenches(models: Floats, width: int, which: Integers, wrenches: Floats) -> None:
    """Put rows of twelve values (see Wrench.values) into the models of these bodies, and reduce them."""
    for k in range(len(which)):
        first = width * which[k]
        for i in range(12):
            models[first + WRENCH + i] = wrenches[12 * k + i]
        reduce_wrench(models[first : first + width])


@cache
def one_by_one(integrator: Integrator, acting: Acting) -> Many:
    """The kernel for bodies that an integrator advances under loads."""
    script = kernel(scripted(loop_of(integrator, acting)))

    def advance(
        states: Floats,
        models: Floats,
        width: int,
        which: Integers,
        counts: Integers,
        work: Floats,
        block: Floats,
        h: float,
        commands: Floats,
        kept: Floats,
        stride: int,
        since: int,
        every: int,
    ) -> None:
        thread = give_up_lock()
        for k in range(len(which)):
            i = which[k]
            state, model, own = states[SIZE * i :], models[width * i :], kept[SIZE * i :]
            counts[k] = script(state, model, work, h, counts[k], commands, own, stride, since, every)
        take_back_lock(thread)

    return advance


@cache
def eight_at_once(integrator: Integrator, acting: Acting, kind: Kind) -> Many:
    """The kernel for bodies of a kind, of which each has the same number of steps to do."""
    assert integrator.short_steps is not None
    six, eight = (integrator.short_steps(kind, orders) for orders in (6, 8))
    steps = kernel(loop_of(integrator, acting))
    load_model = _loader(_slots(kind))

    @kernel
    def load_models(block: Floats, models: Floats, width: int, which: Integers) -> int:
        """Returns for which bodies the model is not of the kind, as bits."""
        others = 0
        for lane in range(len(which)):
            at = width * which[lane]
            load_model(block, lane, models, at)
            pushed = models[at + FORCE] != 0.0 or models[at + FORCE + 1] != 0.0 or models[at + FORCE + 2] != 0.0
            only = models[at + ONLY_WORLD_TORQUE] != 0.0
            if pushed != kind.pushed or only != kind.only_world_torque or int(models[at + N_CARRIED]) != kind.carried:
                others |= 1 << lane
        return others

    @kernel
    def advance_eight(
        states: Floats,
        models: Floats,
        width: int,
        which: Integers,
        counts: Integers,
        work: Floats,
        block: Floats,
        h: float,
        commands: Floats,
        kept: Floats,
        stride: int,
        since: int,
        every: int,
    ) -> None:
        state, before = block[: BODIES * SIZE], block[BODIES * SIZE : 2 * BODIES * SIZE]
        model = block[2 * BODIES * SIZE :]
        for lane in range(len(which)):
            _load_state(state, lane, states, SIZE * which[lane])
        for lane in range(len(which), BODIES):  # the first one stands in for those that are missing
            _load_state(state, lane, states, SIZE * which[0])
            load_model(model, lane, models, width * which[0])
        others = load_models(model, models, width, which)
        going, few, at, to = (1 << len(which)) - 1, _are_slow(state, model, h), 0, 0
        for step in range(counts[0]):
            if at < len(commands) and int(commands[at]) <= step:
                while at < len(commands) and int(commands[at]) <= step:
                    at += COMMAND_SIZE
                for lane in range(len(which)):
                    _hold(models[width * which[lane] :], commands, at - COMMAND_SIZE)
                others = load_models(model, models, width, which)
                few = _are_slow(state, model, h)
            _copy(state, before)
            done = six(state, model, h) if few else eight(state, model, h)
            if few and done & going & ~others != going & ~others:
                few = False
                _copy(before, state)
                done = eight(state, model, h)
            for lane in range(BODIES):
                if (going & (others | ~done)) >> lane & 1:
                    i = which[lane]
                    own = states[SIZE * i : SIZE * (i + 1)]
                    _store_state(before, lane, own, 0)
                    if steps(own, models[width * i : width * (i + 1)], work, h, 1) == 1:
                        _load_state(state, lane, own, 0)
                    else:
                        going &= ~(1 << lane)
                        counts[lane] = step
            since += 1
            if since == every:
                for lane in range(BODIES):
                    if going >> lane & 1:
                        _store_state(state, lane, kept, to + SIZE * which[lane])
                to += stride
                since = 0
        for lane in range(BODIES):
            if going >> lane & 1:
                _store_state(state, lane, states, SIZE * which[lane])

    def advance(
        states: Floats,
        models: Floats,
        width: int,
        which: Integers,
        counts: Integers,
        work: Floats,
        block: Floats,
        h: float,
        commands: Floats,
        kept: Floats,
        stride: int,
        since: int,
        every: int,
    ) -> None:
        thread = give_up_lock()
        for k in range(0, len(which), BODIES):
            some, their = which[k : k + BODIES], counts[k : k + BODIES]
            advance_eight(states, models, width, some, their, work, block, h, commands, kept, stride, since, every)
        take_back_lock(thread)

    return advance


@kernel
def _hold(model: Floats, commands: Floats, at: int) -> None:
    for i in range(12):
        model[WRENCH + i] = commands[at + 1 + i]
    reduce_wrench(model)


def _slots(kind: Kind) -> list[int]:
    """Of a model, what short steps read."""
    carried = [*range(CARRIED, CARRIED + 3 * kind.carried), *range(ARM_ROWS, ARM_ROWS + 12 * kind.carried)]
    return [MASS, MOST_MOMENTUM, SAFE_ANGULAR_MOMENTUM, *range(GYRO, REDUCED + 9 + 1), *carried]


@kernel
def _copy(block: Floats, to: Floats) -> None:
    for i in range(BODIES * SIZE):
        to[i] = block[i]


@kernel
def _are_slow(state: Floats, model: Floats, h: float) -> bool:
    """Whether none of eight bodies can turn by more than TINY in a step of h [s]: a guess at what they take."""
    fastest = 0.0
    for lane in range(BODIES):
        squared, least = 0.0, math.inf
        for i in range(3):
            momentum = state[BODIES * (L + i) + lane]
            squared += momentum * momentum
            least = min(least, model[BODIES * (MOMENT_ROW + i) + lane])
        fastest = max(fastest, squared / (least * least))
    return fastest * (h * h) < TINY * TINY


def _loader(slots: Sequence[int]) -> Callable[[Floats, int, Floats, int], None]:
    """The kernel that puts these numbers of a body, whose first is ``numbers[at]``, into a lane of a block."""

    @straight_line
    def load(block: Floats, lane: int, numbers: Floats, at: int) -> None:
        for i in slots:
            block[BODIES * i + lane] = numbers[at + i]

    return load


_load_state = _loader(range(SIZE))


@straight_line
def _store_state(block: Floats, lane: int, states: Floats, at: int) -> None:
    for i in range(SIZE):
        states[at + i] = block[BODIES * i + lane]
