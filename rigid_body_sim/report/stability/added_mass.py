"""Added mass: its ratio to the body's own against the step size.

A body with added mass of every kind, its centre of mass beside the origin, is thrown into a current, under gravity,
lift, linear drag and a wrench. Truth: solutions of mpmath with more than 30 digits (reference/added_mass.json, made by
bench/reference/make_added_mass.py).
"""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...effects.added_mass import AddedMass
from ...effects.drag import Drag
from ...effects.fluid import Fluid
from ...kernels.arrays import Floats
from ...simulation import Simulation
from ...values.body import Body
from ...values.state import State
from ...values.wrench import Wrench
from ..reference import load
from .maps import Map
from .outcome import Case, Scale


@functools.cache
def solutions() -> dict[str, dict[str, Any]]:
    """What make_added_mass.py found, by ratio; and the scene."""
    return load.stored("added_mass.json")


def build(quick: bool) -> Map[str]:
    """The map; steps are the span divided by whole numbers."""
    scene, *ratios = solutions()
    span = solutions()[scene]["time"]
    return Map(
        "added_mass",
        "Added mass: its ratio to the mass against step size",
        "A body with added mass of every kind (21 numbers), about so many times its own, is thrown into a current, "
        f"under gravity, lift, linear drag and a wrench; {span:g} s are simulated. Truth: mpmath, more than 30 digits.",
        "ratio of the added mass",
        "step size [s]",
        [ratios[0], ratios[-3], ratios[-1]] if quick else ratios,
        [span / n for n in ((200, 20, 2) if quick else (2000, 600, 200, 60, 20, 6, 2))],
        case,
        "h [s]",
        lambda ratio, h: h,
    )


def case(ratio: str, h: float) -> Case:
    """The run of a ratio, with a step [s]."""
    scene, found = solutions()["scene"], solutions()[ratio]
    steps = round(scene["time"] / h)

    def simulation(integrator: str) -> Simulation:
        made = Simulation(
            Body(scene["mass"], scene["inertia"], scene["center_of_mass"]),
            State((0.0, 0.0, 0.0), scene["orientation"], scene["velocity"], scene["angular_velocity"]),
            rate=1.0 / h,
            integrator=integrator,
            gravity=scene["gravity"],
            forces=[(scene["lift_point"], scene["lift"])],
            drag=Drag(linear=scene["drag"], angular_linear=scene["angular_drag"]),
            fluid=Fluid(scene["fluid_velocity"]),
            added_mass=AddedMass(tuple(found["added_mass"])),
        )
        made.set_wrench(Wrench(force_body=scene["force_body"], torque_body=scene["torque_body"]))
        return made

    def follow(made: Simulation) -> Sequence[Floats]:
        made.step(steps)
        return [made.state.values[:13]]

    speed, spin = np.linalg.norm(scene["velocity"]), np.linalg.norm(scene["angular_velocity"])
    scale = Scale(float(speed) * scene["time"], 1.0, float(speed), float(spin))
    return Case(simulation, follow, np.array(found["end"], float)[None, :], scale)
