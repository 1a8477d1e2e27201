"""Many bodies at once: the batch that methods of this package and of peers advance, and how they are measured.

The methods take turns, so that they see the same machine. What counts is wall-clock time, as threads share the work;
processor time is kept beside it, which other programs move less.
"""

import gc
import math
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from ..kernels.arrays import Floats
from ..simulation import Simulation
from ..values.state import State
from .busy import Busy
from .problems import End, Problem, errors, problem

CORES = os.cpu_count() or 1
STEP = 0.001  # s
STEPS = 100  # of each body in a call: a command held for 0.1 s
COMPARED = 8  # bodies whose ends are compared with references
LONG_STEP = 0.1  # s, of the reference; the series is as exact over it as over shorter ones
ROUNDS, QUICK_ROUNDS = 7, 3
LONG_ENOUGH = 0.02  # s: calls are added until those of one turn take this long together


@dataclass(frozen=True)
class Batch:
    """Equal bodies that start alike but for their spins [rad/s, body axes], shape (n, 3), and hold the same wrench."""

    problem: Problem
    spins: Floats

    def __len__(self) -> int:
        return len(self.spins)

    @cached_property
    def starts(self) -> Floats:
        """Position, orientation (w, x, y, z), velocity, spin of each as State has them, shape (n, 13)."""
        state = self.problem.initial
        same = np.concatenate((state.position, state.orientation, state.velocity))
        return np.hstack((np.broadcast_to(same, (len(self), 10)), self.spins))

    @property
    def compared(self) -> list[int]:
        """Bodies that stand for all: from the first to the last, at equal distances."""
        return np.unique(np.linspace(0, len(self) - 1, COMPARED).astype(int)).tolist()

    def error(self, which: Sequence[int], ends: Sequence[End], steps: int) -> float | None:
        """The largest error of these bodies after so many steps, as problems.errors has it; None if not finite."""
        found = [errors(self._problem_of(i, steps * STEP), end)["error"] for i, end in zip(which, ends, strict=True)]
        finite = [error for error in found if error is not None]
        return max(finite) if len(finite) == len(found) else None

    def _problem_of(self, i: int, duration: float) -> Problem:
        """The problem of a body alone. Its end is that of the series in other steps, next to round-off from true."""
        given, initial = self.problem, self.problem.initial
        start = State(initial.position, initial.orientation, initial.velocity, self.spins[i])
        count = math.ceil(duration / LONG_STEP)
        reference = Simulation(given.body, start, rate=count / duration, gravity=given.gravity, integrator="taylor")
        reference.set_wrench(given.wrenches[0])
        reference.step(count)
        names = ("position", "orientation", "velocity", "angular_velocity", "momentum", "angular_momentum")
        end: dict[str, Any] = {name: getattr(reference.state, name).tolist() for name in names}
        return replace(given, initial=start, digits=end)


def batch(n: int, spin: float, seed: int) -> Batch:
    """n bodies of the problem ``body_wrench``, whose spins about each axis are normal with that deviation [rad/s]."""
    held = replace(problem("body_wrench"), name="many_bodies", hold=STEP)
    return Batch(held, spin * np.random.default_rng(seed).normal(size=(n, 3)))


class BatchRun(Protocol):
    """A batch, ready to be advanced."""

    def restart(self) -> None:
        """Back to the start. This is not timed."""
        ...

    def advance(self, steps: int) -> None:
        """Go on by so many steps of STEP; when it returns, all bodies are there. This is timed."""
        ...

    def ends(self, which: Sequence[int]) -> list[End]:
        """Where these bodies are now."""
        ...


@dataclass(frozen=True)
class BatchMethod:
    """A way to advance many bodies.

    ``start``: a BatchRun. ``threads``: how many it may use. ``most``: steps of bodies that a call may have to do, fewer
    for what is slow; ``largest``: number of bodies, above which it is not tried.
    """

    name: str
    kind: str
    start: Callable[[Batch], BatchRun]
    threads: int = CORES
    most: int = 4 * 10**6
    largest: int = 10**9

    def steps(self, n: int, quick: bool) -> int:
        """Steps of each of n bodies in a call."""
        return max(1, min(STEPS, self.most // (10 * n if quick else n)))


def measure(methods: Iterable[BatchMethod], given: Batch, quick: bool) -> dict[str, Any]:
    """What each method takes for a call, as JSON: ``methods`` and ``refused`` by name, ``others`` (see busy.Busy).

    Of each: threads, steps of each body in a call, seconds of wall-clock and processor time of a call in each round,
    and ``error`` after the call.
    """
    runs: dict[str, _Timed] = {}
    refused: dict[str, str] = {}
    for method in methods:
        if len(given) <= method.largest:
            try:
                runs[method.name] = _Timed(method, given, quick)
            except Exception as reason:
                refused[method.name] = f"{type(reason).__name__}: {reason}"[:300]
    busy = Busy()
    for _ in range(QUICK_ROUNDS if quick else ROUNDS):
        for run in runs.values():
            run.take_turn()
    others = busy.others()
    return {"methods": {name: run.result() for name, run in runs.items()}, "refused": refused, "others": others}


class _Timed:
    """A method at work, and what it has taken so far."""

    def __init__(self, method: BatchMethod, given: Batch, quick: bool):
        self._method, self._steps = method, method.steps(len(given), quick)
        self._seconds: list[float] = []
        self._cpu: list[float] = []
        self._run = method.start(given)
        self._call()  # warms up, too
        self._error = given.error(given.compared, self._run.ends(given.compared), self._steps)
        if self._error is None:
            raise ArithmeticError("the states after a call are not finite")

    def _call(self) -> tuple[float, float]:
        """Wall-clock and processor time [s] of a call from the start."""
        self._run.restart()
        cpu, begin = time.process_time(), time.perf_counter()
        self._run.advance(self._steps)
        return time.perf_counter() - begin, time.process_time() - cpu

    def take_turn(self) -> None:
        calls: list[tuple[float, float]] = []
        gc.disable()
        try:
            while sum(wall for wall, _ in calls) < LONG_ENOUGH:
                calls.append(self._call())
        finally:
            gc.enable()
        wall, cpu = (sum(column) / len(calls) for column in zip(*calls, strict=True))
        self._seconds.append(wall)
        self._cpu.append(cpu)

    def result(self) -> dict[str, Any]:
        return {
            "kind": self._method.kind,
            "threads": self._method.threads,
            "steps": self._steps,
            "seconds": self._seconds,
            "cpu": self._cpu,
            "error": self._error,
        }


def errors_after(methods: Iterable[BatchMethod], given: Batch, steps: int) -> dict[str, Any]:
    """``errors`` of each method after so many steps, by name, and ``refused``, as JSON."""
    found: dict[str, float | None] = {}
    refused: dict[str, str] = {}
    for method in methods:
        try:
            run = method.start(given)
            run.restart()
            run.advance(steps)
            found[method.name] = given.error(given.compared, run.ends(given.compared), steps)
        except Exception as reason:
            refused[method.name] = f"{type(reason).__name__}: {reason}"[:300]
    return {"errors": found, "refused": refused}


def speed(result: Mapping[str, Any], n: int) -> float:
    """Steps of bodies in a second of wall-clock time: the median of the rounds."""
    return n * result["steps"] / float(np.median(result["seconds"]))


def times(result: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    """How many times as many steps as another one does in the same time: the median of what each round says."""
    ours, theirs = (np.array(one["seconds"]) / one["steps"] for one in (result, other))
    return float(np.median(theirs / ours))
