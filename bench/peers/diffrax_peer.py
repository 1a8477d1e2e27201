"""diffrax: Runge-Kutta pairs of order 5 and 8 with error control, compiled by JAX."""

from collections.abc import Callable

from rigid_body_sim.report.method import LIBRARY, RTOL, Method
from rigid_body_sim.report.problems import End, Problem

from .jax_peer import compiled, end_of, initial, slope, wrenches

MODULE, PACKAGE = "diffrax", "diffrax"
SOLVERS = ("Tsit5", "Dopri8")
RTOLS = tuple(10.0**-k for k in range(3, 14))


def methods() -> list[Method]:
    """The solvers that its documentation recommends for problems that are not stiff."""
    import diffrax
    import jax

    assert all(hasattr(diffrax, solver) for solver in SOLVERS)
    jax.config.update("jax_enable_x64", True)
    return [
        Method(
            f"diffrax {solver}",
            LIBRARY,
            knob=lambda problem: RTOL,
            values=lambda problem, quick: RTOLS[::3] if quick else RTOLS,
            start=lambda problem, value, solver=solver: _Run(solver, problem, value),
        )
        for solver in SOLVERS
    ]


class _Run:
    _ready: tuple[tuple[str, str], Callable, float] | None = None  # of the last solver and problem

    def __init__(self, solver: str, problem: Problem, rtol: float):
        self._arguments = initial(problem), wrenches(problem), rtol
        if _Run._ready is None or _Run._ready[0] != (solver, problem.name):
            _Run._ready = (solver, problem.name), *compiled(_solve(solver, problem), *self._arguments)
        _, self._call, self.compile_seconds = _Run._ready
        self._steps = 0

    def restart(self) -> None:
        """The start is an argument of the compiled function."""

    def advance(self) -> End:
        y, steps = self._call(*self._arguments)
        self._steps = int(steps)
        return end_of(y)

    def counts(self) -> dict[str, int | None]:
        return {"steps": self._steps, "rhs": None}


def _solve(solver: str, problem: Problem) -> Callable:
    """From one command to the next: the right-hand side jumps there."""
    import diffrax
    from jax import lax
    from jax import numpy as jnp

    f = slope(problem)
    term = diffrax.ODETerm(lambda t, y, wrench: jnp.stack(f(y, wrench)))
    method = getattr(diffrax, solver)()

    def run(y, held, rtol):
        def hold(y, wrench):
            control = diffrax.PIDController(rtol=rtol, atol=1e-3 * rtol)
            found = diffrax.diffeqsolve(
                term, method, 0.0, problem.hold, None, y, wrench, stepsize_controller=control, max_steps=2**20,
                saveat=diffrax.SaveAt(t1=True),
            )  # fmt: skip
            return found.ys[0], found.stats["num_steps"]

        y, steps = lax.scan(hold, y, held)
        return y, steps.sum()

    return run
