"""What a plan saves: the cost of a step by it, beside the full equations with every term switched on at zero.

All figures come from one run in which the candidates take turns. ``in one call`` is a call for many steps, ``a call
each`` is the kernel called for every step, less what an empty call costs.
"""

import sys
from collections.abc import Sequence
from typing import Any

from rigid_body_sim.command_line import takes_nothing
from rigid_body_sim.effects.drag import Drag
from rigid_body_sim.effects.ground import Ground
from rigid_body_sim.effects.tether import Tether
from rigid_body_sim.report.cost import FULL_WRENCH, costs
from rigid_body_sim.simulation import Simulation
from rigid_body_sim.values.body import Body
from rigid_body_sim.values.state import State
from rigid_body_sim.values.wrench import Wrench

from .step_cost import GRAVITY, MOMENTS, SPIN

ROUNDS = 40
STIFF_TETHER = Tether(anchor=(0.0, 0.0, 1.0), rest_length=1.0, stiffness=1e8, damping=1e5)


def feet(stiffness: float) -> Ground:
    """Ground below four points of the body."""
    contacts = tuple((x, y, -0.1) for x in (-0.2, 0.2) for y in (-0.15, 0.15))
    return Ground(stiffness=stiffness, damping=stiffness**0.5, friction=0.5, contacts=contacts)


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
        **{
            f"rests on 4 contacts, k = {k:.0e}": (general, State((0.0, 0.0, 0.1)), Wrench(), {"ground": feet(k)})
            for k in (1e4, 1e6)
        },
    }
    return {name: _simulation(*one) for name, one in made.items()}


def _simulation(body: Body, state: State, wrench: Wrench, options: dict[str, Any]) -> Simulation:
    simulation = Simulation(body, state, gravity=GRAVITY, **options)
    simulation.set_wrench(wrench)
    return simulation


def main(args: Sequence[str] | None = None) -> int:
    """Print the table."""
    takes_nothing("plan_cost", "Measures what a step costs by each plan.", args)
    plans = simulations()
    medians = costs(plans, ROUNDS)
    full = next(iter(medians.values()))
    print("\nA step by each plan, ns: in one call, a call each; and both relative to the full wrench's")
    for name, (bulk, each) in medians.items():
        print(
            f"  {name:30s} {1e9 * bulk:8.1f} {1e9 * each:8.0f}   {bulk / full[0]:6.3f} {each / full[1]:6.3f}   "
            f"{plans[name].plan.integrator}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
