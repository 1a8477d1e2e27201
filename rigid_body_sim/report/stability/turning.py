"""Extreme bodies and spins: angle turned in a step against spin, mass, ratio of moments, triangle's edge, separatrix.

A body spins, under a torque in body axes and a force in world axes where a map has them. The truth of the rotation are
solutions of mpmath with more than 30 digits (reference/turning.json, made by bench/reference/make_turning.py), the one
of the translation is a parabola. Spin and mass only set the scales: for them the truth is one solution, scaled.
"""

import functools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...kernels.arrays import Floats
from ...simulation import Simulation
from ...values.body import Body
from ...values.state import State
from ...values.wrench import Wrench
from .maps import Map
from .outcome import Case, Scale

FILE = Path(__file__).parents[1] / "reference" / "turning.json"
ACCELERATION = (0.3, -0.2, 0.1)  # force over mass, in units of spin² times one metre
QUICK_ANGLES, ANGLES = (0.01, 1.0, 100.0), (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0)  # h |ω| [rad]

# name: title, text, label of the rows
_MAPS = {
    "spin": (
        "Spin: from a turn in months to a million radians a second",
        "A body of three different moments under a torque and a force that grow with the square of the spin.",
        "spin [rad/s]",
    ),
    "mass": (
        "Mass: from 1e-12 kg to 1e12 kg",
        "The body of the map of spins at 1 rad/s, with moments, torque and force that grow with the mass.",
        "mass [kg]",
    ),
    "inertia": (
        "Thin bodies: ratio of the moments up to 1 : 1e6",
        "A rod of moments 1, r, r under a torque, spinning about an axis next to its long one.",
        "ratio of the moments r",
    ),
    "edge": (
        "Flat bodies: moments at the triangle's edge",
        "A body of moments 1, 2 and 3 − δ under a torque: at δ = 0 all of its mass lies in a plane.",
        "distance to the edge δ",
    ),
    "separatrix": (
        "Next to the separatrix: spin about the middle axis",
        "A body without torque that spins about its middle axis but for a share ε. It turns over, and the smaller ε "
        "is, the more every error before counts afterwards.",
        "spin off the middle axis ε",
    ),
}
NAMES = tuple(_MAPS)
_EVERY = {"spin": (1e-6, 1e-3, 1.0, 1e3, 1e6), "mass": (1e-12, 1e-6, 1.0, 1e6, 1e12)}


@functools.cache
def solutions() -> dict[str, dict[str, dict[str, Any]]]:
    """What make_turning.py found, by map and row."""
    return json.loads(FILE.read_text(encoding="utf-8"))


def build(quick: bool, name: str) -> Map[float]:
    """The map of that name, one of NAMES."""
    title, text, label = _MAPS[name]
    rows = list(_EVERY.get(name) or map(float, solutions()[name]))
    rows = [rows[0], rows[len(rows) // 2], rows[-1]] if quick else rows
    angles = QUICK_ANGLES if quick else ANGLES
    text = f"{text} It turns by 100 rad. Truth: mpmath, more than 30 digits."
    return Map(
        name,
        title,
        text,
        label,
        "angle turned in a step [rad]",
        rows,
        angles,
        functools.partial(case, name),
        "h |ω|",
        lambda row, angle: angle,
    )


def case(name: str, row: float, angle: float) -> Case:
    """The run of the map ``name`` at a row, with steps that turn the body by ``angle`` [rad] at its first spin."""
    scaled = name in _EVERY
    found = solutions()["common"]["1.0"] if scaled else solutions()[name][repr(row)]
    spin, mass = row if name == "spin" else 1.0, row if name == "mass" else 1.0
    body = Body(mass, mass * np.array(found["moments"]))
    w_body = spin * np.array(found["rates"])
    first, span = float(np.linalg.norm(w_body)), found["time"] / spin
    steps = max(1, round(span * first / angle))
    force = mass * spin**2 * np.array(ACCELERATION)
    wrench = Wrench(torque_body=(mass * spin**2 * np.array(found["torque"])).tolist(), force_world=force.tolist())

    def simulation(integrator: str) -> Simulation:
        made = Simulation(body, State(angular_velocity=w_body), rate=steps / span, integrator=integrator)
        made.set_wrench(wrench)
        return made

    def follow(made: Simulation) -> Sequence[Floats]:
        made.step(steps)
        return [made.state.values[:13]]

    velocity = spin * found["time"] * np.array(ACCELERATION)
    end = np.array(found["end"], float)
    true = np.concatenate((0.5 * span * velocity, end[:4], velocity, spin * end[4:]))
    speed = float(np.linalg.norm(velocity))
    return Case(simulation, follow, true[None, :], Scale(span * speed, 1.0, speed, first))
