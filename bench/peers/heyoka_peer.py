"""heyoka: Taylor series that LLVM compiles for a problem and a tolerance; one body, and a batch of equal ones.

Wrenches are parameters, so that a new one compiles nothing. Where a velocity passes zero, at which no series goes
through quadratic drag, an event changes the sign.
"""

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from typing import Any, ClassVar

import numpy as np

from rigid_body_sim.report import batch
from rigid_body_sim.report.batch import Batch, BatchMethod
from rigid_body_sim.report.method import LIBRARY, RTOL, Method
from rigid_body_sim.report.problems import End, Problem

from .heyoka_equations import Equations

MODULE, PACKAGE = "heyoka", "heyoka"
RTOLS = (*(10.0**-k for k in range(5, 16)), 2.0**-52)  # the last is its default
BATCH = 8
BATCH_RTOLS = (RTOLS[-1], 1e-6, 1e-2)  # orders 20, 8 and 4: in steps of 1 ms short series are exact, too


def methods() -> list[Method]:
    """One body; the same with sums that LLVM may reorder, and with compensated ones; a batch."""
    import heyoka

    heyoka.llvm_state.set_diskcache_enabled(False)  # so that compile_seconds is what it says, on every run
    return [
        _method("heyoka", RTOLS),
        _method("heyoka fast_math", RTOLS, fast_math=True),
        _method("heyoka high_accuracy", RTOLS[-5:], high_accuracy=True),
        _method(f"heyoka, one of {BATCH} at once", RTOLS[1::2], BATCH),
    ]


def batch_methods() -> list[BatchMethod]:
    """Batches of eight bodies, shared by threads, at its default tolerance and with short series."""
    import heyoka

    heyoka.llvm_state.set_diskcache_enabled(False)
    return [
        BatchMethod(
            f"heyoka, batches of {BATCH}, rtol {rtol:.0e}", LIBRARY, lambda given, rtol=rtol: _Batches(given, rtol)
        )
        for rtol in BATCH_RTOLS
    ]


def _method(name: str, rtols: Sequence[float], bodies: int = 1, **options: bool) -> Method:
    return Method(
        name,
        LIBRARY,
        knob=lambda problem: RTOL,
        values=lambda problem, quick: rtols[3::4] if quick else rtols,
        start=lambda problem, value: Run(problem, value, bodies, **options),
        bodies=bodies,
    )


class Run:
    """A problem compiled for a tolerance, on which the order of the series depends."""

    def __init__(self, problem: Problem, rtol: float, bodies: int = 1, **options: bool):
        from heyoka import taylor_outcome

        self._hold, self.equations, self._batch = problem.hold, Equations(problem), bodies > 1
        begin = time.perf_counter()
        self.integrator = compiled(self.equations, bodies, tol=rtol, **options)
        self.compile_seconds = time.perf_counter() - begin
        # Of a batch, the bodies are the first axis of these.
        self.states, self.parameters = self.integrator.state.T, self.integrator.pars.T
        self._done, self._steps = taylor_outcome.time_limit, 0

    def restart(self) -> None:
        integrator, self._steps = self.integrator, 0
        self.states[:], self.parameters[:] = self.equations.start, self.equations.parameters[0]
        if self._batch:
            integrator.set_time(0.0)
        else:
            integrator.time = 0.0
        if integrator.with_events:
            integrator.reset_cooldowns()

    def advance(self) -> End:
        one_step, hold, done, parameters = self.integrator.step, self._hold, self._done, self.parameters
        for i, row in enumerate(self.equations.parameters):
            if i:
                parameters[:] = row
            # Where one step is enough, it costs half as much by itself.
            if self._batch or one_step(hold)[0] != done:
                self._go_on((i + 1) * hold)
        return self.equations.end((self.states[0] if self._batch else self.states).tolist())

    def _go_on(self, until: float) -> None:
        found = self.integrator.propagate_until(until)
        outcome, _, _, steps = (self.integrator.propagate_res[0] if self._batch else found)[:4]
        if outcome != self._done:
            raise ArithmeticError(f"it ended with {outcome}")
        self._steps += steps

    def counts(self) -> dict[str, int | None]:
        by_themselves = 0 if self._batch else len(self.equations.parameters)
        return {"steps": self._steps + by_themselves, "rhs": None}


def compiled(equations: Equations, bodies: int, **options: Any) -> Any:
    """The integrator of one body, or of a batch."""
    from heyoka import expression, t_event, t_event_batch, taylor_adaptive, taylor_adaptive_batch

    system = [(state, expression(0.0) + slope) for state, slope in equations.system]  # some slopes are plain numbers
    start, parameters = np.array(equations.start), equations.parameters[0]
    event, integrator = (t_event, taylor_adaptive) if bodies == 1 else (t_event_batch, taylor_adaptive_batch)
    if bodies > 1:
        start, parameters = (np.repeat(numbers[:, None], bodies, axis=1) for numbers in (start, parameters))
    events = [event(state, callback=_Sign(place)) for state, place in equations.signs]
    return integrator(system, start, pars=parameters, t_events=events, **options)


class _Batches:
    """Steps of at most batch.STEP inside its own loop, which gives up Python's lock: faster than a call for each.

    Each thread has a copy of the integrator and its share of the batches: what ``ensemble_propagate_until_batch`` does,
    but without another copy for each batch, which costs more than these steps. Fewer than eight are taken one by one.
    """

    _ready: ClassVar[dict[Any, Any]] = {}  # integrators, by what they depend on: those of other spins are the same

    def __init__(self, given: Batch, rtol: float):
        self._equations = Equations(given.problem)
        n, self._width = len(given), BATCH if len(given) >= BATCH else 1
        starts = np.tile(self._equations.start, (-(-n // self._width) * self._width, 1))
        starts[:n, :3] = given.spins
        self._starts = starts.reshape(-1, self._width, starts.shape[1]).transpose(0, 2, 1).copy()
        self._threads = min(batch.CORES, len(self._starts))
        key = given.problem.name, rtol, self._width
        if key not in self._ready:
            self._ready[key] = compiled(self._equations, self._width, tol=rtol)
        self._integrators = [deepcopy(self._ready[key]) for _ in range(self._threads)]
        self._pool = ThreadPoolExecutor(self._threads)
        self.restart()

    def restart(self) -> None:
        self._states = self._starts.copy()

    def advance(self, steps: int) -> None:
        until, longest = steps * batch.STEP, [batch.STEP] * self._width

        def go_on(thread):
            integrator = self._integrators[thread]
            for states in self._states[thread :: self._threads]:
                self._advance(integrator, states, until, longest)

        if self._threads == 1:
            go_on(0)
        else:
            list(self._pool.map(go_on, range(self._threads)))

    def _advance(self, integrator: Any, states: Any, until: float, longest: Sequence[float]) -> None:
        if self._width == 1:
            integrator.state[:], integrator.time = states[:, 0], 0.0
            integrator.propagate_until(until, max_delta_t=longest[0])
            states[:, 0] = integrator.state
        else:
            integrator.state[:] = states
            integrator.set_time(0.0)
            integrator.propagate_until(until, max_delta_t=longest)
            states[:] = integrator.state

    def ends(self, which: Sequence[int]) -> list[End]:
        return [self._equations.end(self._states[i // self._width, :, i % self._width].tolist()) for i in which]


class _Sign:
    """Callback of an event, which goes on: a velocity passes zero, and a parameter takes its sign."""

    def __init__(self, place: int):
        self._place = place

    def __call__(self, integrator: Any, sign: int, body: int | None = None) -> bool:
        integrator.pars[self._place if body is None else (self._place, body)] = sign
        return True
