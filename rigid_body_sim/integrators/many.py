"""Many bodies in one call: one after the other, or eight at once where few orders of the series are enough for each.

States and models are rows of two arrays. What is done to a body, and its bits, do not depend on the others: eight at
once is the same kernel as one by itself, with a body in each lane (see kernels.symbols).
"""

import math
from collections.abc import Callable, Sequence
from functools import cache

from ..effects.base import NOTHING_ACTS
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
from . import taylor, taylor_lanes
from .base import TINY, Integrator, loop_of
from .script import COMMAND_SIZE, Script, scripted
from .taylor import SHORT

# Where what belongs to eight bodies lies in a block: states, the same before a step, and as another way leads; models.
STATE, BEFORE, OTHER, MODEL = (BODIES * SIZE * i for i in range(4))
SCRATCH = MODEL + BODIES * LEVERS
BLOCK_SIZE = SCRATCH + BODIES * taylor_lanes.SIZE
UNKNOWN = -1  # in place of a ``wrench_kind``

# ``advance(states, models, width, which, counts, work, block, h, script)``: each body of ``which`` (indices) by as many
# steps as its entry in ``counts`` says, which then says how many were done; ``width`` is the length of a row of the
# models. The script is the same for all; what is kept of body i begins at ``kept[26 * i]``.
Many = Callable[..., None]


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


def reduce_wrenches(models: Floats, width: int, which: Integers, kinds: Integers) -> None:
    """Reduce the wrenches that these bodies hold, and find the ``wrench_kind`` of each."""
    for k in range(len(which)):
        i = which[k]
        model = models[width * i : width * (i + 1)]
        reduce_wrench(model)
        kinds[i] = wrench_kind(model)


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
    run = kernel(scripted(loop_of(integrator, acting)))

    def advance(
        states: Floats,
        models: Floats,
        width: int,
        which: Integers,
        counts: Integers,
        work: Floats,
        block: Floats,
        h: float,
        script: Script,
    ) -> None:
        thread = give_up_lock()
        for k in range(len(which)):
            i = which[k]
            counts[k] = run(states[SIZE * i :], models[width * i :], work, h, counts[k], script, SIZE * i)
        take_back_lock(thread)

    return advance


@cache
def eight_at_once(carried: int) -> Many:
    """The kernel of ``taylor`` for bodies with so many carried vectors, of which each has as many steps to do."""
    step_of_eight = _step_of_eight(carried)
    steps = kernel(loop_of(taylor.INTEGRATOR, NOTHING_ACTS))
    load_models = _model_loader(carried)

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
        script: Script,
    ) -> None:
        state, before, commands, since = block[STATE:BEFORE], block[BEFORE:OTHER], script.commands, script.since
        for lane in range(BODIES):  # the first one stands in for those that are missing
            _load_state(state, lane, states, SIZE * which[lane if lane < len(which) else 0])
        others = load_models(block, models, width, which)
        going, mode, at, to = (1 << len(which)) - 1, _guess(block, h), 0, 0
        for step in range(counts[0]):
            if at < len(commands) and int(commands[at]) <= step:
                while at < len(commands) and int(commands[at]) <= step:
                    at += COMMAND_SIZE
                for lane in range(len(which)):
                    if going >> lane & 1:
                        _hold(models[width * which[lane] :], commands, at - COMMAND_SIZE)
                others = load_models(block, models, width, which)
                mode = _guess(block, h)
            _copy(state, before)
            done = 0
            if mode != 0:
                done, mode = step_of_eight(block, models, width * which[0], h, going & ~others, mode)
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
            since += 1
            if since == script.every:
                for lane in range(BODIES):
                    if going >> lane & 1:
                        _store_state(state, lane, script.kept, to + SIZE * which[lane])
                to += script.stride
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
        script: Script,
    ) -> None:
        thread = give_up_lock()
        for k in range(0, len(which), BODIES):
            some, their = which[k : k + BODIES], counts[k : k + BODIES]
            advance_eight(states, models, width, some, their, work, block, h, script)
        take_back_lock(thread)

    return advance


def _step_of_eight(carried: int) -> Callable[..., tuple[int, int]]:
    six, eight, twelve = (taylor_lanes.step(carried, orders) for orders in (6, 8, 12))

    @kernel
    def step_of_eight(block: Floats, models: Floats, first: int, h: float, wanted: int, mode: int) -> tuple[int, int]:
        """Advance those that are wanted, in ``mode`` orders or else in others; returns which, and in how many, or 0."""
        state, other, model, scratch = block[STATE:BEFORE], block[OTHER:MODEL], block[MODEL:SCRATCH], block[SCRATCH:]
        pushed, only = _is_pushed(models, first), models[first + ONLY_WORLD_TORQUE] != 0.0
        rest, orders, best, target = wanted, mode, mode, state
        while True:
            if orders == 6:
                done = six(target, model, scratch, h, pushed, only) & rest
            elif orders == 8:
                done = eight(target, model, scratch, h, pushed, only) & rest
            else:
                done = twelve(target, model, scratch, h, pushed, only) & rest
            if target is not state:
                _take_over(other, state, done)
            if done != 0 and rest == wanted:
                best = orders
            rest &= ~done
            # 6, 8, 12; or 8, 12; or 12, 8
            coming = 8 if orders == 6 or (orders == 12 and mode == 12) else 12 if orders == 8 and mode != 12 else 0
            if rest == 0 or coming == 0:
                return wanted & ~rest, 0 if rest == wanted else best
            _copy(block[BEFORE:OTHER], other)
            orders, target = coming, other

    return step_of_eight


@kernel
def _take_over(block: Floats, to: Floats, which: int) -> None:
    for lane in range(BODIES):
        if which >> lane & 1:
            for i in range(SIZE):
                to[BODIES * i + lane] = block[BODIES * i + lane]


@kernel
def _is_pushed(models: Floats, at: int) -> bool:
    return models[at + FORCE] != 0.0 or models[at + FORCE + 1] != 0.0 or models[at + FORCE + 2] != 0.0


def _model_loader(carried: int) -> Callable[[Floats, Floats, int, Integers], int]:
    numbers = [*range(CARRIED, CARRIED + 3 * carried), *range(ARM_ROWS, ARM_ROWS + 12 * carried)]
    load = _loader(
        [MASS, MOST_MOMENTUM, SAFE_ANGULAR_MOMENTUM, *range(GYRO, GYRO + 16), *range(REDUCED, REDUCED + 11), *numbers]
    )

    @kernel
    def load_models(block: Floats, models: Floats, width: int, which: Integers) -> int:
        """Put what short steps read of the models into a block; returns which are not like the first, as bits."""
        others, first, model = 0, width * which[0], block[MODEL:SCRATCH]
        for lane in range(BODIES):
            at = width * which[lane if lane < len(which) else 0]
            load(model, lane, models, at)
            alike = _is_pushed(models, at) == _is_pushed(models, first)
            alike = alike and models[at + ONLY_WORLD_TORQUE] == models[first + ONLY_WORLD_TORQUE]
            if not (alike and int(models[at + N_CARRIED]) == carried):
                others |= 1 << lane
        return others

    return load_models


@kernel
def _hold(model: Floats, commands: Floats, at: int) -> None:
    for i in range(12):
        model[WRENCH + i] = commands[at + 1 + i]
    reduce_wrench(model)


@kernel
def _copy(block: Floats, to: Floats) -> None:
    for i in range(BODIES * SIZE):
        to[i] = block[i]


@kernel
def _guess(block: Floats, h: float) -> int:
    """How many orders eight bodies probably need: by what the one that turns fastest, if it can, turns in a step."""
    fastest = 0.0
    for lane in range(BODIES):
        squared, least = 0.0, math.inf
        for i in range(3):
            momentum = block[STATE + BODIES * (L + i) + lane]
            squared += momentum * momentum
            least = min(least, block[MODEL + BODIES * (MOMENT_ROW + i) + lane])
        fastest = max(fastest, squared / (least * least))
    angle = math.sqrt(fastest) * h
    return 6 if angle < TINY else 8 if angle < SHORT else 12


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
