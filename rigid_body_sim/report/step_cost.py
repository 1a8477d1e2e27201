"""What a step costs: the kernels alone, and a command, a step and a pose read back from Python.

All figures of one line come from one run in which the candidates take turns, so that they see the same machine. A
figure is the median over rounds; times on a shared machine drift, the ratios do not.
"""

import platform
import statistics
import sys
import time
from collections.abc import Callable

from .. import integrators
from ..physics import compiled
from ..physics.body import Body
from ..physics.state import State
from ..physics.wrench import Wrench
from ..simulation import Simulation

ROUNDS = 60
STEPS = 2000
TURN = 0.01  # h |ω| [rad]: how far the body turns in a step
SPIN = (1.0, 1.0, 0.5)  # rad/s
SMALL = 1e-4  # so that 2000 steps do not change the spin

_FORCE, _TORQUE = (1.0, 2.0, 3.0), (SMALL, 2 * SMALL, SMALL)
WRENCHES = {
    "no wrench": Wrench(),
    "torque, body axes": Wrench(torque_body=_TORQUE),
    "torque, world axes": Wrench(torque_world=_TORQUE),
    "force, body axes": Wrench(force_body=_FORCE),
    "world force at a point": Wrench(points=[((0.0, 0.0, SMALL), (0.0, 0.0, -1.0))]),
    "two of them, not parallel": Wrench(
        points=[((0.0, 0.0, SMALL), (0.0, 0.0, -1.0)), ((0.0, SMALL, 0.0), (0.0, 1.0, -1.0))]
    ),
}


def seconds(work: Callable[[], object]) -> float:
    """Time [s] that ``work`` takes."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def kernel_costs(wrench: Wrench) -> dict[str, list[float]]:
    """Time per step [s] of each integrator's kernel, in each round, for a spinning body under ``wrench``."""
    rate = sum(w * w for w in SPIN) ** 0.5 / TURN
    body, state = Body(2.0, (0.1, 0.2, 0.25)), State(orientation=(1.0, 2.0, 3.0, 4.0), angular_velocity=SPIN)
    simulations = {
        name: Simulation(body, state, rate=rate, gravity=(0.0, 0.0, -9.80665), integrator=name)
        for name, integrator in integrators.REGISTRY.items()
        if not integrator.refusal(wrench)
    }
    costs: dict[str, list[float]] = {name: [] for name in simulations}
    for _ in range(ROUNDS):
        for name, simulation in simulations.items():
            simulation.reset()
            simulation.set_wrench(wrench)
            costs[name].append(seconds(lambda simulation=simulation: simulation.step(STEPS)) / STEPS)
    return costs


def cycle_costs() -> dict[str, list[float]]:
    """Time [s] of one new wrench, one step and one pose read back, in each round, and of its parts."""
    simulation = Simulation(Body(2.0, (0.1, 0.2, 0.25)), State(angular_velocity=SPIN), gravity=(0.0, 0.0, -9.80665))
    force, torque = (0.01, 0.0, 0.0), (SMALL, 0.0, 0.0)
    held = Wrench(force, torque)

    def cycle() -> None:
        simulation.set_wrench(Wrench(force, torque))
        simulation.step()
        simulation.pose  # noqa: B018 - reading it is what is timed

    parts: dict[str, Callable[[], object]] = {
        "whole cycle": cycle,
        "Wrench(...)": lambda: Wrench(force, torque),
        "set_wrench": lambda: simulation.set_wrench(held),
        "step": simulation.step,
        "pose": lambda: simulation.pose,
    }
    return {
        name: [seconds(lambda part=part: [part() for _ in range(STEPS)]) / STEPS for _ in range(ROUNDS)]
        for name, part in parts.items()
    }


def main() -> int:
    """Print all figures with the machine's name."""
    numba = "numba" if compiled.ENABLED else "plain Python"
    print(f"{platform.node()}, {platform.machine()}, Python {platform.python_version()}, kernels in {numba}")
    print(f"\nKernel alone at h|w| = {TURN}, ns per step: median (smallest) of {ROUNDS} rounds; ratio taylor / rk4")
    for what, wrench in WRENCHES.items():
        costs = kernel_costs(wrench)
        shown = "  ".join(
            f"{name} {1e9 * statistics.median(cost):5.0f} ({1e9 * min(cost):.0f})" for name, cost in costs.items()
        )
        ratio = statistics.median(a / b for a, b in zip(costs["taylor"], costs["rk4"], strict=True))
        print(f"  {what:26s} {shown}   {ratio:.2f}")
    print("\nFrom Python, µs: median (smallest)")
    for name, cost in cycle_costs().items():
        print(f"  {name:26s} {1e6 * statistics.median(cost):6.2f} ({1e6 * min(cost):.2f})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
