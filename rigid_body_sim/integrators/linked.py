"""Bodies with links between them, advanced as one system by DOP853: 12 k unknowns, one error control.

Each body has its own loads, actuators, fluid and memory; what a link does to it comes to its held wrench, before added
mass answers. States and models are rows of two arrays, as those of ``many`` are; ``which`` says which rows.
"""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from ..effects import link
from ..effects.base import NOTHING_ACTS
from ..kernels import compiled
from ..kernels.arrays import Floats, Integers
from ..kernels.compiled import kernel
from ..kernels.drive import NO_DRIVE
from ..kernels.lock import give_up_lock, take_back_lock
from ..kernels.model import RTOL
from ..kernels.motion import Acting, Passed, held_load, motion
from ..kernels.state import LOW, SIZE, Q, copy, is_finite
from ..kernels.tuples import Load, Motion, Quat, added, vec
from ..kernels.wrench import reduce_wrench
from . import dop853, substep
from .substep import UNKNOWNS

# Of each body what a slope needs, from work[system.y] on: its state, its motion, and what the links do to it.
_MOTION = LOW
_LINKED = _MOTION + 13
_PLACE_SIZE = _LINKED + 6

# ``advance(states, models, width, which, links, work, h, n)``: up to n steps of h [s], and how many were done. A step
# that cannot be done leaves all bodies as they were before it. ``width`` is the length of a row of models; ``links``
# has the rows of effects.link, one after the other; ``work`` is scratch space of ``work_size`` numbers.
Advance = Callable[[Floats, Floats, int, Integers, Floats, Floats, float, int], int]


class Linked(NamedTuple):
    """What does not change in a call: see Advance. ``rtol`` is the smallest of the bodies'."""

    width: int
    which: Integers
    links: Floats
    rtol: float


class _Each(NamedTuple):
    """Kernels of all bodies, one after the other; see ``_and``."""

    settle: Callable[[Linked, Floats, Floats], None]
    load: Callable[[Linked, Floats, Floats, int, int, int], None]
    passes_kink: Callable[[Linked, Floats, Floats, Floats, int], bool]
    passed: Callable[[Linked, Floats, Floats, Floats, int, float], Passed]
    hold: Callable[[Linked, Floats], None]
    begin_step: Callable[[Linked, Floats], None]
    until: Callable[[Linked, Floats, float, float], float]
    settle_drive: Callable[[Linked, Floats], None]
    show: Callable[[Linked, Floats, float], None]
    pass_time: Callable[[Linked, Floats, float], None]
    take_back: Callable[[Linked, Floats], None]
    advance: Callable[[Linked, Floats, float], None]


def work_size(bodies: int) -> int:
    """How many numbers of scratch space so many bodies need."""
    return _y(bodies) + bodies * _PLACE_SIZE


def _y(bodies: int) -> int:
    return dop853.places(bodies * UNKNOWNS, bodies * SIZE)[-1]


@cache
def linked(actings: tuple[Acting, ...]) -> Advance:
    """The kernel for bodies with these loads and actuators, in their order; those that are alike share their code."""
    each, k = _each(actings), len(actings)
    system = _system(each, k)

    @kernel
    def step(b: Linked, states: Floats, models: Floats, work: Floats, h: float) -> bool:
        passed, good = 0.0, True
        each.begin_step(b, models)
        while good and passed < h:
            end = each.until(b, models, passed, h)
            good = dop853.step_of(system, b, states, models, work, end - passed)
            passed = end
        for i in range(k):
            good = good and is_finite(states[_at(b, i) :], models[_model_at(b, i) :])
        return good

    def advance(
        states: Floats, models: Floats, width: int, which: Integers, links: Floats, work: Floats, h: float, n: int
    ) -> int:
        thread = give_up_lock()
        b = Linked(width, which, links, _smallest_rtol(models, width, which))
        for i in range(k):
            reduce_wrench(models[_model_at(b, i) :])
        each.hold(b, models)
        done = 0
        while done < n:
            for i in range(k):
                copy(states, SIZE * which[i], work, SIZE * i)
            if not step(b, states, models, work, h):
                for i in range(k):
                    copy(work, SIZE * i, states, SIZE * which[i])
                each.take_back(b, models)
                break
            each.advance(b, models, h)
            done += 1
        each.settle_drive(b, models)
        take_back_lock(thread)
        return done

    return advance


def ready_linked(actings: tuple[Acting, ...]) -> Advance:
    """The same, compiled; without numba a step whose arithmetic raises is one that cannot be done, too."""
    wanted = request(actings)
    run = compiled.ready(wanted.function, *wanted.examples)
    return run if compiled.ENABLED else _in_python(run)


def request(actings: tuple[Acting, ...]) -> compiled.Request:
    """What is to be compiled for that."""
    numbers, whole = np.zeros(1), np.zeros(1, np.int64)
    return compiled.Request(linked(actings), (numbers, numbers, 1, whole, numbers, numbers, 1.0, 1))


def _in_python(run: Advance) -> Advance:
    def advance(
        states: Floats, models: Floats, width: int, which: Integers, links: Floats, work: Floats, h: float, n: int
    ) -> int:
        def steps(states: Floats, models: Floats, work: Floats, h: float, n: int) -> int:
            return run(states, models, width, which, links, work, h, n)

        return compiled.refuse_what_raises(steps, states, models, work, h, n)

    return advance


@kernel
def _at(b: Linked, i: int) -> int:
    """Where the state of the body in that place begins."""
    return SIZE * b.which[i]


@kernel
def _model_at(b: Linked, i: int) -> int:
    return b.width * b.which[i]


@kernel
def _smallest_rtol(models: Floats, width: int, which: Integers) -> float:
    smallest = models[width * which[0] + RTOL]
    for i in range(1, len(which)):
        smallest = min(smallest, models[width * which[i] + RTOL])
    return smallest


# What is one loop over all bodies, whatever acts on them ------------------------------------------------------------


@kernel
def _place(b: Linked, states: Floats, models: Floats, work: Floats, z: int, y: int) -> None:
    """State and motion of each body after its increments, which begin at work[z], and no load of links so far."""
    for i in range(len(b.which)):
        state, model, at = states[_at(b, i) :], models[_model_at(b, i) :], y + _PLACE_SIZE * i
        q = substep.place(state, work, z + UNKNOWNS * i, at)
        work[at + Q], work[at + Q + 1], work[at + Q + 2], work[at + Q + 3] = q
        _write_motion(work, at + _MOTION, motion(model, work, at, q))
        for j in range(6):
            work[at + _LINKED + j] = 0.0


@kernel
def _write_motion(work: Floats, at: int, body: Motion) -> None:
    work[at], work[at + 1], work[at + 2], work[at + 3] = body.q
    work[at + 4], work[at + 5], work[at + 6] = body.x
    work[at + 7], work[at + 8], work[at + 9] = body.v
    work[at + 10], work[at + 11], work[at + 12] = body.w


@kernel
def _read_motion(work: Floats, at: int) -> Motion:
    return Motion(_quat(work, at), vec(work, at + 4), vec(work, at + 7), vec(work, at + 10))


@kernel
def _quat(work: Floats, at: int) -> Quat:
    return Quat(work[at], work[at + 1], work[at + 2], work[at + 3])


@kernel
def _add_links(b: Linked, work: Floats, y: int) -> None:
    """What each link does to its two bodies, whose motions are in place."""
    for at in range(0, len(b.links), link.SIZE):
        first = y + _PLACE_SIZE * int(b.links[at + link.FIRST])
        second = y + _PLACE_SIZE * int(b.links[at + link.SECOND])
        ends = link.link_loads(b.links, at, _read_motion(work, first + _MOTION), _read_motion(work, second + _MOTION))
        _add(work, first + _LINKED, ends.first)
        _add(work, second + _LINKED, ends.second)


@kernel
def _add(work: Floats, at: int, load: Load) -> None:
    f, t = load.force, load.torque
    work[at], work[at + 1], work[at + 2] = work[at] + f.x, work[at + 1] + f.y, work[at + 2] + f.z
    work[at + 3], work[at + 4], work[at + 5] = work[at + 3] + t.x, work[at + 4] + t.y, work[at + 5] + t.z


@kernel
def _usable(work: Floats, z: int, unknowns: int) -> bool:
    good = True
    for i in range(0, unknowns, UNKNOWNS):
        good = good and substep.usable(work, z + i)
    return good


@kernel
def _weighed(
    b: Linked, states: Floats, models: Floats, work: Floats, z: int, e: int, share: float, rate: float
) -> float:
    """The error of the body that has the worst."""
    worst = 0.0
    for i in range(len(b.which)):
        state, model, o = states[_at(b, i) :], models[_model_at(b, i) :], UNKNOWNS * i
        own = share * (b.rtol / model[RTOL])
        worst = max(worst, substep.weighed(state, model, work, z + o, e + o, own, rate))
    return worst


@kernel
def _accept(b: Linked, states: Floats, work: Floats, z: int) -> None:
    for i in range(len(b.which)):
        substep.accept(states[_at(b, i) :], work, z + UNKNOWNS * i)


@kernel
def _link_passes_kink(b: Linked, states: Floats, models: Floats, work: Floats, z: int) -> bool:
    """Whether a link begins or ends to pull within the increments work[z:]."""
    kink = False
    for at in range(0, len(b.links), link.SIZE):
        if not kink and b.links[at + link.SLACK] != 0.0:
            i, j = int(b.links[at + link.FIRST]), int(b.links[at + link.SECOND])
            before = link.pulls(b.links, at, _begin(b, states, models, i), _begin(b, states, models, j))
            ends = _end(b, states, models, work, z, i), _end(b, states, models, work, z, j)
            kink = link.pulls(b.links, at, ends[0], ends[1]) != before
    return kink


@kernel
def _begin(b: Linked, states: Floats, models: Floats, i: int) -> Motion:
    return substep.motion_at(states[_at(b, i) :], models[_model_at(b, i) :])


@kernel
def _end(b: Linked, states: Floats, models: Floats, work: Floats, z: int, i: int) -> Motion:
    return substep.moved(states[_at(b, i) :], models[_model_at(b, i) :], work, z + UNKNOWNS * i)


# What each body has kernels of its own for --------------------------------------------------------------------------


def _system(each: _Each, bodies: int) -> dop853.System:
    """The system of so many bodies and the links between them."""
    unknowns, load_of, kink_of = bodies * UNKNOWNS, each.load, each.passes_kink

    @kernel
    def slope(b: Linked, states: Floats, models: Floats, work: Floats, z: int, y: int, to: int) -> None:
        _place(b, states, models, work, z, y)
        _add_links(b, work, y)
        load_of(b, models, work, z, y, to)

    @kernel
    def usable(work: Floats, z: int) -> bool:
        return _usable(work, z, unknowns)

    @kernel
    def passes_kink(b: Linked, states: Floats, models: Floats, work: Floats, z: int) -> bool:
        return kink_of(b, states, models, work, z) or _link_passes_kink(b, states, models, work, z)

    return dop853.System(
        *dop853.places(unknowns, bodies * SIZE),
        each.settle,
        slope,
        usable,
        _weighed,
        passes_kink,
        each.passed,
        _accept,
        each.show,
        each.pass_time,
        each.settle_drive,
    )


@kernel
def _nothing(b: Linked, models: Floats) -> None:
    return


@kernel
def _nothing_at(b: Linked, models: Floats, t: float) -> None:
    return


@kernel
def _nothing_until(b: Linked, models: Floats, passed: float, h: float) -> float:
    return h


@kernel
def _nothing_settled(b: Linked, states: Floats, models: Floats) -> None:
    return


@kernel
def _no_load(b: Linked, models: Floats, work: Floats, z: int, y: int, to: int) -> None:
    return


@kernel
def _no_kink(b: Linked, states: Floats, models: Floats, work: Floats, z: int) -> bool:
    return False


@kernel
def _no_event(b: Linked, states: Floats, models: Floats, work: Floats, z: int, size: float) -> Passed:
    return Passed(-1.0, 1.0)


_NO_BODY = _Each(
    _nothing_settled,
    _no_load,
    _no_kink,
    _no_event,
    _nothing,
    _nothing,
    _nothing_until,
    _nothing,
    _nothing_at,
    _nothing_at,
    _nothing,
    _nothing_at,
)


def _each(actings: tuple[Acting, ...]) -> _Each:
    each = _NO_BODY
    for acting in dict.fromkeys(actings):
        each = _and(each, acting, tuple(i for i, one in enumerate(actings) if one is acting))
    return each


def _and(others: _Each, acting: Acting, bodies: tuple[int, ...]) -> _Each:
    """The others, then the bodies with these places, on which the same kinds of loads act."""
    drive = acting.drive
    return _Each(
        _settling(others.settle, acting, bodies),
        _loading(others.load, acting, bodies),
        _kinks(others.passes_kink, acting, bodies),
        _events(others.passed, acting, bodies),
        _for_each(others.hold, drive.hold, bodies),
        _for_each(others.begin_step, drive.begin_step, bodies),
        _until(others.until, drive.until, bodies),
        _for_each(others.settle_drive, drive.settle, bodies),
        _for_each_at(others.show, drive.show, bodies),
        _for_each_at(others.pass_time, drive.advance, bodies),
        _for_each(others.take_back, drive.take_back, bodies),
        _for_each_at(others.advance, acting.advance, bodies),
    )


_IDLE = (*NOTHING_ACTS, *NO_DRIVE)  # kernels that do nothing: where a body has one of these, nothing is compiled


def _settling(others: Callable[..., None], acting: Acting, bodies: tuple[int, ...]) -> Callable[..., None]:
    @kernel
    def settle(b: Linked, states: Floats, models: Floats) -> None:
        others(b, states, models)
        for i in bodies:
            substep.settle(acting, states[_at(b, i) :], models[_model_at(b, i) :])

    return others if acting.settle in _IDLE else settle


def _loading(others: Callable[..., None], acting: Acting, bodies: tuple[int, ...]) -> Callable[..., None]:
    add_load = acting.add_load

    @kernel
    def load(b: Linked, models: Floats, work: Floats, z: int, y: int, to: int) -> None:
        others(b, models, work, z, y, to)
        for i in bodies:
            model, at, o = models[_model_at(b, i) :], y + _PLACE_SIZE * i, UNKNOWNS * i
            body, pulled = _read_motion(work, at + _MOTION), at + _LINKED
            given = added(held_load(model, _quat(work, at + Q)), Load(vec(work, pulled), vec(work, pulled + 3)))
            substep.write_slope(model, work, z + o, at, to + o, body.w, add_load(model, body, given))

    return load


def _kinks(others: Callable[..., bool], acting: Acting, bodies: tuple[int, ...]) -> Callable[..., bool]:
    one = acting.passes_kink

    @kernel
    def passes_kink(b: Linked, states: Floats, models: Floats, work: Floats, z: int) -> bool:
        kink = others(b, states, models, work, z)
        for i in bodies:
            kink = kink or one(models[_model_at(b, i) :], states[_at(b, i) :], work, z + UNKNOWNS * i)
        return kink

    return others if one in _IDLE else passes_kink


def _events(others: Callable[..., Passed], acting: Acting, bodies: tuple[int, ...]) -> Callable[..., Passed]:
    @kernel
    def passed(b: Linked, states: Floats, models: Floats, work: Floats, z: int, size: float) -> Passed:
        by, peak = others(b, states, models, work, z, size)
        for i in bodies:
            state, model = states[_at(b, i) :], models[_model_at(b, i) :]
            one = substep.passed(acting, state, model, work, z + UNKNOWNS * i, size)
            by, peak = max(by, one.by), min(peak, one.peak)
        return Passed(by, peak)

    return others if acting.passed in _IDLE else passed


def _until(others: Callable[..., float], one: Callable[..., float], bodies: tuple[int, ...]) -> Callable[..., float]:
    @kernel
    def until(b: Linked, models: Floats, passed: float, h: float) -> float:
        end = others(b, models, passed, h)
        for i in bodies:
            end = min(end, one(models[_model_at(b, i) :], passed, h))
        return end

    return others if one in _IDLE else until


def _for_each(others: Callable[..., None], one: Callable[..., None], bodies: tuple[int, ...]) -> Callable[..., None]:
    @kernel
    def for_each(b: Linked, models: Floats) -> None:
        others(b, models)
        for i in bodies:
            one(models[_model_at(b, i) :])

    return others if one in _IDLE else for_each


def _for_each_at(others: Callable[..., None], one: Callable[..., None], bodies: tuple[int, ...]) -> Callable[..., None]:
    @kernel
    def for_each(b: Linked, models: Floats, t: float) -> None:
        others(b, models, t)
        for i in bodies:
            one(models[_model_at(b, i) :], t)

    return others if one in _IDLE else for_each
