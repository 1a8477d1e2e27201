"""Actuators: thrusters, rotors and reaction wheels, which follow a command exactly, with a lag and after a delay.

A *thruster* gives a force u [N] along its axis. A *rotor* that turns at n [rad/s] gives the thrust k n² along its axis
and, against its turning, the torque k_q n² (Mahony, Kumar & Corke, IEEE Robotics & Automation Magazine 19 (2012) 20,
eqs. 5 and 6); its spin makes it a gyroscope. A *wheel* is pushed by its motor with u [N m] and the body pushed back:
the angular momentum of both together stays. How they follow their commands, and what that does, is in kernels.drive.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..kernels import drive
from ..kernels.arrays import Floats, Vector
from ..values import rotation
from ..values.body import Body
from ..values.parameter import NAMES, Parameter, shown
from ..values.wrench import ZERO, number, three_finite
from .base import DriveEffect

TYPES = ("thruster", "rotor", "wheel")
UNITS = {"thruster": "N", "rotor": "rad/s", "wheel": "N m"}  # of a command
MOST_STEPS_LATE = 100_000
SHORTEST_LAG = 1e-12  # s
LARGEST = 1e60  # of any number: no thrust, torque or spin that is made of them is beyond the range of floats
_OF_COMMAND = "N, rad/s or N m"
_UP = (0.0, 0.0, 1.0)
_NUMBERS = {  # smallest value, and what of it a message says
    "time_constant": "s",
    "delay": "s",
    "thrust_coefficient": "N s²",
    "torque_coefficient": "N m s²",
    "inertia": "kg m²",
    "max_speed": "rad/s",
}


@dataclass(frozen=True)
class Actuator:
    """One actuator, by the name under which it is commanded.

    ``position`` [m, body axes from the body frame's origin], ``axis`` (body axes; of any length), ``min`` and ``max``
    of the command: a force [N] of a thruster, a speed [rad/s] of a rotor, a torque [N m] of a wheel's motor. The level
    follows the command with ``time_constant`` [s], after ``delay`` [s]. Of a rotor: ``thrust_coefficient`` [N s²],
    ``torque_coefficient`` [N m s²], and ``direction``, "ccw" or "cw", seen from the tip of its axis. Of rotors and
    wheels: ``inertia`` [kg m²] about their axis, which is no part of the body's own. Of a wheel: ``max_speed`` [rad/s]
    about its axis in inertial space, 0 for none. ``initial``: force [N] or speed [rad/s] at the start.

    Raises ValueError for a value that is not finite or not in range (1e60 at most), and for one that its type does not
    have.
    """

    name: str
    type: str
    min: float
    max: float
    position: Vector = ZERO
    axis: Vector = _UP
    time_constant: float = 0.0
    delay: float = 0.0
    thrust_coefficient: float = 0.0
    torque_coefficient: float = 0.0
    direction: str = "ccw"
    inertia: float = 0.0
    max_speed: float = 0.0
    initial: float = 0.0

    def __post_init__(self) -> None:
        if self.type not in TYPES:
            raise ValueError(f"{self}: type {shown(self.type)} is not known; give one of {', '.join(TYPES)}")
        if not isinstance(self.name, str) or not self.name.strip():
            raise ValueError(f"{self}: its name is no text; give one, by which it is known")
        if self.direction not in ("ccw", "cw"):
            raise ValueError(f"{self}: direction {shown(self.direction)} is not known; give ccw or cw")
        for name in ("min", "max", "initial", *_NUMBERS):
            object.__setattr__(self, name, self._finite(name))
        for name in ("position", "axis"):
            object.__setattr__(self, name, three_finite(getattr(self, name), f"{self}: {name}"))
        if max(map(abs, self.position)) > LARGEST:
            raise ValueError(f"{self}: position {list(self.position)} is too far away; give at most {LARGEST:g} m")
        self._check_limits()
        self._check_what_its_type_has()

    def __str__(self) -> str:
        return f"actuator {shown(self.name)}"

    def _finite(self, name: str) -> float:
        value = number(getattr(self, name), f"{self}: {name}")
        if not math.isfinite(value) or (name in _NUMBERS and value < 0.0):
            least = " of at least 0" if name in _NUMBERS else ""
            raise ValueError(f"{self}: {name} {value:g} is not a finite number{least}")
        if abs(value) > LARGEST:
            raise ValueError(f"{self}: {name} {value:g} is too large; give at most {LARGEST:g}")
        return value

    def _check_limits(self) -> None:
        if not self.min <= self.max:
            raise ValueError(f"{self}: min {self.min:g} is above max {self.max:g}; give the smaller one as min")
        if self.type == "rotor" and self.min < 0.0:
            raise ValueError(f"{self}: min {self.min:g} is a speed below 0; give at least 0, and direction cw or ccw")
        if self.type == "rotor" and self.initial < 0.0:
            raise ValueError(f"{self}: initial {self.initial:g} is a speed below 0; give at least 0")
        if self.initial != 0.0 and self.time_constant == 0.0 and self.type != "wheel":
            raise ValueError(
                f"{self}: initial {self.initial:g} without a time_constant: it is at once what is commanded"
            )
        if 0.0 < self.time_constant < SHORTEST_LAG:
            raise ValueError(
                f"{self}: time_constant {self.time_constant:g} s is shorter than {SHORTEST_LAG:g} s; give 0, for none"
            )
        if not any(self.axis):
            raise ValueError(f"{self}: axis {list(self.axis)} has no direction; give three numbers, not all 0")

    def _check_what_its_type_has(self) -> None:
        if self.type == "wheel" and self.inertia == 0.0:
            raise ValueError(f"{self}: a wheel has inertia; give its moment about its axis in kg m²")
        if self.type == "rotor" and self.thrust_coefficient == self.torque_coefficient == self.inertia == 0.0:
            raise ValueError(f"{self}: a rotor without thrust_coefficient, torque_coefficient and inertia does nothing")
        others: dict[str, tuple[str, ...]] = {
            "thruster": ("thrust_coefficient", "torque_coefficient", "inertia", "max_speed")
        }
        others |= {"rotor": ("max_speed",), "wheel": ("thrust_coefficient", "torque_coefficient")}
        for name in others[self.type]:
            if getattr(self, name) != 0.0:
                raise ValueError(f"{self}: a {self.type} has no {name}; leave it out")

    @property
    def most_spin(self) -> float:
        """Angular momentum [N m s] of a wheel at its top speed; 0 of what is no wheel."""
        if self.type != "wheel":
            return 0.0
        return self.inertia * self.max_speed if self.max_speed > 0.0 else math.inf

    def limited(self, command: float) -> float:
        """The command, or the limit that it is beyond."""
        return min(max(command, self.min), self.max)


def wrench_of(given: Actuator, body: Body) -> Floats:
    """Force [N] and torque about the centre of mass [N m], principal axes, by a force, or a rotor's speed squared."""
    axis, arm = _axis(given, body), _principal(np.subtract(given.position, body.center_of_mass), body)
    if given.type == "wheel":
        return np.zeros(6)
    if given.type == "thruster":
        return np.concatenate((axis, np.cross(arm, axis)))
    drag = given.torque_coefficient * (1.0 if given.direction == "ccw" else -1.0)
    thrust = given.thrust_coefficient * axis
    return np.concatenate((thrust, np.cross(arm, thrust) - drag * axis))


def _axis(given: Actuator, body: Body) -> Floats:
    """The unit vector along its axis, principal axes."""
    axis = np.array(given.axis) / max(map(abs, given.axis))  # neither its square nor its length can overflow then
    return _principal(axis / np.linalg.norm(axis), body)


def _principal(vector: Vector, body: Body) -> Floats:
    return rotation.rotate_back(body.q_body_principal, np.array(vector, float))


def _four(vector: Floats) -> Floats:
    """As the row (x, y, z, x)."""
    return vector[[0, 1, 2, 0]]


def _numbers(given: Actuator, body: Body) -> Floats:
    """What it does by level: see kernels.drive."""
    numbers, wrench = np.zeros(drive.SIZE), wrench_of(given, body)
    axis = _four(_axis(given, body))
    at = drive.SQUARE if given.type == "rotor" else drive.LINEAR
    numbers[at : at + 8] = *_four(wrench[:3]), *_four(wrench[3:])
    if given.type == "rotor":
        turning = given.inertia if given.direction == "ccw" else -given.inertia
        numbers[drive.MOMENTUM : drive.MOMENTUM + 4] = turning * axis
    if given.type == "wheel":
        numbers[drive.AXIS : drive.AXIS + 4] = axis
    return numbers


def _padded(count: int) -> int:
    """The next multiple of four."""
    return -(-count // 4) * 4


def _slots(actuators: Sequence[Actuator]) -> Floats:
    """A slot for each λ of what they do, each once: see kernels.drive."""
    lagging = [(i, one) for i, one in enumerate(actuators) if one.time_constant > 0.0]
    single = [(1.0 / one.time_constant, 0, i) for i, one in lagging]
    double = [(2.0 / one.time_constant, 1, i) for i, one in lagging if one.type == "rotor"]
    rates = list(dict.fromkeys(rate for rate, _, _ in (*single, *double)))
    slots, count = np.zeros((len(rates), drive.SHARES + 2 * _padded(len(actuators)))), _padded(len(actuators))
    slots[:, 0] = rates
    for rate, which, i in (*single, *double):
        slots[rates.index(rate), drive.SHARES + which * count + i] = 1.0
    return slots.reshape(-1)


def _row(actuators: tuple[Actuator, ...], body: Body) -> Floats:
    count, slots = _padded(len(actuators)), _slots(actuators)
    head, lists, each = np.zeros(drive.LISTS), np.zeros((drive.N_LISTS, count)), np.zeros((count, drive.SIZE))
    head[drive.COUNT], head[drive.SLOTS] = count, len(slots) // (drive.SHARES + 2 * count)
    head[drive.TWISTS] = any(wrench_of(one, body)[3:].any() for one in actuators)
    head[drive.PLAIN] = all(one.delay == 0.0 and one.type != "wheel" for one in actuators)
    for i, one in enumerate(actuators):
        lists[drive.TIME_CONSTANTS, i], lists[drive.LAGGING, i] = one.time_constant, one.time_constant > 0.0
        lists[drive.MOST_SPINS, i], each[i] = one.most_spin, _numbers(one, body)
    kept = np.zeros(drive.KEPT * count)
    return np.concatenate((head, lists.reshape(-1), each.reshape(-1), slots, kept))


def _memory(actuators: tuple[Actuator, ...], h: float) -> Floats:
    """As it is at the start: at the initial level, and commanded to be at 0, or as near to it as the limits allow."""
    count, lines = _padded(len(actuators)), []
    lists = np.zeros((drive.N_MEMORY, count))
    end = lists.size
    for i, one in enumerate(actuators):
        late, offset = _lateness(one, h)
        command = one.limited(0.0)
        lists[[drive.COMMANDS, drive.ARRIVING, drive.TARGETS], i] = command
        lists[drive.LEVELS, i] = command if one.type == "wheel" else one.initial
        lists[drive.SPINS, i] = one.inertia * one.initial if one.type == "wheel" else 0.0
        lists[drive.OFFSETS, i], lists[drive.LINES, i], lists[drive.LENGTHS, i] = offset, end, late
        if late:
            lines.append(np.full(late + 1, command))
            end += late + 1
    return np.concatenate((lists.reshape(-1), *lines))


def _lateness(one: Actuator, h: float) -> tuple[int, float]:
    """Whole steps of h [s] and the rest [s] of a delay. Raises ValueError for too many."""
    steps = one.delay / h
    if steps > MOST_STEPS_LATE:
        raise ValueError(
            f"{one}: delay {one.delay:g} s is more than {MOST_STEPS_LATE} steps of {h:g} s; give a shorter one"
        )
    late = math.floor(steps + 1e-6)
    offset = one.delay - late * h
    return late, offset if offset > 1e-6 * h else 0.0


def checked(given: Any) -> tuple[Actuator, ...]:
    """Actuators as they are kept. Raises TypeError for what is none, ValueError for a name that is there twice."""
    try:
        actuators = tuple(given)
    except TypeError:
        raise TypeError(f"actuators: {given!r} is no sequence; give a sequence of Actuator") from None
    for one in actuators:
        if not isinstance(one, Actuator):
            raise TypeError(f"actuators: {one!r} is no Actuator; give a sequence of Actuator")
    names = [one.name for one in actuators]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"actuators: the name {shown(name)} is there twice; give each its own")
    return actuators


def _row_of(name: str, *rest: Any, **options: Any) -> Parameter:
    return Parameter(f"actuators.<name>.{name}", *rest, **options)


EFFECT = DriveEffect(
    name="actuators",
    make=Actuator,
    zero=Actuator("none", "thruster", 0.0, 0.0),
    example=Actuator(
        "one", "rotor", 0.0, 900.0, (0.2, -0.1, 0.05), (0.1, 0.0, 1.0), 0.05, 0.0125, 2e-5, 3e-7, "cw", 2e-4, 0.0, 600.0
    ),
    many=True,
    check=checked,
    acts=lambda one: any((one.min, one.max, one.initial)),
    left_out="actuators",
    order="actuators.names",
    parameters=(
        Parameter(
            "actuators.names", NAMES, (), "Actuators in the order of the numbers in a command; empty = there are none."
        ),
        _row_of(
            "type",
            str,
            "thruster",
            "What it is, and what a command means: a force [N], a speed [rad/s], a torque [N m].",
            choices=TYPES,
            required=True,
        ),
        _row_of("position", tuple, ZERO, "Where it is, from the body frame's origin, body axes.", "m", length=3),
        _row_of("axis", tuple, _UP, "Direction of its force, or of its spin, body axes; of any length.", length=3),
        _row_of(
            "min", float, 0.0, "Least command; a smaller one counts as this.", _OF_COMMAND, required=True, dynamic=True
        ),
        _row_of(
            "max",
            float,
            10.0,
            "Greatest command; a larger one counts as this.",
            _OF_COMMAND,
            required=True,
            dynamic=True,
        ),
        _row_of("time_constant", float, 0.0, "Of the lag with which it follows; 0 = at once.", "s", least=0.0),
        _row_of(
            "delay", float, 0.0, "Time before a command arrives; need be no whole number of steps.", "s", least=0.0
        ),
        _row_of("thrust_coefficient", float, 0.0, "Of a rotor: thrust by its speed squared.", "N s²", least=0.0),
        _row_of("torque_coefficient", float, 0.0, "Of a rotor: drag torque by its speed squared.", "N m s²", least=0.0),
        _row_of(
            "direction", str, "ccw", "Of a rotor: how it turns, seen from the tip of its axis.", choices=("ccw", "cw")
        ),
        _row_of(
            "inertia",
            float,
            0.0,
            "Of a rotor or wheel: moment about its axis, no part of body.inertia.",
            "kg m²",
            least=0.0,
        ),
        _row_of(
            "max_speed", float, 0.0, "Of a wheel: its motor cannot speed it up beyond; 0 = none.", "rad/s", least=0.0
        ),
        _row_of("initial", float, 0.0, "Force or speed at the start.", "N or rad/s"),
    ),
    drive=drive.DRIVE_KERNELS,
    row=_row,
    memory=_memory,
)
