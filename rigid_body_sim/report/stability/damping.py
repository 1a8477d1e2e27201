"""Stiff drag: the step size against the damping rate λ. The truth is a closed form.

With drag λ m along all axes and λ I_i about each, velocity and angular momentum decay alike:

    v = F/(λ m) + (v₀ − F/(λ m)) e^(−λ t),        L_b = e^(−λ t) l(s),   s = (1 − e^(−λ t)) / λ,

where l is the motion without torque: from L_b' = L_b × ω − λ L_b follows dl/ds = l × I₀⁻¹ l, and the attitude is
that of the motion without torque after s.
"""

import math

import numpy as np

from ...effects.drag import Drag
from ...kernels.arrays import Floats
from ...simulation import Simulation
from ...values.body import Body
from ...values.state import State
from ...values.wrench import Wrench
from .free import turned
from .maps import Map
from .outcome import Case, Scale

BODY = Body(2.0, (0.1, 0.2, 0.25))
SPEED, SPIN = (1.0, -0.5, 0.3), (3.0, -20.0, 5.0)  # m/s, rad/s
FORCE = (4.0, 2.0, -6.0)  # N
SPAN = 0.1  # s
SCALE = Scale(0.1, 1.0, 1.0, 20.0)


def build(quick: bool) -> Map[float]:
    """The map; steps are SPAN divided by whole numbers."""
    rates = (1e1, 1e3, 1e5, 1e7) if quick else [10.0**n for n in range(1, 9)]
    divisions = (100, 10, 1) if quick else (1000, 300, 100, 30, 10, 3, 1)
    return Map(
        "damping",
        "Linear drag: damping rate against step size",
        f"A body of three different moments, spun at {math.hypot(*SPIN):.0f} rad/s and thrown, with drag that brakes "
        f"all its motion at the same rate λ, and a constant force; {SPAN:g} s are simulated. Truth: a closed form.",
        "damping rate λ [1/s]",
        "step size [s]",
        rates,
        [SPAN / n for n in divisions],
        case,
        "λ h",
        lambda rate, h: rate * h,
    )


def case(damping: float, h: float) -> Case:
    """The run with a damping rate [1/s] and a step [s]."""
    steps = round(SPAN / h)

    def simulation(integrator: str) -> Simulation:
        made = Simulation(
            BODY,
            State(velocity=SPEED, angular_velocity=SPIN),
            rate=steps / SPAN,
            drag=Drag(linear=(damping * BODY.mass,) * 3, angular_linear=damping * BODY.principal_moments),
            integrator=integrator,
        )
        made.set_wrench(Wrench(force_world=FORCE))
        return made

    def follow(made: Simulation) -> list[Floats]:
        made.step(steps)
        return [made.state.values[:13]]

    return Case(simulation, follow, truth(damping, SPAN)[None, :], SCALE)


def truth(damping: float, t: float) -> Floats:
    """State (13,) at t [s]."""
    decay, covered = math.exp(-damping * t), -math.expm1(-damping * t) / damping
    final = np.array(FORCE) / (damping * BODY.mass)
    orientation, w_body = turned(BODY, SPIN, covered)
    position = final * t + (np.array(SPEED) - final) * covered
    return np.concatenate((position, orientation, final + (np.array(SPEED) - final) * decay, decay * w_body))
