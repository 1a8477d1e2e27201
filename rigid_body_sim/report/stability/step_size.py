"""Tiny and huge steps: the step size from a microsecond to a quarter of an hour against what acts on the body.

Ten steps are done, so errors are measured against how far the body came. The truth is a run of dop853 at rtol 1e-13 in
steps of half a second at most; where taylor or rosenbrock can check it, they do (see the tests).
"""

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...effects.drag import Drag
from ...effects.tether import Tether
from ...kernels.arrays import Floats
from ...simulation import Simulation
from ...values.body import Body
from ...values.state import State
from ...values.wrench import Wrench
from .maps import Map
from .outcome import Case, Scale

BODY = Body(2.0, (0.2, 0.2, 0.25))  # symmetric, so that nothing is chaotic: hours later the truth is still known
START = State((1.0, 0.0, 0.0), (0.8, 0.0, 0.6, 0.0), (0.0, 0.1, 0.0), (0.3, -0.2, 0.9))
STEPS = 10
LONGEST_FINE_STEP = 0.5  # s
_GRAVITY = {"gravity": (0.0, 0.0, -9.80665)}
_DRAG = {"drag": Drag((2.0,) * 3, (1.0,) * 3, (0.02,) * 3, (0.01,) * 3)}
_TETHER = {"tethers": [Tether(stiffness=8.0, slack=False)]}

# What acts: the wrench held, and what the simulation has besides.
ACTING: Mapping[str, tuple[Wrench, Mapping[str, Any]]] = {
    "nothing": (Wrench(), {}),
    "gravity": (Wrench(), _GRAVITY),
    "body torque": (Wrench(torque_body=(1e-6, 2e-6, 4e-5)), {}),
    "world torque": (Wrench(torque_world=(1e-5, 2e-5, 4e-5)), {}),
    "body force": (Wrench(force_body=(0.1, 0.2, -0.1)), {}),
    "force at a point": (Wrench(points=[((0.0, 0.0, 0.05), (0.0, 0.0, -0.4))]), {}),
    "drag": (Wrench(force_world=(0.0, 0.0, 1.0)), _DRAG),
    "tether": (Wrench(), _TETHER),
    "drag, tether, gravity": (Wrench(), {**_GRAVITY, **_DRAG, **_TETHER}),
}


def build(quick: bool) -> Map[str]:
    """The map."""
    return Map(
        "step_size",
        "Tiny and huge steps",
        f"A body that turns by about 1 rad/s does {STEPS} steps; errors are shares of the way and angle that it came. "
        "Truth: dop853 at rtol 1e-13 in steps of half a second at most.",
        "what acts",
        "step size [s]",
        list(ACTING),
        (1e-6, 1e-2, 1e1) if quick else [10.0**n for n in range(-6, 4)],
        case,
        "h [s]",
        lambda acting, h: h,
    )


def make(acting: str, rate: float, **options: Any) -> Simulation:
    """The simulation of a row."""
    wrench, more = ACTING[acting]
    made = Simulation(BODY, START, rate=rate, **more, **options)
    made.set_wrench(wrench)
    return made


def case(acting: str, h: float) -> Case:
    """The run of what acts, with a step [s]."""

    def follow(made: Simulation) -> Sequence[Floats]:
        made.step(STEPS)
        return [made.state.values[:13]]

    true = fine(acting, h)
    start = START.values
    turned = min(1.0, STEPS * h * float(np.linalg.norm(start[10:13])))
    way = max(float(np.linalg.norm(true[0:3] - start[0:3])), STEPS * h * float(np.linalg.norm(start[7:10])))
    speed, spin = (max(np.linalg.norm(true[a : a + 3]), np.linalg.norm(start[a : a + 3])) for a in (7, 10))
    scale = Scale(way, turned, float(speed), float(spin))
    return Case(lambda name: make(acting, 1.0 / h, integrator=name), follow, true[None, :], scale)


@functools.cache
def fine(acting: str, h: float, integrator: str = "dop853") -> Floats:
    """State (13,) after STEPS steps of h [s], by fine steps of an integrator at the least tolerance."""
    each = max(1, int(np.ceil(h / LONGEST_FINE_STEP)))
    made = make(acting, each / h, integrator=integrator, rtol=1e-13)
    made.step(STEPS * each)
    return made.state.values[:13]
