"""SciPy: solve_ivp with the right-hand side of this package, which numba compiles."""

from collections.abc import Callable
from functools import cache

import numpy as np

from rigid_body_sim.kernels import compiled
from rigid_body_sim.kernels import state as flat
from rigid_body_sim.kernels.arrays import Floats
from rigid_body_sim.kernels.motion import Acting, derivative
from rigid_body_sim.kernels.wrench import reduce_wrench
from rigid_body_sim.report.method import LIBRARY, RTOL, Method
from rigid_body_sim.report.problems import End, Problem
from rigid_body_sim.terms import Terms
from rigid_body_sim.values.state import flatten

MODULE, PACKAGE = "scipy", "scipy"
FINEST = {"DOP853": 13, "LSODA": 12, "Radau": 9}  # power of ten of the last rtol


def methods() -> list[Method]:
    """Its explicit method of order 8, its switching one and its implicit one."""
    import scipy.integrate

    assert scipy.integrate.solve_ivp
    return [
        Method(
            f"SciPy {name}",
            LIBRARY,
            knob=lambda problem: RTOL,
            values=lambda problem, quick, name=name: _values(name, problem, quick),
            start=lambda problem, value, name=name: _Run(name, problem, value),
        )
        for name in FINEST
    ]


def _values(name: str, problem: Problem, quick: bool) -> list[float]:
    """Tolerances as long as a run takes seconds: for 1000 rad Radau would take minutes."""
    finest = FINEST[name] - (4 if name == "Radau" and problem.name == "fast_spin" else 0)
    return [10.0**-k for k in (range(3, finest - 3, 3) if quick else range(3, finest + 1, 2))]


@cache
def derivative_of(acting: Acting) -> Callable[[Floats, Floats, Floats], None]:
    """The kernel ``derivative(model, y, slope)`` under loads."""

    def at_state(model: Floats, y: Floats, slope: Floats) -> None:
        derivative(acting, model, y, 0, slope, 0)

    return at_state


class _Run:
    def __init__(self, name: str, problem: Problem, rtol: float):
        from scipy.integrate import solve_ivp

        terms = Terms(problem.body, problem.gravity, drag=problem.drag)
        self._solve, self._name, self._rtol, self._hold = solve_ivp, name, rtol, problem.hold
        self._models = [terms.model(wrench) for wrench in problem.wrenches]
        for model in self._models:
            compiled.ready(reduce_wrench, model)(model)
        start = flatten(problem.initial, self._models[0])
        self._start, self._slope = start[: flat.LOW].copy(), np.zeros(flat.LOW)
        self._derivative = compiled.ready(derivative_of(terms.kernels), self._models[0], self._start, self._slope)
        self._read = compiled.ready(flat.read_motion, start, self._models[0])
        # Momenta are small or large numbers: the absolute tolerance follows the size of each part of the state.
        self._atol = 1e-3 * rtol * np.repeat([_size(self._start[i:j]) for i, j in _PARTS], [3, 4, 3, 3])
        self._steps = self._rhs = 0

    def restart(self) -> None:
        self._steps = self._rhs = 0

    @np.errstate(over="ignore")  # Radau's numerical Jacobian tries ever larger steps where nothing changes
    def advance(self) -> End:
        y = self._start
        for model in self._models:
            found = self._solve(
                lambda t, y, model=model: self._f(model, y), (0.0, self._hold), y, self._name, (self._hold,),
                rtol=self._rtol, atol=self._atol,
            )  # fmt: skip
            if not found.success:
                raise RuntimeError(found.message)
            y = found.y[:, -1]
            self._rhs += found.nfev
        motion = self._read(np.concatenate((y, np.zeros(flat.LOW))), self._models[0])
        return End(motion[0:3], motion[3:7], motion[7:10], motion[16:19])

    def _f(self, model, y):
        # Radau hands over columns of a matrix, and compiled code expects one number beside the other.
        self._derivative(model, np.ascontiguousarray(y), self._slope)
        return self._slope.copy()

    def counts(self) -> dict[str, int | None]:
        return {"steps": None, "rhs": self._rhs}


_PARTS = ((0, 3), (3, 7), (7, 10), (10, 13))


def _size(part):
    return float(np.linalg.norm(part)) or 1.0
