"""Basilisk: a spacecraft hub with its external-force module, evaluated at every stage of its integrators."""

import math
from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from rigid_body_sim.report.method import SIMULATOR, STEP, Method, step_sizes
from rigid_body_sim.report.problems import End, Problem
from rigid_body_sim.values.rotation import normalize

MODULE, PACKAGE = "Basilisk", "bsk"
STEP_COST = {"RK4": 1.5e-5, "RKF78": 5e-5}  # s, about
STAGES = {"RK4": 4, "RKF78": 13}
NANOSECONDS = 10**9  # it counts time in whole ones


def methods() -> list[Method]:
    """Its Runge-Kutta methods of order 4 and 7(8), the latter at fixed steps."""
    from Basilisk.simulation import svIntegrators

    assert svIntegrators.svIntegratorRKF78
    return [
        Method(
            f"Basilisk {name}",
            SIMULATOR,
            knob=lambda problem: STEP,
            values=lambda problem, quick, cost=cost: _values(problem, cost, quick),
            start=lambda problem, value, name=name: _Run(name, problem, value),
            refusal=_refusal,
        )
        for name, cost in STEP_COST.items()
    ]


def _refusal(problem: Problem) -> str:
    if problem.dragged:
        return "it has no linear and quadratic drag in body axes"
    if problem.wrenches[0].points:
        return "it has no force in world axes at a body-fixed point whose torque follows the attitude"
    return ""


def _values(problem: Problem, cost: float, quick: bool) -> Iterable[float]:
    """Steps of a whole number of nanoseconds that divide the time for which a command is held."""
    hold = round(problem.hold * NANOSECONDS)
    divisors = sorted(2**a * 5**b for a in range(12) for b in range(12) if hold % (2**a * 5**b) == 0)
    for h in step_sizes(problem, cost, quick, 2 if quick else 1):
        steps = min(divisors, key=lambda divisor: abs(math.log(divisor * h / problem.hold)))
        yield float(Fraction(hold // steps, NANOSECONDS))


class _Run:
    def __init__(self, name: str, problem: Problem, h: float):
        self._name, self._problem, self._h = name, problem, h
        self._hold = round(problem.hold * NANOSECONDS)

    def restart(self) -> None:
        """A fresh simulation: it has no way back to the start."""
        from Basilisk.simulation import extForceTorque, spacecraft, svIntegrators
        from Basilisk.utilities import SimulationBaseClass

        self._simulation = SimulationBaseClass.SimBaseClass()
        process = self._simulation.CreateNewProcess("process")
        process.addTask(self._simulation.CreateNewTask("task", round(self._h * NANOSECONDS)))
        self._craft, self._load = spacecraft.Spacecraft(), extForceTorque.ExtForceTorque()
        self._set_up(self._craft)
        self._craft.addDynamicEffector(self._load)
        self._integrator = getattr(svIntegrators, f"svIntegrator{self._name}")(self._craft)
        self._craft.setIntegrator(self._integrator)
        self._simulation.AddModelToTask("task", self._load, 2)
        self._simulation.AddModelToTask("task", self._craft, 1)
        self._give(self._problem.wrenches[0])
        self._simulation.InitializeSimulation()

    def _set_up(self, craft) -> None:
        body, state = self._problem.body, self._problem.initial
        hub = craft.hub
        hub.mHub, hub.IHubPntBc_B = body.mass, np.diag(body.principal_moments).tolist()
        hub.r_BcB_B = _column((0.0, 0.0, 0.0))
        hub.r_CN_NInit, hub.v_CN_NInit = _column(state.position), _column(state.velocity)
        w, *vector = state.orientation.tolist()
        hub.sigma_BNInit = _column([component / (1.0 + w) for component in vector])
        hub.omega_BN_BInit = _column(state.angular_velocity)

    def _give(self, wrench) -> None:
        load, weight = self._load, self._problem.body.mass * np.array(self._problem.gravity)
        load.extForce_B, load.extTorquePntB_B = _column(wrench.values[:3]), _column(wrench.values[3:6])
        load.extForce_N = _column(weight + wrench.force_world)

    def advance(self) -> End:
        for i, wrench in enumerate(self._problem.wrenches):
            if i:
                self._give(wrench)
            self._simulation.ConfigureStopTime((i + 1) * self._hold)
            self._simulation.ExecuteSimulation()
        state = self._craft.scStateOutMsg.read()
        sigma = np.array(state.sigma_BN)
        size = sigma @ sigma
        q = normalize((1.0 - size, *(2.0 * sigma)))  # from modified Rodrigues parameters
        return End(state.r_CN_N, q, state.v_CN_N, state.omega_BN_B)

    def counts(self) -> dict[str, int | None]:
        steps = round(self._problem.duration / self._h)
        return {"steps": steps, "rhs": STAGES[self._name] * steps}


def _column(values) -> list[list[float]]:
    return [[float(value)] for value in values]
