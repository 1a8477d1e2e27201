"""JAX: classical Runge-Kutta in double precision, the whole run in one compiled loop; of one body, and of many."""

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, ClassVar

import numpy as np

from rigid_body_sim.report import batch
from rigid_body_sim.report.batch import Batch, BatchMethod
from rigid_body_sim.report.method import LIBRARY, STEP, Method, step_sizes, steps_held
from rigid_body_sim.report.problems import End, Problem

MODULE, PACKAGE = "jax", "jax"
STEP_COST = 5e-7  # s, about
WIDE = {"xla_cpu_prefer_vector_width": 512}  # bits; with the 256 of its default a step takes half as long again
WORTH_A_THREAD = 256  # bodies; two threads with 100 each are no faster than one with 200


def methods() -> list[Method]:
    """Runge-Kutta of order 4."""
    import jax

    jax.config.update("jax_enable_x64", True)
    return [
        Method(
            "JAX RK4",
            LIBRARY,
            knob=lambda problem: STEP,
            values=lambda problem, quick: step_sizes(problem, STEP_COST, quick, 2 if quick else 1),
            start=_Run,
        )
    ]


def batch_methods() -> list[BatchMethod]:
    """The same for many bodies by ``vmap``: as one would write it, and as fast as it was brought to be."""
    import jax

    jax.config.update("jax_enable_x64", True)
    return [BatchMethod("JAX RK4, vmap", LIBRARY, _plain), BatchMethod("JAX RK4, tuned", LIBRARY, _tuned)]


def initial(problem: Problem) -> Any:
    """(x, q, v, ω in body axes), 13 numbers."""
    import jax.numpy as jnp

    state = problem.initial
    return jnp.array(np.concatenate((state.position, state.orientation, state.velocity, state.angular_velocity)))


def wrenches(problem: Problem) -> Any:
    """The twelve numbers of each wrench in turn."""
    import jax.numpy as jnp

    return jnp.array([wrench.values for wrench in problem.wrenches], float)


def slope(problem: Problem) -> Callable[[Any, Any], Any]:
    """dY/dt of that state under a wrench of twelve numbers: Newton and Euler, in scalars, which XLA fuses best."""
    import jax.numpy as jnp

    m, moments = problem.body.mass, problem.body.principal_moments.tolist()
    points = [(point, force) for point, force in problem.wrenches[0].points]
    linear, quadratic, angular, angular_quadratic = np.reshape(problem.drag.values, (4, 3)).tolist()

    def cross(a, b):
        return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]

    def turn(s, u, a):
        t = [2 * x for x in cross(u, a)]
        return [a[i] + s * t[i] + cross(u, t)[i] for i in range(3)]

    def f(y, held):
        q, v, w = [y[i] for i in range(3, 7)], [y[i] for i in range(7, 10)], [y[i] for i in range(10, 13)]
        unit = 1 / jnp.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        s, u = unit * q[0], [unit * q[i] for i in (1, 2, 3)]
        back = [-a for a in u]
        force, torque = [held[i] for i in range(3)], [held[i] for i in range(3, 6)]
        world = [held[i] for i in range(6, 9)]
        for point, there in points:
            torque = [a + b for a, b in zip(torque, cross(point, turn(s, back, there)), strict=True)]
            world = [a + b for a, b in zip(world, there, strict=True)]
        if problem.dragged:
            along = turn(s, back, v)
            force = [f - (linear[i] + quadratic[i] * abs(along[i])) * along[i] for i, f in enumerate(force)]
            torque = [t - (angular[i] + angular_quadratic[i] * abs(w[i])) * w[i] for i, t in enumerate(torque)]
        turned = turn(s, u, force)
        a = [(turned[i] + world[i]) / m + problem.gravity[i] for i in range(3)]
        spin = cross([i * x for i, x in zip(moments, w, strict=True)], w)
        dw = [(spin[i] + torque[i]) / moments[i] for i in range(3)]
        c = cross(q[1:], w)
        dq = [-(q[1] * w[0] + q[2] * w[1] + q[3] * w[2]) / 2, *((q[0] * w[i] + c[i]) / 2 for i in range(3))]
        return (*v, *dq, *a, *dw)

    return f


def compiled(function: Callable, *examples: Any, options: Mapping[str, Any] | None = None) -> tuple[Callable, float]:
    """``function`` compiled ahead for arguments like the examples, and the time [s] that took."""
    import jax

    begin = time.perf_counter()
    ready = jax.jit(function).lower(*examples).compile(options)
    return ready, time.perf_counter() - begin


def end_of(y: Any) -> End:
    """The end state as floats."""
    numbers = np.asarray(y).tolist()
    return End(numbers[0:3], numbers[3:7], numbers[7:10], numbers[10:13])


class _Run:
    _ready: tuple[str, Callable, float] | None = None  # of the last problem: the step is an argument of it

    def __init__(self, problem: Problem, h: float):
        self._y, self._held = initial(problem), wrenches(problem)
        self._each, self._steps = steps_held(problem, h), round(problem.duration / h)
        if _Run._ready is None or _Run._ready[0] != problem.name:
            _Run._ready = problem.name, *compiled(_loop(slope(problem)), self._y, self._held, h, self._each)
        _, self._call, self.compile_seconds = _Run._ready
        self._h = h

    def restart(self) -> None:
        """The start is an argument of the compiled function."""

    def advance(self) -> End:
        return end_of(self._call(self._y, self._held, self._h, self._each))

    def counts(self) -> dict[str, int | None]:
        return {"steps": self._steps, "rhs": 4 * self._steps}


def _loop(f: Callable) -> Callable:
    from jax import lax
    from jax import numpy as jnp

    step = _runge_kutta(f)

    def run(y, held, h, each):
        def hold(y, wrench):
            return lax.fori_loop(0, each, lambda _, y: step(y, wrench, h), y), None

        return jnp.stack(lax.scan(hold, tuple(y), held)[0])

    return run


def _runge_kutta(f: Callable) -> Callable:
    def moved(y, k, h):
        return tuple(a + h * b for a, b in zip(y, k, strict=True))

    def step(y, wrench, h):
        k1 = f(y, wrench)
        k2 = f(moved(y, k1, h / 2), wrench)
        k3 = f(moved(y, k2, h / 2), wrench)
        k4 = f(moved(y, k3, h), wrench)
        return tuple(y[i] + h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]) for i in range(13))

    return step


# Many bodies ----------------------------------------------------------------------------------------------------------


def _plain(given: Batch) -> "_BatchRun":
    """An array with a row for each body, as users have it."""
    return _BatchRun(given, slope, 0, 1, None)


def _tuned(given: Batch) -> "_BatchRun":
    """Each number of all bodies side by side in memory, wide registers, and a thread for each core."""
    return _BatchRun(given, lean_slope, 1, batch.CORES if len(given) >= WORTH_A_THREAD * batch.CORES else 1, WIDE)


class _BatchRun:
    """A loop compiled for a number of bodies. ``axis``: that of the bodies; ``parts``: among how many threads."""

    _ready: ClassVar[dict[Any, Callable]] = {}  # by what they depend on: those of other spins are the same

    def __init__(self, given: Batch, make: Callable[[Problem], Callable], axis: int, parts: int, options: Any):
        import jax.numpy as jnp

        self._axis, self._held = axis, wrenches(given.problem)[0]
        starts = given.starts.T if axis else given.starts
        self._starts = [jnp.array(part) for part in np.array_split(starts, parts, axis)]
        self._calls = [self._call(given.problem, make, part, options) for part in self._starts]
        self._pool = ThreadPoolExecutor(parts)
        self.restart()

    def _call(self, problem: Problem, make: Callable[[Problem], Callable], y: Any, options: Any) -> Callable:
        import jax

        key = problem.name, make, y.shape
        if key not in self._ready:
            every = jax.vmap(_steps(make(problem)), (self._axis, None, None), self._axis)
            self._ready[key], _ = compiled(every, y, self._held, batch.STEPS, options=options)
        return self._ready[key]

    def restart(self) -> None:
        self._y = self._starts

    def advance(self, steps: int) -> None:
        def go_on(call, y):
            return call(y, self._held, steps).block_until_ready()

        if len(self._y) == 1:
            self._y = [go_on(self._calls[0], self._y[0])]
        else:
            self._y = list(self._pool.map(go_on, self._calls, self._y))

    def ends(self, which: Sequence[int]) -> list[End]:
        y = np.concatenate([np.asarray(part) for part in self._y], self._axis)
        return [end_of(y.take(i, self._axis)) for i in which]


def _steps(f: Callable) -> Callable:
    """Steps of one body."""
    from jax import lax
    from jax import numpy as jnp

    step = _runge_kutta(f)

    def run(y, held, steps):
        return jnp.stack(lax.fori_loop(0, steps, lambda _, y: step(y, held, batch.STEP), tuple(y)))

    return run


def lean_slope(problem: Problem) -> Callable[[Any, Any], Any]:
    """As ``slope``, for a wrench in body axes alone, in few operations; the quaternion is taken for a unit."""
    m, (a, b, c) = problem.body.mass, problem.body.principal_moments.tolist()
    ratios = (b - c) / a, (c - a) / b, (a - b) / c

    def f(y, held):
        (s, x, y_, z), v, (p, q, r) = y[3:7], y[7:10], y[10:13]
        fx, fy, fz = (held[i] / m for i in range(3))
        tx, ty, tz = 2 * (y_ * fz - z * fy), 2 * (z * fx - x * fz), 2 * (x * fy - y_ * fx)
        turned = fx + s * tx + y_ * tz - z * ty, fy + s * ty + z * tx - x * tz, fz + s * tz + x * ty - y_ * tx
        i, j, k = p / 2, q / 2, r / 2
        dq = (
            -(x * i + y_ * j + z * k),
            s * i + y_ * k - z * j,
            s * j + z * i - x * k,
            s * k + x * j - y_ * i,
        )
        dw = (
            ratios[0] * q * r + held[3] / a,
            ratios[1] * r * p + held[4] / b,
            ratios[2] * p * q + held[5] / c,
        )
        return (*v, *dq, *turned, *dw)

    return f
