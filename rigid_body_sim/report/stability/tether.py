"""Stiff tethers, with and without damping: the step size against the tether's frequency ω = √(k/m).

The body is attached at its centre of mass, thrown along the line, and rotates freely: so the truth is the closed form
of an oscillator, with the stretch s'' = −ω² s − 2 ζ ω s', and of the motion without torque.
"""

import math

import numpy as np

from ...effects.tether import Tether
from ...kernels.arrays import Floats
from ...simulation import Simulation
from ...values.body import Body
from ...values.state import State
from .free import turned
from .maps import Map
from .outcome import Case, Scale

BODY = Body(2.0, (0.1, 0.2, 0.25))
ALONG = np.array((1.0, 2.0, -2.0)) / 3.0
LENGTH = 1.0  # m
SPEED = 1.0  # m/s
SPIN = (3.0, -20.0, 5.0)  # rad/s
SPAN = 0.1  # s
SCALE = Scale(0.1, 1.0, SPEED, 20.0)


def build(quick: bool, damped: bool) -> Map[float]:
    """The map of the damped (ζ = ½) or undamped tether."""
    frequencies = (1e1, 1e2, 1e3, 3e3) if quick else [10.0 ** (0.5 * n) for n in range(2, 10)]
    divisions = (100, 10, 1) if quick else (1000, 300, 100, 30, 10, 3, 1)
    ratio = 0.5 if damped else 0.0
    return Map(
        "tether_damped" if damped else "tether_undamped",
        f"{'Damped' if damped else 'Undamped'} tether: frequency against step size",
        f"A spinning body at the end of a tether of {LENGTH:g} m, thrown along it with {SPEED:g} m/s; damping ratio "
        f"{ratio:g}, {SPAN:g} s are simulated. Truth: a closed form.",
        "frequency ω [rad/s]",
        "step size [s]",
        frequencies,
        [SPAN / n for n in divisions],
        lambda frequency, h: case(frequency, h, ratio),
        "ω h",
        lambda frequency, h: frequency * h,
    )


def case(frequency: float, h: float, ratio: float) -> Case:
    """The run with a frequency [rad/s], a step [s] and a damping ratio."""
    steps = round(SPAN / h)
    tether = Tether(
        rest_length=LENGTH,
        stiffness=BODY.mass * frequency**2,
        damping=2.0 * BODY.mass * ratio * frequency,
        slack=False,
    )

    def simulation(integrator: str) -> Simulation:
        state = State(position=LENGTH * ALONG, velocity=SPEED * ALONG, angular_velocity=SPIN)
        return Simulation(BODY, state, rate=steps / SPAN, tethers=[tether], integrator=integrator)

    def follow(made: Simulation) -> list[Floats]:
        made.step(steps)
        return [made.state.values[:13]]

    return Case(simulation, follow, truth(frequency, ratio, SPAN)[None, :], SCALE)


def truth(frequency: float, ratio: float, t: float) -> Floats:
    """State (13,) at t [s]; the damping ratio is below 1."""
    swing = frequency * math.sqrt(1.0 - ratio * ratio)
    decay = SPEED * math.exp(-ratio * frequency * t)
    stretch = decay * math.sin(swing * t) / swing
    speed = decay * math.cos(swing * t) - ratio * frequency * stretch
    orientation, w_body = turned(BODY, SPIN, t)
    return np.concatenate(((LENGTH + stretch) * ALONG, orientation, speed * ALONG, w_body))
