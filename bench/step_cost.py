"""What a step costs: the kernels alone, and a command, a step and a pose from Python, beside other simulators.

All figures of one line come from one run in which the candidates take turns, so that they see the same machine. A
figure is the median over rounds; times on a shared machine drift, the ratios do not.
"""

import functools
import platform
import statistics
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bench.peers import heyoka_peer
from rigid_body_sim import integrators
from rigid_body_sim.command_line import takes_nothing
from rigid_body_sim.kernels import compiled
from rigid_body_sim.report.cost import seconds
from rigid_body_sim.report.problems import problem
from rigid_body_sim.runs.schedule import WrenchSchedule
from rigid_body_sim.simulation import Simulation
from rigid_body_sim.values.body import Body
from rigid_body_sim.values.state import State
from rigid_body_sim.values.wrench import Wrench

ROUNDS = 60
STEPS = 2000
TURN = 0.01  # h |ω| [rad]: how far the body turns in a step
SPIN = (1.0, 1.0, 0.5)  # rad/s
MOMENTS = (0.1, 0.2, 0.25)  # kg m²
GRAVITY = (0.0, 0.0, -9.80665)  # m/s²
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


def kernel_costs(wrench: Wrench) -> dict[str, list[float]]:
    """Time per step [s] of each integrator's kernel, in each round, for a spinning body under ``wrench``."""
    rate = sum(w * w for w in SPIN) ** 0.5 / TURN
    body, state = Body(2.0, MOMENTS), State(orientation=(1.0, 2.0, 3.0, 4.0), angular_velocity=SPIN)
    simulations = {
        name: Simulation(body, state, rate=rate, gravity=GRAVITY, integrator=name)
        for name, integrator in integrators.REGISTRY.items()
        if not integrator.refusal(wrench) and not integrator.one_evaluation  # its cost is that of a run, not of a step
    }
    costs: dict[str, list[float]] = {name: [] for name in simulations}
    for _ in range(ROUNDS):
        for name, simulation in simulations.items():
            simulation.reset()
            simulation.set_wrench(wrench)
            costs[name].append(seconds(functools.partial(simulation.step, STEPS)) / STEPS)
    return costs


def cycles() -> dict[str, Callable[[], object]]:
    """One new wrench, one step and one pose read back: here, in its parts, and in other simulators where installed."""
    simulation = Simulation(Body(2.0, MOMENTS), State(angular_velocity=SPIN), gravity=GRAVITY)
    force, torque = (0.01, 0.0, 0.0), (SMALL, 0.0, 0.0)
    held = Wrench(force, torque)

    def cycle() -> tuple[float, ...]:
        simulation.set_wrench(Wrench(force, torque))
        simulation.step()
        return simulation.pose

    return {
        "whole cycle": cycle,
        "  Wrench(...)": lambda: Wrench(force, torque),
        "  set_wrench": lambda: simulation.set_wrench(held),
        "  step": simulation.step,
        "  pose": lambda: simulation.pose,
        **_mujoco_cycles(),
        **_pinocchio_cycle(),
        **_heyoka_cycles(force, torque),
    }


def _mujoco_cycles() -> dict[str, Callable[[], object]]:
    """MuJoCo with its two explicit integrators, driven by xfrc_applied, as its users do."""
    try:
        import mujoco
    except ImportError:
        return {}
    made = {}
    for integrator in ("Euler", "RK4"):
        model = mujoco.MjModel.from_xml_string(_MUJOCO_BODY.format(integrator=integrator))
        data = mujoco.MjData(model)
        data.qvel[3:] = SPIN
        made[f"MuJoCo {integrator}"] = _mujoco_cycle(mujoco.mj_step, model, data)
    return made


_MUJOCO_BODY = """<mujoco><option timestep="0.001" gravity="0 0 -9.80665" integrator="{integrator}"/><worldbody><body>
<freejoint/><inertial pos="0 0 0" mass="2" diaginertia="0.1 0.2 0.25"/></body></worldbody></mujoco>"""


def _mujoco_cycle(mj_step: Callable[[Any, Any], None], model: Any, data: Any) -> Callable[[], object]:
    wrench = np.array((0.01, 0.0, 0.0, SMALL, 0.0, 0.0))

    def cycle() -> object:
        data.xfrc_applied[1] = wrench
        mj_step(model, data)
        return data.qpos

    return cycle


def _pinocchio_cycle() -> dict[str, Callable[[], object]]:
    """Pinocchio: forward dynamics (aba) and its integration of the configuration, semi-implicit Euler."""
    try:
        import pinocchio
    except ImportError:
        return {}
    model = pinocchio.Model()
    model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "body")
    inertia = pinocchio.Inertia(2.0, np.zeros(3), np.diag(MOMENTS))
    model.appendBodyToJoint(1, inertia, pinocchio.SE3.Identity())
    data, wrench = model.createData(), np.array((0.01, 0.0, 0.0, SMALL, 0.0, 0.0))
    state = [pinocchio.neutral(model), np.array((0.0, 0.0, 0.0, *SPIN))]

    def cycle() -> object:
        state[1] = state[1] + 1e-3 * pinocchio.aba(model, data, *state, wrench)
        state[0] = pinocchio.integrate(model, state[0], 1e-3 * state[1])
        return state[0]

    return {"Pinocchio aba, integrate": cycle}


def _heyoka_cycles(force: Sequence[float], torque: Sequence[float]) -> dict[str, Callable[[], object]]:
    """heyoka with the wrench as parameters: the order of its series follows from the tolerance."""
    body = replace(
        problem("body_wrench"),
        body=Body(2.0, MOMENTS),
        initial=State(angular_velocity=SPIN),
        gravity=GRAVITY,
        wrenches=(Wrench(force, torque),),
    )
    try:
        runs = {f"heyoka, rtol {rtol:.1e}": heyoka_peer.Run(body, rtol) for rtol in (heyoka_peer.RTOLS[-1], 1e-9)}
    except ImportError:
        return {}
    return {name: _heyoka_cycle(run) for name, run in runs.items()}


def _heyoka_cycle(run: heyoka_peer.Run) -> Callable[[], object]:
    step, parameters, states, held = run.integrator.step, run.parameters, run.states, run.equations.parameters[0]
    run.restart()

    def cycle() -> object:
        parameters[:] = held
        step(1e-3)
        return states.tolist()

    return cycle


def cycle_costs() -> dict[str, list[float]]:
    """Time [s] of each of ``cycles``, in each round."""
    costs: dict[str, list[float]] = {}
    parts = cycles()
    for _ in range(ROUNDS):
        for name, part in parts.items():
            costs.setdefault(name, []).append(seconds(functools.partial(_often, part)) / STEPS)
    return costs


def commands() -> dict[str, Callable[[], object]]:
    """Random commands for 10 ms each: one call each, all as one schedule, and heyoka at two tolerances."""
    given = problem("commands")
    simulation = Simulation(given.body, given.initial, rate=1.0 / given.hold, gravity=given.gravity)
    count = len(given.wrenches)
    schedule = WrenchSchedule.of(range(count), given.wrenches)

    def one_by_one() -> object:
        simulation.reset()
        for wrench in given.wrenches:
            simulation.set_wrench(wrench)
            simulation.step()
        return simulation.state

    def at_once() -> object:
        simulation.reset()
        return simulation.run(steps=count, every=count, commands=schedule)

    ways: dict[str, Callable[[], object]] = {"one by one": one_by_one, "one schedule": at_once}
    try:
        for rtol in (heyoka_peer.RTOLS[-1], 1e-9):
            run = heyoka_peer.Run(given, rtol)
            ways[f"heyoka, rtol {rtol:.1e}"] = functools.partial(_from_the_start, run)
    except ImportError:
        pass
    return ways


def _from_the_start(run: heyoka_peer.Run) -> object:
    run.restart()
    return run.advance()


def command_costs() -> dict[str, list[float]]:
    """Time [s] for a command of each of ``commands``, in each round."""
    costs: dict[str, list[float]] = {}
    ways, count = commands(), len(problem("commands").wrenches)
    for _ in range(ROUNDS):
        for name, way in ways.items():
            costs.setdefault(name, []).append(seconds(way) / count)
    return costs


def thread_costs(n: int) -> list[list[float]]:
    """Time [s] for calls of n steps each on two simulations, in each round: one, both in turn, a thread for each."""
    first, second = (Simulation(Body(2.0, MOMENTS), State(angular_velocity=SPIN)) for _ in range(2))
    for simulation in (first, second):
        simulation.set_wrench(Wrench(torque_body=_TORQUE))
    one, other = (functools.partial(_calls, simulation, n) for simulation in (first, second))

    def two_threads() -> None:
        threads = [threading.Thread(target=work) for work in (one, other)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    return [[_elapsed(work) for work in (one, lambda: (one(), other()), two_threads)] for _ in range(ROUNDS)]


def _calls(simulation: Simulation, n: int) -> None:
    for _ in range(max(1, 10 * STEPS // (n + 2))):
        simulation.step(n)


def _elapsed(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def _often(part: Callable[[], object]) -> None:
    for _ in range(STEPS):
        part()


def main(args: Sequence[str] | None = None) -> int:
    """Print all figures with the machine's name."""
    takes_nothing(
        "step_cost",
        "Measures what a step costs: in a kernel, and with a command and a pose from Python.",
        args,
    )
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
    print("\nOne new wrench, one step and one pose read back, from Python, µs: median (smallest)")
    for name, cost in cycle_costs().items():
        print(f"  {name:26s} {1e6 * statistics.median(cost):6.2f} ({1e6 * min(cost):.2f})")
    print("\nRandom commands, 10 ms each, µs a command: median (smallest), and times one schedule")
    costs = command_costs()
    for name, cost in costs.items():
        ratio = statistics.median(a / b for a, b in zip(cost, costs["one schedule"], strict=True))
        print(f"  {name:26s} {1e6 * statistics.median(cost):6.2f} ({1e6 * min(cost):.2f})  {ratio:.2f}")
    print(
        "\nTwo threads with a simulation each, as a multiple of the time of one simulation, and of both in one thread"
    )
    for n in (1, 10, 1000, 100_000):
        ratios = [(threads / one, threads / both) for one, both, threads in thread_costs(n)]
        of_one, of_both = map(statistics.median, zip(*ratios, strict=True))
        print(f"  {n:6d} steps in each call    {of_one:6.2f} {of_both:6.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
