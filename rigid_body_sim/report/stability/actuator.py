"""Actuators with a lag T against the step size. The truth is a closed form.

Two thrusters side by side give a torque τ about z, and one a force F along z, all from zero with the same lag. What a
level x = u (1 − e^(−t/T)) has added up to after t, once and twice over, is

    s₁ = t − T (1 − e^(−t/T)),        s₂ = t²/2 − T s₁,

so the body, which spins about z, does so at ω₀ + τ s₁ / I, has turned by ω₀ t + τ s₂ / I, and so on along z.

An integrator that leaves actuators out is driven as most simulators are: by the wrench of the levels at the beginning
of each step, held over it.
"""

import math

import numpy as np

from ... import integrators
from ...effects.actuators import Actuator
from ...kernels.arrays import Floats
from ...simulation import Simulation
from ...values import rotation
from ...values.body import Body
from ...values.state import State
from ...values.wrench import Wrench
from .maps import Map
from .outcome import Case, Scale

BODY = Body(2.0, (0.1, 0.2, 0.25))
SPIN = 3.0  # rad/s
ARM, COUPLE, PUSH = 0.1, 20.0, 30.0  # m, N of each of two, N
SPAN = 0.1  # s
SCALE = Scale(0.1, 1.0, 1.0, 20.0)


def build(quick: bool) -> Map[float]:
    """The map; steps are SPAN divided by whole numbers."""
    lags = (1e-7, 1e-4, 1e-1) if quick else [10.0**n for n in range(-8, 2)]
    divisions = (100, 10, 1) if quick else (1000, 300, 100, 30, 10, 3, 1)
    return Map(
        "actuator",
        "Actuators: their lag against the step size",
        "A spinning body under three thrusters that follow a command with the same lag T; "
        f"{SPAN:g} s are simulated. Truth: a closed form. Integrators that leave actuators out are given the wrench of "
        "the levels at the beginning of each step, held over it.",
        "time constant T [s]",
        "step size [s]",
        lags,
        [SPAN / n for n in divisions],
        case,
        "h / T",
        lambda lag, h: h / lag,
    )


def case(lag: float, h: float) -> Case:
    """The run with a time constant [s] and a step [s]."""
    steps = round(SPAN / h)
    places = ((ARM, 0.0, 0.0), (0.0, 1.0, 0.0)), ((-ARM, 0.0, 0.0), (0.0, -1.0, 0.0)), ((0.0,) * 3, (0.0, 0.0, 1.0))

    def simulation(integrator: str) -> Simulation:
        thrusters = [
            Actuator(str(k), "thruster", 0.0, 50.0, position, axis, time_constant=lag)
            for k, (position, axis) in enumerate(places)
        ]
        held = integrator != integrators.AUTO and integrators.get(integrator).driven is None
        made = Simulation(
            BODY,
            State(angular_velocity=(0.0, 0.0, SPIN)),
            rate=steps / SPAN,
            integrator=integrator,
            actuators=() if held else thrusters,
        )
        if held:
            made.set_wrench(wrench(1.0))  # refused by one that knows no torque
        else:
            made.set_actuators([COUPLE, COUPLE, PUSH])
        return made

    def follow(made: Simulation) -> list[Floats]:
        if made.actuators:
            made.step(steps)
        for step in range(made.steps, steps):
            made.set_wrench(wrench(-math.expm1(-step * h / lag)))
            made.step()
        return [made.state.values[:13]]

    return Case(simulation, follow, truth(lag, SPAN)[None, :], SCALE)


def wrench(level: float) -> Wrench:
    """What the thrusters do at a share ``level`` of what is commanded."""
    return Wrench(torque_body=(0.0, 0.0, 2.0 * ARM * COUPLE * level), force_body=(0.0, 0.0, PUSH * level))


def truth(lag: float, t: float) -> Floats:
    """State (13,) at t [s]."""
    once = t + lag * math.expm1(-t / lag)
    twice = t * t / 2 - lag * once
    turn, push = 2.0 * ARM * COUPLE / BODY.principal_moments[2], PUSH / BODY.mass
    angle = SPIN * t + turn * twice
    orientation = rotation.from_axis_angle((0.0, 0.0, 1.0), angle)
    return np.array((0.0, 0.0, push * twice, *orientation, 0.0, 0.0, push * once, 0.0, 0.0, SPIN + turn * once))
