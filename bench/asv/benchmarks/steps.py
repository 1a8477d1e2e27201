"""What a step costs by five plans, and how far off a problem with a reference of 35 digits ends."""

import math
import time
from typing import Any

from rigid_body_sim import Body, Drag, Simulation, State, Tether, Wrench

STEPS = 1000  # of 1 ms, so that asv's µs are ns a step
MASS, WEIGHT = 2.0, (0.0, 0.0, -2.0 * 9.80665)
BODY = Body(MASS, (0.1, 0.2, 0.25))
TOP = Body(MASS, (0.2, 0.2, 0.1))
TURNING = State(angular_velocity=(1.0, 1.0, 0.5))
SPINNING = State(orientation=(0.9, 0.3, 0.0, 0.0), angular_velocity=(0.0, 1.0, 40.0))
STIFF = Tether(anchor=(0.0, 0.0, 1.0), rest_length=1.0, stiffness=1e8, damping=1e6)

# By name: body, state, held wrench, other arguments of Simulation, and the integrator that the plan takes.
PLANS: dict[str, tuple[Body, State, Wrench, dict[str, Any], str]] = {
    "torque-free": (BODY, TURNING, Wrench(), {}, "exact"),
    "held body wrench": (BODY, TURNING, Wrench((1.0, 2.0, 3.0), (1e-3, 2e-3, 1e-3)), {}, "taylor"),
    "heavy top": (TOP, SPINNING, Wrench(points=[((0.0, 0.0, 0.1), WEIGHT)]), {}, "taylor"),
    "drag, not stiff": (BODY, TURNING, Wrench(), {"drag": Drag((1.0,) * 3, (1.0,) * 3, (0.01,) * 3)}, "dop853"),
    "tether, stiff": (BODY, TURNING, Wrench(), {"tethers": [STIFF], "gravity": (0.0, 0.0, -9.80665)}, "rosenbrock"),
}


class Step:
    """1000 steps from the same state, in one call and with a call each: µs here are ns a step.

    But for the torque-free body in one call: there they are one evaluation, whatever their number.
    """

    params = (list(PLANS),)
    param_names = ("plan",)
    number = 1  # each sample from the same state
    repeat = (10, 200, 5.0)
    timer = time.process_time  # what other programs do meanwhile does not count

    def setup(self, plan: str) -> None:
        body, state, wrench, options, integrator = PLANS[plan]
        self.simulation = Simulation(body, state, **options)
        self.simulation.set_wrench(wrench)
        if self.simulation.plan.integrator != integrator:
            raise AssertionError(f"the plan of {plan!r} takes {self.simulation.plan.integrator}, not {integrator}")
        start = self.simulation.save()
        self.simulation.step(STEPS)  # compiled, and in the processor's caches
        self.simulation.restore(start)

    def time_1000_steps(self, plan: str) -> None:
        self.simulation.step(STEPS)

    def time_1000_calls(self, plan: str) -> None:
        step = self.simulation.step
        for _ in range(STEPS):
            step()


# Heavy top with three different moments at 20 rad/s: its attitude after 10 s, by the report's reference.
ASYMMETRIC = Body(0.5, (0.0018, 0.0024, 0.003))
THROWN = State((0.0, 0.0, 0.0), (0.9, 0.3, 0.1, -0.3), (0.1, 0.0, 0.2), (2.0, -1.0, 20.0))
WEIGHT_AT_A_POINT = Wrench(points=[((0.003, -0.002, 0.02), (0.0, 0.0, -4.905))])
TRUE = (0.0096913564880753471, -0.33553733395796011, 0.32653682206090054, 0.88356917044913533)


class Error:
    """How far the attitude ends from the true one: grows when something is no longer exact."""

    unit = "rad"

    def track_attitude(self) -> float:
        """Angle [rad] between that attitude and ours, in steps of 0.1 s."""
        simulation = Simulation(ASYMMETRIC, THROWN, rate=10.0)
        simulation.set_wrench(WEIGHT_AT_A_POINT)
        simulation.step(100)
        w, x, y, z = simulation.state.orientation
        a, b, c, d = TRUE
        turn = (
            w * b - x * a - y * d + z * c,
            w * c + x * d - y * a - z * b,
            w * d - x * c + y * b - z * a,
        )
        return 2.0 * math.asin(min(1.0, math.hypot(*turn)))
