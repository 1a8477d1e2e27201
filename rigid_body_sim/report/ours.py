"""The integrators of this package, and ``auto``, as methods to be compared; its ways to advance many bodies."""

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np

from .. import integrators
from ..ensemble import Ensemble
from ..simulation import Simulation
from ..terms import DEFAULT_RTOL, Terms
from ..values.state import State
from . import batch
from .batch import Batch, BatchMethod
from .method import OURS, RTOL, STEP, Method, step_sizes, steps_held
from .problems import End, Problem

STEP_COST = 1e-7  # s, about
FINEST_RTOL, LOW_ORDER_RTOL = 13, 9  # powers of ten; at order 4 the last one would take minutes
LONG_WAY = 500.0  # rad, beyond which a method of order 4 stops two powers earlier
RHS_PER_STEP = {"rk4": 4, "rkmk4": 4, "semi_implicit_euler": 1, "matrix_euler": 1}
LONG_TURN = 1.0  # rad in a step of a method that divides its steps itself
ENSEMBLE, ALONE, LOOP = "Ensemble", "Ensemble, 1 thread", "Simulation, one by one"
MANY_SIMULATIONS = 1000  # with more of them, each takes what it takes with these


def method(name: str) -> Method:
    """The method of an integrator of the registry, or of ``auto``."""
    return Method(
        name,
        OURS,
        knob=lambda problem: RTOL if _is_adaptive(name, problem) else STEP,
        values=lambda problem, quick: _values(name, problem, quick),
        start=lambda problem, value: _Run(name, problem, value),
        refusal=lambda problem: _refusal(name, problem),
    )


def _is_adaptive(name: str, problem: Problem) -> bool:
    return problem.dragged if name == integrators.AUTO else integrators.get(name).adaptive


def _refusal(name: str, problem: Problem) -> str:
    if name == integrators.AUTO:
        return ""
    refusals = (integrators.get(name).refusal(wrench) for wrench in problem.wrenches)
    return integrators.shortfall(name, Terms(problem.body, drag=problem.drag)) or next(filter(None, refusals), "")


def _values(name: str, problem: Problem, quick: bool) -> Iterable[float]:
    if _is_adaptive(name, problem):
        return [10.0**-k for k in range(3, _finest_rtol(name, problem, quick) + 1, 2 if quick else 1)]
    if name == integrators.AUTO or integrators.get(name).order is None:
        return [problem.hold, *(h for h in (0.1, 0.01, 0.001) if h < problem.hold)][: 2 if quick else 4]
    return step_sizes(problem, STEP_COST, quick, 2 if quick else 1)


def _finest_rtol(name: str, problem: Problem, quick: bool) -> int:
    if name != "rosenbrock" or problem.dragged:
        return FINEST_RTOL - 2 * quick
    return LOW_ORDER_RTOL - 2 * (problem.fastest_rate * problem.duration > LONG_WAY) - 4 * quick


def _long_step(problem: Problem) -> float:
    """The longest even share of the time a command is held in which the body turns by LONG_TURN at most."""
    parts = 1
    while problem.hold * problem.fastest_rate > LONG_TURN * parts:
        parts *= 2
    return problem.hold / parts


class _Run:
    def __init__(self, name: str, problem: Problem, value: float):
        adaptive = _is_adaptive(name, problem)
        h = _long_step(problem) if adaptive else value
        self._problem, self._each = problem, steps_held(problem, h)
        self._rhs = RHS_PER_STEP.get(name)
        self._simulation = Simulation(
            problem.body,
            problem.initial,
            rate=1.0 / h,
            gravity=problem.gravity,
            integrator=name,
            drag=problem.drag,
            rtol=value if adaptive else DEFAULT_RTOL,
        )

    def restart(self) -> None:
        self._simulation.reset()
        self._simulation.set_wrench(self._problem.wrenches[0])

    def advance(self) -> End:
        simulation, each = self._simulation, self._each
        simulation.step(each)
        for wrench in self._problem.wrenches[1:]:
            simulation.set_wrench(wrench)
            simulation.step(each)
        motion = simulation.motion
        return End(motion[0:3], motion[3:7], motion[7:10], motion[16:19])

    def counts(self) -> dict[str, int | None]:
        steps = self._simulation.steps
        return {"steps": steps, "rhs": self._rhs and self._rhs * steps}


# Many bodies ----------------------------------------------------------------------------------------------------------


def batch_methods() -> list[BatchMethod]:
    """An Ensemble with a thread for each core and with one, and a Simulation for each body."""
    return [
        BatchMethod(ENSEMBLE, OURS, partial(_Together, threads=batch.CORES)),
        BatchMethod(ALONE, OURS, partial(_Together, threads=1), threads=1),
        BatchMethod(LOOP, OURS, _OneByOne, threads=1, largest=MANY_SIMULATIONS),
    ]


class _Together:
    def __init__(self, given: Batch, threads: int):
        problem = given.problem
        x, q, v, w = np.split(given.starts, (3, 7, 10), axis=1)
        self._wrench = problem.wrenches[0]
        self._ensemble = Ensemble(
            problem.body.mass,
            problem.body.principal_moments,
            n=len(given),
            position=x,
            orientation=q,
            velocity=v,
            angular_velocity=w,
            rate=1.0 / batch.STEP,
            gravity=problem.gravity,
            threads=threads,
        )

    def restart(self) -> None:
        self._ensemble.reset()
        self._ensemble.set_wrench(self._wrench)

    def advance(self, steps: int) -> None:
        self._ensemble.step(steps)

    def ends(self, which: Sequence[int]) -> list[End]:
        found = self._ensemble.state
        return [
            End(found.position[i], found.orientation[i], found.velocity[i], found.angular_velocity[i]) for i in which
        ]


class _OneByOne:
    def __init__(self, given: Batch):
        problem, self._wrench = given.problem, given.problem.wrenches[0]
        starts = [State(*np.split(start, (3, 7, 10))) for start in given.starts]
        make = partial(Simulation, problem.body, rate=1.0 / batch.STEP, gravity=problem.gravity)
        self._simulations = [make(start) for start in starts]

    def restart(self) -> None:
        for simulation in self._simulations:
            simulation.reset()
            simulation.set_wrench(self._wrench)

    def advance(self, steps: int) -> None:
        for simulation in self._simulations:
            simulation.step(steps)

    def ends(self, which: Sequence[int]) -> list[End]:
        states = [self._simulations[i].state for i in which]
        return [End(one.position, one.orientation, one.velocity, one.angular_velocity) for one in states]
