"""The problems on which methods are compared, with their reference solutions, and the errors of an end state.

The problems themselves are in bench/reference/make_report.py. There the centre of mass is the body frame's origin and
the body axes are principal axes.
"""

import math
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from ..effects.drag import NO_DRAG, Drag
from ..kernels.arrays import Floats, Vector
from ..values.body import Body
from ..values.state import State
from ..values.wrench import Wrench
from .reference import load

TITLES = {  # in the order of the page
    "tumble": "Torque-free tumble, 100 s",
    "symmetric_top": "Heavy symmetric top, 20 s",
    "asymmetric_top": "Heavy asymmetric top, 10 s",
    "body_wrench": "Constant wrench in body axes, 60 s",
    "commands": "Random commands at 100 Hz, 5 s",
    "fast_spin": "Inertia 1:1000 at 500 rad/s, 2 s",
    "free_fall": "Free fall, 10 s",
    "damped_vehicle": "Vehicle with drag, 10 s",
}


@dataclass(frozen=True)
class End:
    """State of the body at the end of a run: position and velocity [world], (w, x, y, z), ω [rad/s, body axes]."""

    position: Vector
    orientation: Vector
    velocity: Vector
    angular_velocity: Vector


@dataclass(frozen=True)
class Problem:
    """Body, start, what acts, and the end state to 35 digits. Each of ``wrenches`` is held for ``hold`` s in turn."""

    name: str
    about: str
    body: Body
    initial: State
    gravity: tuple[float, ...]
    drag: Drag
    wrenches: tuple[Wrench, ...]
    hold: float
    digits: dict[str, list[str]]

    @property
    def title(self) -> str:
        """A few words, for pictures."""
        return TITLES[self.name]

    @property
    def dragged(self) -> bool:
        """Whether drag acts."""
        return any(self.drag.values)

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return len(self.wrenches) * self.hold

    @cached_property
    def end(self) -> dict[str, Floats]:
        """The reference end state, as long doubles."""
        return {name: _long(values) for name, values in self.digits.items() if name != "time"}

    @cached_property
    def fastest_rate(self) -> float:
        """Larger spin of start and end [rad/s], which sets the scale of the steps that are tried."""
        return max(math.hypot(*self.initial.angular_velocity), float(np.linalg.norm(self.end["angular_velocity"])))


@cache
def problem(name: str) -> Problem:
    """The problem of that name. Raises ValueError, naming those there are, for any other."""
    if name not in TITLES:
        raise ValueError(f"problem {name!r} is not known; choose one of {', '.join(TITLES)}")
    stored = load.stored(load.REPORT)["problems"][name]
    data = load.as_numbers(stored)
    wrenches = tuple(_wrench(held) for held in data["wrenches"])
    return Problem(
        name,
        data["about"],
        Body(data["body"]["mass"], data["body"]["inertia"]),
        State(*(data["initial"][part] for part in ("position", "orientation", "velocity", "angular_velocity"))),
        tuple(data["gravity"].tolist()),
        Drag(**data["drag"]) if "drag" in data else NO_DRAG,
        wrenches,
        data["wrenches"][0]["until"],
        stored["samples"][-1],
    )


def _wrench(held: dict[str, Any]) -> Wrench:
    parts = {part: held[part].tolist() for part in ("force_body", "torque_body", "force_world", "torque_world")}
    return Wrench(**parts, points=[(point, force) for point, force in held["points"].tolist()])


def errors(problem: Problem, end: End) -> dict[str, float | None]:
    """Errors of an end state: attitude [rad]; position, momentum and energy relative to the reference; and ``error``.

    Position is relative to the distance from start to end, momentum is the worse of P and L, energy is the kinetic one.
    ``error`` is the worse of attitude and position: what a method is judged by. None for what is not finite.
    """
    q, w, v = (_long(values) for values in (end.orientation, end.angular_velocity, end.velocity))
    true = problem.end
    with np.errstate(all="ignore"):
        unit = q / np.sqrt(q @ q)
        way = true["position"] - problem.initial.position
        found = {
            "attitude": _angle_between(unit, true["orientation"]),
            "position": _relative(_long(end.position), true["position"], way),
            "momentum": max(
                _relative(problem.body.mass * v, true["momentum"], true["momentum"]),
                _relative(_turned(unit, problem.body.inertia @ w), true["angular_momentum"], true["angular_momentum"]),
            ),
            "energy": _relative(_energies(problem.body, v, w), *[_energies(problem.body, *_motion(true))] * 2),
        }
        found["error"] = max(found["attitude"], found["position"])
    return {name: float(value) if np.isfinite(value) else None for name, value in found.items()}


def _long(values: Any) -> Floats:
    return np.array([np.longdouble(value) for value in values])


def _motion(true: dict[str, Floats]) -> tuple[Floats, Floats]:
    return true["velocity"], true["angular_velocity"]


def _energies(body: Body, v: Floats, w: Floats) -> Floats:
    return np.array([body.mass * (v @ v) + w @ body.inertia @ w]) / 2


def _relative(found: Floats, true: Floats, scale: Floats) -> float:
    """|found − true| / |scale|; absolute where the scale is zero."""
    size = np.sqrt(scale @ scale)
    difference = found - true
    return float(np.sqrt(difference @ difference) / (size if size > 0.0 else 1.0))


def _angle_between(p: Floats, q: Floats) -> float:
    """Angle [rad] of the turn p̄ q, to round-off for small ones too."""
    vector = p[0] * q[1:] - q[0] * p[1:] - np.cross(p[1:], q[1:])
    return 2.0 * np.arctan2(np.sqrt(vector @ vector), abs(p @ q))


def _turned(q: Floats, v: Floats) -> Floats:
    once = np.cross(q[1:], v)
    return v + 2.0 * (q[0] * once + np.cross(q[1:], once))
