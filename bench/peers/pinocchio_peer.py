"""Pinocchio: its forward dynamics (aba) and integration on the manifold, in a loop in Python as its users write it."""

import numpy as np

from rigid_body_sim.report.method import SIMULATOR, STEP, Method, step_sizes, steps_held
from rigid_body_sim.report.problems import End, Problem

MODULE, PACKAGE = "pinocchio", "pin"
STEP_COST = {"Euler": 4e-6, "RK4": 3e-5}  # s, about


def methods() -> list[Method]:
    """Semi-implicit Euler as in its examples, and Runge-Kutta of order 4 on increments of the configuration."""
    import pinocchio

    assert pinocchio.aba
    return [
        Method(
            f"Pinocchio {name}",
            SIMULATOR,
            knob=lambda problem: STEP,
            values=lambda problem, quick, cost=cost: step_sizes(problem, cost, quick, 2 if quick else 1),
            start=lambda problem, value, name=name: _Run(name, problem, value),
        )
        for name, cost in STEP_COST.items()
    ]


class _Run:
    def __init__(self, name: str, problem: Problem, h: float):
        import pinocchio

        self._pin, self._problem, self._h, self._each = pinocchio, problem, h, steps_held(problem, h)
        self._model = pinocchio.Model()
        self._model.gravity.linear = np.array(problem.gravity)
        self._model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "body")
        inertia = pinocchio.Inertia(problem.body.mass, np.zeros(3), np.diag(problem.body.principal_moments))
        self._model.appendBodyToJoint(1, inertia, pinocchio.SE3.Identity())
        self._data = self._model.createData()
        self._step, self._stages = (self._rk4, 4) if name == "RK4" else (self._euler, 1)
        state = problem.initial
        w, x, y, z = state.orientation
        self._q = np.array((*state.position, x, y, z, w))
        along = pinocchio.Quaternion(w, x, y, z).matrix().T @ state.velocity
        self._v = np.concatenate((along, state.angular_velocity))

    def restart(self) -> None:
        """The start is kept apart from what moves."""

    @np.errstate(over="ignore", invalid="ignore")
    def advance(self) -> End:
        q, v, step, each = self._q, self._v, self._step, self._each
        for wrench in self._problem.wrenches:
            load = self._load(wrench)
            for _ in range(each):
                q, v = step(q, v, load)
        x, y, z, w = q[3:].tolist()
        velocity = self._pin.Quaternion(w, x, y, z).matrix() @ v[:3]
        return End(q[:3], (w, x, y, z), velocity, v[3:])

    def counts(self) -> dict[str, int | None]:
        steps = self._each * len(self._problem.wrenches)
        return {"steps": steps, "rhs": self._stages * steps}

    def _load(self, wrench):
        """Generalised force of a wrench as a function of (q, v): body axes, and constant where it can be."""
        drag = np.reshape(self._problem.drag.values, (2, 2, 3))
        linear, quadratic = np.concatenate((drag[0, 0], drag[1, 0])), np.concatenate((drag[0, 1], drag[1, 1]))
        constant = np.array(wrench.values[:6])
        if not (wrench.points or any(wrench.values[6:]) or self._problem.dragged):
            return lambda q, v: constant

        def load(q, v):
            x, y, z, w = q[3:].tolist()
            found = np.array(wrench.about_origin((w, x, y, z), (0.0, 0.0, 0.0)))
            return found - (linear + quadratic * abs(v)) * v if self._problem.dragged else found

        return load

    def _euler(self, q, v, load):
        v = v + self._h * self._pin.aba(self._model, self._data, q, v, load(q, v))
        return self._pin.integrate(self._model, q, self._h * v), v

    def _rk4(self, q, v, load):
        """The configuration moves by d, with d' = v + ½ [v, d] + ⅟₁₂ [d, [d, v]], theory of Munthe-Kaas."""
        pin, h, model, data = self._pin, self._h, self._model, self._data

        def slope(d, u):
            p = pin.integrate(model, q, d)
            return _inverse_dexp(d, u), pin.aba(model, data, p, u, load(p, u))

        zero = np.zeros(6)
        d1, a1 = slope(zero, v)
        d2, a2 = slope(h / 2 * d1, v + h / 2 * a1)
        d3, a3 = slope(h / 2 * d2, v + h / 2 * a2)
        d4, a4 = slope(h * d3, v + h * a3)
        d = h / 6 * (d1 + 2 * (d2 + d3) + d4)
        return pin.integrate(model, q, d), v + h / 6 * (a1 + 2 * (a2 + a3) + a4)


def _inverse_dexp(d, u):
    once = _bracket(d, u)
    return u + once / 2 + _bracket(d, once) / 12


def _bracket(a, b):
    """Lie bracket of two motions (linear, angular)."""
    return np.concatenate((_cross(a[3:], b[:3]) + _cross(a[:3], b[3:]), _cross(a[3:], b[3:])))


def _cross(a, b):
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))
