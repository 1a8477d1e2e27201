"""A sampled attitude controller with high gains in the loop: the number of steps in a sampling period against the gain.

Every period T the controller reads attitude and rates and holds the torque τ = −I (2 ω_n² ε + 2 ζ ω_n ω), with ε the
vector part of the quaternion, until the next one. For small angles every axis is a double integrator under a held
torque, which is stable for 2 ζ ω_n T < 2, whatever ω_n² may be above zero; a method that computes another motion in
between has another limit.
"""

import functools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...kernels.arrays import Floats
from ...simulation import Simulation
from ...values import rotation
from ...values.body import Body
from ...values.state import State
from ...values.wrench import Wrench
from .maps import Map
from .outcome import Case, Scale

BODY = Body(2.0, (0.1, 0.2, 0.25))
PERIOD = 0.1  # s
DAMPING_RATIO = 1.0  # so the loop is stable for ω_n T < 1
START = State(orientation=rotation.from_axis_angle((1.0, 2.0, -0.5), 2.5), angular_velocity=(1.0, -2.0, 0.5))
SCALE = Scale(1.0, 1.0, 1.0, 5.0)
COMMANDS = 100
FINE: dict[str, Any] = {"integrator": "dop853", "rtol": 1e-13}


def build(quick: bool) -> Map[float]:
    """The map."""
    gains = (0.1, 0.8, 0.9) if quick else (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.85, 0.9, 0.95)
    divisions = (8, 1) if quick else (64, 32, 16, 8, 4, 2, 1)
    return Map(
        "controller",
        "Sampled attitude controller: gain against steps in a sampling period",
        f"A controller of natural frequency ω_n and damping ratio {DAMPING_RATIO:g} turns a body by 2.5 rad. It "
        f"commands a torque every T = {PERIOD:g} s, {COMMANDS} times. The true loop is stable for ω_n T < 1: in every "
        "row. Truth: the same controller, with the motion between two commands integrated by dop853 at rtol 1e-13.",
        "gain ω_n T",
        "step size [s]",
        gains,
        [PERIOD / n for n in divisions],
        case,
        "ω_n h",
        lambda gain, h: gain * h / PERIOD,
    )


def case(gain: float, h: float) -> Case:
    """The loop with ω_n T = gain and a step [s] that divides the period."""
    divisions = round(PERIOD / h)

    def simulation(integrator: str) -> Simulation:
        made = Simulation(BODY, START, rate=divisions / PERIOD, integrator=integrator)
        command(made, gain)
        return made

    return Case(simulation, lambda made: list(states(made, gain, divisions)), truth(gain), SCALE)


def command(simulation: Simulation, gain: float) -> None:
    """Hold the torque that the controller commands now."""
    w, x, y, z = simulation.pose[3:7]
    sign = math.copysign(1.0, w)
    frequency = gain / PERIOD
    error, rates = (sign * x, sign * y, sign * z), simulation.motion[16:19]
    simulation.set_wrench(
        Wrench(
            torque_body=[
                -moment * 2.0 * frequency * (frequency * e + DAMPING_RATIO * rate)
                for moment, e, rate in zip(BODY.principal_moments.tolist(), error, rates, strict=True)
            ]
        )
    )


def states(simulation: Simulation, gain: float, divisions: int) -> Iterator[Floats]:
    """The state at the end of each period."""
    for _ in range(COMMANDS):
        command(simulation, gain)
        simulation.step(divisions)
        yield simulation.state.values[:13]


@functools.cache
def truth(gain: float) -> Floats:
    """The states of the loop whose motion between two commands is integrated finely, shape (COMMANDS, 13)."""
    fine = Simulation(BODY, START, rate=2.0 / PERIOD, **FINE)
    return np.array(list(states(fine, gain, 2)))
