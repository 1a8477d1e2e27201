"""Control laws for what actuators drive: a drone that hovers, a satellite that points, a vehicle that holds a pose.

Each says which wrench the body needs, as springs and dampers of a given natural frequency would pull it; an Allocation
says which commands make that wrench. What they know of the plant is its scene. No ROS.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..kernels.arrays import Floats, Vector
from ..scene import attitude, schema
from ..scene.loader import Scene
from ..terms import Terms
from ..values import rotation
from ..values.parameter import Parameter
from .allocation import Allocation, allocation
from .control import PointingLaw, shortened

_UP = np.array((0.0, 0.0, 1.0))


class Sensed(NamedTuple):
    """What pose and twist of one stamp say of the body frame.

    ``position`` of its origin [m, world axes], ``orientation`` (w, x, y, z) body → world, ``v_body``, the velocity of
    its origin [m/s], and ``w_body`` [rad/s], both in body axes.
    """

    position: Vector
    orientation: Vector
    v_body: Vector
    w_body: Vector


class Law(Protocol):
    """Says which wrench a body needs."""

    def wrench(self, sensed: Sensed) -> Floats:
        """Force [N] and torque about the centre of mass [N m], body axes, shape (6,)."""


@dataclass(frozen=True)
class PositionLaw:
    """a = −ω_n² e − 2 ζ ω_n v, with e = position − ``target`` [m]: an oscillator along each axis.

    The velocity ω_n e / 2 ζ that the first term asks for is no longer than ``max_speed`` [m/s].
    """

    target: Floats
    natural_frequency: float  # [rad/s]
    damping_ratio: float
    max_speed: float

    def acceleration(self, position: Floats, velocity: Floats) -> Floats:
        """Acceleration [m/s²], shape (3,), for a position [m] and a velocity [m/s], all in world axes."""
        rate = 2.0 * self.damping_ratio * self.natural_frequency
        wanted = shortened((self.target - position) * (self.natural_frequency**2 / rate), self.max_speed)
        return rate * (wanted - velocity)


@dataclass(frozen=True)
class Rest:
    """What keeps a body at rest: against gravity, and forces that always act."""

    terms: Terms

    def force(self, acceleration: Floats) -> Floats:
        """Force [N], world axes, for an acceleration [m/s²]."""
        others = sum((np.array(force) for _, force in self.terms.given["forces"]), np.zeros(3))
        return np.asarray(self.terms.body.mass * (acceleration - np.array(self.terms.gravity)) - others)

    def torque(self, orientation: Vector) -> Floats:
        """Torque about the centre of mass [N m], body axes."""
        arms = ((np.subtract(p, self.terms.body.center_of_mass), force) for p, force in self.terms.given["forces"])
        return -sum((np.cross(arm, rotation.rotate_back(orientation, force)) for arm, force in arms), np.zeros(3))


@dataclass(frozen=True)
class Pointing:
    """Turns to an attitude by torques alone."""

    attitude: PointingLaw

    def wrench(self, sensed: Sensed) -> Floats:
        """See Law."""
        return np.concatenate((np.zeros(3), self.attitude.torque(sensed.orientation, sensed.w_body)))


@dataclass(frozen=True)
class Holding:
    """Holds position and attitude with forces and torques in every direction."""

    place: PositionLaw
    attitude: PointingLaw
    rest: Rest

    def wrench(self, sensed: Sensed) -> Floats:
        """See Law."""
        torque = self.attitude.torque(sensed.orientation, sensed.w_body) + self.rest.torque(sensed.orientation)
        force = self.rest.force(_acceleration(self.place, sensed))
        return np.concatenate((rotation.rotate_back(sensed.orientation, force), torque))


@dataclass(frozen=True)
class Hovering:
    """Holds position and heading with a thrust along the body's z axis: it leans the way it has to be pushed.

    That is the attitude that is nearest to the heading and points z along the force (Mellinger & Kumar, ICRA 2011,
    section IV); the horizontal force is at most ``max_slope`` times the vertical one.
    """

    place: PositionLaw
    attitude: PointingLaw  # at the heading
    rest: Rest
    max_slope: float

    def wrench(self, sensed: Sensed) -> Floats:
        """See Law."""
        force = self.rest.force(_acceleration(self.place, sensed))
        force[2] = max(0.0, force[2])
        force[:2] = shortened(force[:2], self.max_slope * force[2])
        leaning = replace(self.attitude, target=rotation.multiply(_leaning(force), self.attitude.target))
        thrust = force @ rotation.rotate(sensed.orientation, _UP)
        return np.concatenate((thrust * _UP, leaning.torque(sensed.orientation, sensed.w_body)))


def _acceleration(place: PositionLaw, sensed: Sensed) -> Floats:
    return place.acceleration(np.array(sensed.position), rotation.rotate(sensed.orientation, sensed.v_body))


def _leaning(force: Floats) -> Floats:
    """The shortest turn that points z along a force [N], none of it downwards, as a quaternion; for no force none."""
    x, y, z = force.tolist()
    return rotation.normalize((math.hypot(x, y, z) + z, -y, x, 0.0)) if z > 0.0 else np.array((1.0, 0.0, 0.0, 0.0))


# By what drives the plant ---------------------------------------------------------------------------------------------


class Kind(NamedTuple):
    """How a plant with actuators of one type is controlled, and by which parameters."""

    parameters: tuple[Parameter, ...]
    needed: tuple[bool, ...]  # of the six numbers of a wrench
    make: Callable[[Scene, Mapping[str, Any]], Law]


def _oscillator(name: str, natural_frequency: float) -> tuple[Parameter, ...]:
    """Rows of a law that makes an oscillator of ``name``."""
    return (
        Parameter(
            f"{name}.natural_frequency", float, natural_frequency, "Of the loop, near the target.", "rad/s", above=0.0
        ),
        Parameter(f"{name}.damping_ratio", float, 1.0, "Of the same; 1 = no overshoot.", above=0.0),
    )


def _position(natural_frequency: float, max_speed: float) -> tuple[Parameter, ...]:
    where = "Where to hold the origin, world axes; empty = where it is at the start of the plant's scene."
    return (
        Parameter("target.position", tuple, (), where, "m", length=3, optional=True),
        *_oscillator("position", natural_frequency),
        Parameter("position.max_speed", float, max_speed, "On the way there.", "m/s", above=0.0),
    )


def _turning(natural_frequency: float, max_rate: float) -> tuple[Parameter, ...]:
    return (
        *schema.attitude("target", "the attitude to hold, body to world"),
        *_oscillator("attitude", natural_frequency),
        Parameter("attitude.max_rate", float, max_rate, "On the way there.", "rad/s", above=0.0),
    )


def _place(scene: Scene, values: Mapping[str, Any]) -> PositionLaw:
    names = ("natural_frequency", "damping_ratio", "max_speed")
    frequency, damping, speed = (values[f"position.{name}"] for name in names)
    target = values["target.position"] or scene["initial.position"]
    return PositionLaw(np.array(target), frequency, damping, speed)


def _attitude(scene: Scene, values: Mapping[str, Any]) -> PointingLaw:
    names = ("natural_frequency", "damping_ratio", "max_rate")
    frequency, damping, rate = (values[f"attitude.{name}"] for name in names)
    target = rotation.normalize(attitude.quaternion(values, "target"))
    return PointingLaw(target, scene.body().inertia, frequency, damping, max_rate=rate)


def _hover(scene: Scene, values: Mapping[str, Any]) -> Law:
    names = ("attitude.natural_frequency", "heading.natural_frequency", "attitude.damping_ratio", "target.yaw")
    tilt, heading, damping, yaw = (values[name] for name in names)
    target = rotation.from_axis_angle(_UP, yaw)
    turning = PointingLaw(target, scene.body().inertia, np.array((tilt, tilt, heading)), damping)
    return Hovering(_place(scene, values), turning, Rest(scene.terms()), math.tan(values["max_tilt"]))


def _hold(scene: Scene, values: Mapping[str, Any]) -> Law:
    return Holding(_place(scene, values), _attitude(scene, values), Rest(scene.terms()))


def _point(scene: Scene, values: Mapping[str, Any]) -> Law:
    return Pointing(_attitude(scene, values))


_HEADING = (
    Parameter("target.yaw", float, 0.0, "Heading to hold.", "rad"),
    Parameter(
        "heading.natural_frequency",
        float,
        1.5,
        "Of the turn about z, slow because rotors turn a body far more as they speed up than at speed.",
        "rad/s",
        above=0.0,
    ),
    Parameter("max_tilt", float, 0.5, "Of the wanted thrust from the vertical.", "rad", above=0.0, most=1.5),
)
KINDS = {
    "rotor": Kind(
        (*_position(1.5, 1.0), *_oscillator("attitude", 12.0), *_HEADING),
        (False, False, True, True, True, True),
        _hover,
    ),
    "wheel": Kind(_turning(0.3, 0.1), (False, False, False, True, True, True), _point),
    "thruster": Kind((*_position(1.0, 0.5), *_turning(2.0, 0.5)), (True,) * 6, _hold),
}
PLANT = Parameter(
    "plant", str, "", "The scene of the plant: a parameter file of rigid_body_node.", optional=True, file=True
)


@dataclass(frozen=True)
class Controller:
    """A law, and which commands make the wrench that it asks for."""

    law: Law
    allocation: Allocation

    def commands(self, sensed: Sensed) -> list[float]:
        """Commands [N, rad/s or N m], in the order of the plant's actuators. Raises ValueError for no state."""
        if not all(map(math.isfinite, (*sensed.position, *sensed.v_body))):
            raise ValueError(f"position {list(sensed.position)} or velocity {list(sensed.v_body)} is not finite")
        return self.allocation.commands(self.law.wrench(sensed)).tolist()


def kind_of(scene: Scene) -> Kind:
    """How the plant of a scene is controlled. Raises ValueError for one without actuators, or of several types."""
    types = sorted({one.type for one in scene.effect("actuators")})
    if len(types) != 1:
        found = f"has actuators of the types {', '.join(types)}" if types else "has no actuators"
        raise ValueError(f"the plant {found}; give one with actuators of one type: {', '.join(KINDS)}")
    return KINDS[types[0]]


def controller(scene: Scene, values: Mapping[str, Any]) -> Controller:
    """The controller of a scene's plant, with the parameters of its kind. Raises ValueError for what cannot be done."""
    kind, terms = kind_of(scene), scene.terms()
    return Controller(kind.make(scene, values), allocation(terms.given["actuators"], terms.body, kind.needed))
