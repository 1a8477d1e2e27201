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

BLOCK_SIZE = BODIES * (2 * SIZE + LEVERS)  # floats: states of eight, the same before a step, models
UNKNOWN = -1  # in place of a ``wrench_kind``

# ``advance(states, models, width, which, counts, work, block, h)``: each body of ``which`` (indices) by as many steps
# as its entry in ``counts`` says, which then says how many were done; ``width`` is the length of a row of the models.
Many = Callable[[Floats, Floats, int, Integers, Integers, Floats, Floats, float], None]


def write_wrenches(models: Floats, width: int, which: Integers, wrenches: Floats, kinds: Integers) -> int:
    """Put rows of twelve values (see Wrench.values) into the models of these bodies, and reduce those that are new.

    The bodies that had other values come to the front of ``which``, and how many they are is returned; ``kinds`` has a
    ``wrench_kind`` for each body, or UNKNOWN.
    """
    n = 0
    for k in range(len(which)):
        i = which[k]
        first, new = width * i + WRENCH, kinds[i] == UNKNOWN
        for j in range(12):
            new = new or models[first + j] != wrenches[12 * k + j]
        if new:
            for j in range(12):
                models[first + j] = wrenches[12 * k + j]
            model = models[width * i : width * (i + 1)]
            reduce_wrench(model)
            kinds[i] = wrench_kind(model)
            which[n] = i
            n += 1
    return n


@kernel
def wrench_kind(model: Floats) -> int:
    """What of the held wrench decides by which kernel a body goes on: see groups.

    1 where it may turn the body, 2 where all torque is fixed in the world, 4 where a force in body axes acts, and 8 for
    each carried vector.
    """
    turns, pushed = False, False
    for i in range(12):
        turns = turns or ((i < 6 or i > 8) and model[WRENCH + i] != 0.0)
    for i in range(3):
        pushed = pushed or model[FORCE + i] != 0.0
    bits = (1 if turns else 0) + (2 if model[ONLY_WORLD_TORQUE] != 0.0 else 0) + (4 if pushed else 0)
    return bits + 8 * int(model[N_CARRIED])


@cache
def one_by_one(integrator: Integrator, acting: Acting) -> Many:
    """The kernel for bodies that an integrator advances under loads."""
    steps = kernel(loop_of(integrator, acting))

    def advance(
        states: Floats,
        models: Floats,
        width: int,
        which: Integers,
        counts: Integers,
        work: Floats,
        block: Floats,
        h: float,
    ) -> None:
        thread = give_up_lock()
        for k in range(len(which)):
            i = which[k]
            model = models[width * i : width * (i + 1)]
            counts[k] = steps(states[SIZE * i : SIZE * (i + 1)], model, work, h, counts[k])
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
    def advance_eight(
        states: Floats,
        models: Floats,
        width: int,
        which: Integers,
        counts: Integers,
        work: Floats,
        block: Floats,
        h: float,
    ) -> None:
        state, before = block[: BODIES * SIZE], block[BODIES * SIZE : 2 * BODIES * SIZE]
        model = block[2 * BODIES * SIZE :]
        for lane in range(BODIES):
            _load_state(state, lane, states, SIZE * which[lane])
            load_model(model, lane, models, width * which[lane])
        going, few, n = (1 << BODIES) - 1, _are_slow(state, model, h), counts[0]
        for step in range(n):
            _copy(state, before)
            done = six(state, model, h) if few else eight(state, model, h)
            if few and done & going != going:
                few = False
                _copy(before, state)
                done = eight(state, model, h)
            for lane in range(BODIES):
                if (going & ~done) >> lane & 1:
                    i = which[lane]
                    own = states[SIZE * i : SIZE * (i + 1)]
                    _store_state(before, lane, own, 0)
                    if steps(own, models[width * i : width * (i + 1)], work, h, 1) == 1:
                        _load_state(state, lane, own, 0)
                    else:
                        going &= ~(1 << lane)
                        counts[lane] = step
            if going == 0:
                break
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
    ) -> None:
        thread = give_up_lock()
        whole = len(which) - len(which) % BODIES
        for k in range(0, whole, BODIES):
            advance_eight(states, models, width, which[k : k + BODIES], counts[k : k + BODIES], work, block, h)
        for k in range(whole, len(which)):
            i = which[k]
            model = models[width * i : width * (i + 1)]
            counts[k] = steps(states[SIZE * i : SIZE * (i + 1)], model, work, h, counts[k])
        take_back_lock(thread)

    return advance


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
