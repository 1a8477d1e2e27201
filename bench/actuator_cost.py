"""What actuators cost: a step of a quadrotor whose four rotors lag, beside the same under body wrenches.

A new command comes every so many steps, so that the rotors are always on their way to it; the wrench is that of rotors
which would be there at once. All take turns in one run. Times are the processor's, per step, of the calls that advance.
"""

import math
import statistics
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

from rigid_body_sim.command_line import takes_nothing
from rigid_body_sim.effects.actuators import Actuator
from rigid_body_sim.simulation import Simulation
from rigid_body_sim.values.body import Body
from rigid_body_sim.values.wrench import Wrench

BODY = Body(0.716, (0.0075236, 0.0075236, 0.0130404))
THRUST, MOMENT, ARM = 8.54858e-06, 0.016, 0.17  # N s², m of torque by thrust, m
LAG, INERTIA = 0.05, 6e-5  # s, kg m²
HOVER = math.sqrt(0.716 * 9.80665 / (4 * THRUST))  # rad/s
COMMANDS, ROUNDS = 200, 7
STEPS_PER_COMMAND = (1, 10, 50)


def rotors(lag: float) -> list[Actuator]:
    """Front, left, back and right."""
    places = ((ARM, 0.0, "cw"), (0.0, ARM, "ccw"), (-ARM, 0.0, "cw"), (0.0, -ARM, "ccw"))
    return [
        Actuator(
            str(k),
            "rotor",
            0.0,
            838.0,
            (x, y, 0.0),
            time_constant=lag,
            thrust_coefficient=THRUST,
            torque_coefficient=MOMENT * THRUST,
            direction=direction,
            inertia=INERTIA,
            initial=HOVER if lag else 0.0,
        )
        for k, (x, y, direction) in enumerate(places)
    ]


def wrench(speeds: Sequence[float]) -> Wrench:
    """What rotors do that turn at these speeds [rad/s]."""
    front, left, back, right = (THRUST * n * n for n in speeds)
    yaw = MOMENT * (front - left + back - right)
    return Wrench((0.0, 0.0, front + left + back + right), (ARM * (left - right), ARM * (back - front), yaw))


def cost(lag: float | None, every: int) -> float:
    """A step [ns] with rotors of that lag [s], or under wrenches for None."""
    simulation = Simulation(BODY, gravity=(0.0, 0.0, -9.80665), actuators=() if lag is None else rotors(lag))
    commands = HOVER + np.random.default_rng(1).uniform(-8.0, 8.0, (COMMANDS, 4))
    command: Callable[[Sequence[float]], None] = (
        simulation.set_actuators if lag is not None else lambda speeds: simulation.set_wrench(wrench(speeds))
    )
    passed = 0
    for speeds in commands.tolist():
        command(speeds)
        begin = time.process_time_ns()
        simulation.step(every)
        passed += time.process_time_ns() - begin
    return passed / COMMANDS / every


def main(args: Sequence[str] | None = None) -> int:
    """Print the table."""
    takes_nothing("actuator_cost", "Measures what a step costs with actuators.", args)
    kinds = {"body wrench": None, "four rotors": 0.0, f"four rotors, lag {LAG:g} s": LAG}
    for lag in kinds.values():
        cost(lag, 1)  # compiles
    print("\nA step of a quadrotor at 1 kHz, ns, and relative to that under a body wrench")
    for every in STEPS_PER_COMMAND:
        rounds = [{name: cost(lag, every) for name, lag in kinds.items()} for _ in range(ROUNDS)]
        measured = {name: statistics.median(one[name] for one in rounds) for name in kinds}
        for name, each in measured.items():
            ratio = statistics.median(one[name] / one["body wrench"] for one in rounds)
            print(f"  {every:3d} steps a command   {name:26s} {each:8.0f}   {ratio:6.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
