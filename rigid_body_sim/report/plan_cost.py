"""What a plan saves: the cost of a step by it, beside the full equations with every term switched on at zero.

All figures come from one run in which the candidates take turns. ``in one call`` is a call for many steps, ``a call
each`` is the kernel called for every step, less what an empty call costs.
"""

import statistics
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .. import integrators
from ..command_line import takes_nothing
from ..effects.drag import Drag
from ..effects.tether import Tether
from ..kernels import compiled
from ..simulation import Simulation
from ..values.body import Body
from ..values.state import State, flatten
from ..values.wrench import Wrench
from .step_cost import GRAVITY, MOMENTS, SPIN, seconds

ROUNDS = 40
CALLS = 500
STEPS = 2000
LEAST = 1e-9  # s: what cannot be told from an empty call
TINY = 1e-30  # switches a term on and changes no digit

FULL_WRENCH = Wrench(
    (TINY,) * 3,
    (TINY,) * 3,
    (TINY,) * 3,
    (TINY,) * 3,
    points=[((0.3, 0.1, 0.2), (TINY, 0.0, 0.0)), ((0.1, 0.2, 0.3), (0.0, TINY, 0.0))],
)
STIFF_TETHER = Tether(anchor=(0.0, 0.0, 1.0), rest_length=1.0, stiffness=1e8, damping=1e5)


def simulations() -> dict[str, Simulation]:
    """One simulation per plan; the first two have every term, for wrenches and for everything."""
    general, spinning = Body(2.0, MOMENTS), State(angular_velocity=SPIN)
    sphere, symmetric = Body(2.0, (0.2,) * 3), Body(2.0, (0.1, 0.1, 0.2))
    torque = Wrench(torque_body=(1e-4, 2e-4, 1e-4))
    made: dict[str, tuple[Body, State, Wrench, dict[str, Any]]] = {
        "full wrench (taylor)": (general, spinning, FULL_WRENCH, {"integrator": "taylor"}),
        "full, with drag and tether": (general, spinning, FULL_WRENCH, {"tethers": [Tether()]}),
        "point mass": (general, State(), Wrench(force_world=(1.0, 2.0, 3.0)), {}),
        "sphere, no torque": (sphere, spinning, Wrench(), {}),
        "sphere, body torque": (sphere, spinning, torque, {}),
        "symmetric, no torque": (symmetric, spinning, Wrench(), {}),
        "any body, no torque": (general, spinning, Wrench(), {}),
        "any body, body torque": (general, spinning, torque, {}),
        "any body, body force": (general, spinning, Wrench(force_body=(1.0, 2.0, 3.0)), {}),
        "drag": (general, spinning, Wrench(), {"drag": Drag((1.0,) * 3, (1.0,) * 3, (0.01,) * 3)}),
        "stiff tether": (general, spinning, Wrench(), {"tethers": [STIFF_TETHER]}),
    }
    return {name: _simulation(*one) for name, one in made.items()}


def _simulation(body: Body, state: State, wrench: Wrench, options: dict[str, Any]) -> Simulation:
    simulation = Simulation(body, state, gravity=GRAVITY, **options)
    simulation.set_wrench(wrench)
    return simulation


def calls_of(simulation: Simulation) -> Callable[[int], object]:
    """The kernel that the plan calls, for a number of steps, on a state of its own."""
    model = simulation.terms.model(simulation.wrench)
    state, work = flatten(simulation.state, model), np.zeros(simulation.integrator.work_size)
    h = 1.0 / simulation.rate
    steps = integrators.steps_of(simulation.integrator, simulation.terms.kernels)
    kernel = compiled.ready(steps, state, model, work, h, 1)
    return lambda count: kernel(state, model, work, h, count)


def costs(simulations: Mapping[str, Simulation], rounds: int) -> dict[str, tuple[float, float]]:
    """Time per step [s] in one call, and with a call each, by name: medians over rounds in which all take turns."""
    calls = {name: calls_of(simulation) for name, simulation in simulations.items()}
    measured: dict[str, list[tuple[float, float, float]]] = {name: [] for name in simulations}
    for _ in range(rounds):
        for name, simulation in simulations.items():
            before = simulation.save()
            measured[name].append(_costs(simulation, calls[name]))
            simulation.restore(before)
    middle = {name: [statistics.median(column) for column in zip(*m, strict=True)] for name, m in measured.items()}
    return {name: (bulk, max(each - empty, LEAST)) for name, (bulk, each, empty) in middle.items()}


def _costs(simulation: Simulation, call: Callable[[int], object]) -> tuple[float, float, float]:
    """Time [s] of a step in one call, of a step with a call of its own, and of an empty call."""
    return (
        seconds(lambda: simulation.step(STEPS)) / STEPS,
        seconds(lambda: [call(1) for _ in range(CALLS)]) / CALLS,
        seconds(lambda: [call(0) for _ in range(CALLS)]) / CALLS,
    )


def main(args: Sequence[str] | None = None) -> int:
    """Print the table."""
    takes_nothing("plan_cost", "Measures what a step costs by each plan.", args)
    plans = simulations()
    medians = costs(plans, ROUNDS)
    full = next(iter(medians.values()))
    print("\nA step by each plan, ns: in one call, a call each; and both relative to the full wrench's")
    for name, (bulk, each) in medians.items():
        print(
            f"  {name:28s} {1e9 * bulk:8.1f} {1e9 * each:8.0f}   {bulk / full[0]:6.3f} {each / full[1]:6.3f}   "
            f"{plans[name].plan.integrator}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
