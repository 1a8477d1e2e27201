"""What a step of two linked bodies costs, and how large its error is, by the stiffness of the link.

Run `python -m bench.linked_cost`. Two balls of 1 kg at 1 kHz, a spring of rest length 1 m that is stretched by an
amount whose energy is 0.1 J, no damping or critical damping; closed forms tell the error after 0.2 s.
"""

import math
import sys
import time
from collections.abc import Sequence

import numpy as np

from rigid_body_sim.command_line import takes_nothing
from rigid_body_sim.effects import link
from rigid_body_sim.effects.link import Link
from rigid_body_sim.integrators import linked
from rigid_body_sim.kernels.arrays import Floats
from rigid_body_sim.many_bodies import of_terms
from rigid_body_sim.terms import Terms
from rigid_body_sim.values.body import Body
from rigid_body_sim.values.state import State, flatten

H = 1e-3  # s
STEPS = 200
ENERGY = 0.1  # J, at the start
BALL = Body(1.0, (0.1, 0.1, 0.1))
REDUCED = 0.5  # kg


def measured(stiffness: float, critical: bool) -> tuple[int, float, float]:
    """Steps done, the error of the length as a share of the first stretch, and CPU time [s] a step."""
    omega, stretch = math.sqrt(stiffness / REDUCED), math.sqrt(2.0 * ENERGY / stiffness)
    damping = 2.0 * REDUCED * omega if critical else 0.0
    one = Link("spring", ("a", "b"), rest_length=1.0, stiffness=stiffness, damping=damping, slack=False)
    terms = Terms(BALL)
    bodies = of_terms([terms, terms], H)
    states = np.array([flatten(State((0.0, 0.0, z)), bodies.models[0]) for z in (0.0, 1.0 + stretch)])
    advance = linked.ready_linked((terms.kernels, terms.kernels))
    rows: Floats = link.row(one, {"a": BALL, "b": BALL})
    work, which = np.zeros(linked.work_size(2)), np.arange(2)
    models, width = bodies.models.reshape(-1), bodies.models.shape[1]
    begin = time.process_time()
    done = advance(states.reshape(-1), models, width, which, rows, work, H, STEPS)
    seconds = (time.process_time() - begin) / max(done, 1)
    t = done * H
    shape = (1.0 + omega * t) * math.exp(-omega * t) if critical else math.cos(omega * t)
    return done, abs(states[1, 2] - states[0, 2] - 1.0 - stretch * shape) / stretch, seconds


def main(args: Sequence[str] | None = None) -> int:
    """Print a line for each stiffness."""
    takes_nothing("linked_cost", "Measures steps of two linked bodies by the stiffness of the link.", args)
    print("Two balls of 1 kg on a spring, 1 kHz, rtol 1e-9: undamped, and critically damped")
    for power in range(2, 14):
        for critical in (False, True):
            done, error, seconds = measured(10.0**power, critical)
            said = f"{1e6 * seconds:9.1f} us a step, error {error:.1e}" if done == STEPS else f"refused: {done} done"
            print(f"  1e{power:<2} N/m, {'damped' if critical else 'free':<6} {said}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
