"""What a sensor is: what it measures of a motion, described so that everything else follows; see adding_a_sensor.md.

What a sensor shows is a pure function of the motion at its instants, of its seed and name, and of the count of its
samples. Nothing is remembered: it does not matter who listens, and a run that is repeated has the same bits.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

from ..kernels.arrays import Floats, Vector
from ..kernels.compiled import Request
from ..kernels.vectors import qrotate
from ..values import rotation
from ..values.parameter import Parameter, is_array, shown
from ..values.wrench import ZERO, number, three_finite

Numbers = tuple[float, ...]
NO_TURN = (1.0, 0.0, 0.0, 0.0)
NOT_READ: Numbers = ()  # in place of accelerations that a type does not need
NAME = re.compile(r"[A-Za-z]([A-Za-z0-9]|_(?!_))*")
NAME_RULE = "letters, digits and single underscores, a letter first"


class Noise(NamedTuple):
    """Of a group of values in the unit u: what stands in data sheets, the same for each of them but for the bias.

    ``noise_density`` [u/√Hz] is that of white noise, whose standard deviation in a sample is noise_density · √rate.
    ``bias`` [u] has a number for each value, or none. ``random_walk`` [u/s/√Hz] is that of a bias that wanders: from 0
    at time zero, with the standard deviation random_walk · √t. What is shown is a multiple of ``quantization`` [u], and
    within ± ``range`` [u]; 0 = none. Kalibr's model of an IMU has the same densities and walks.
    """

    noise_density: float = 0.0
    bias: Sequence[float] = ()
    random_walk: float = 0.0
    quantization: float = 0.0
    range: float = 0.0


NO_NOISE = Noise()


class Group(NamedTuple):
    """Values that share a Noise, ``size`` of them, at most three: the ``field`` of the sensor.

    Its parameters, those of Noise that it ``has``, stand below ``prefix``.
    """

    field: str
    prefix: str
    size: int
    has: tuple[str, ...] = Noise._fields


Triple = tuple[float, float, float]


_SCALARS = tuple(name for name in Noise._fields if name != "bias")


class Plane(Protocol):
    """The ground, as effects.ground has it: the points with unit_normal · x = height."""

    @property
    def height(self) -> float: ...
    @property
    def unit_normal(self) -> Floats: ...


class Seen(NamedTuple):
    """What there is to be measured: Simulation.motion, its acceleration where the type needs it, and surroundings."""

    motion: Numbers
    acceleration: Numbers
    gravity: Numbers
    ground: Plane


@dataclass(frozen=True)
class Sensor:
    """What all sensors have.

    ``rate`` [Hz] divides the step rate; 0 = every step. ``position`` [m, body axes from the body frame's origin] and
    ``orientation`` (w, x, y, z; its axes → body axes) are those of its frame, which is called ``frame_id``, by default
    as the sensor. Its noise is that of ``seed`` and name. Messages come out ``delay`` [s] after what they measure.

    Raises ValueError for a name that ROS does not allow, and for a value that is not finite or not in range.
    """

    type: ClassVar[str]  # name of its descriptor in the registry
    groups: ClassVar[tuple[Group, ...]]

    name: str
    rate: float = 0.0
    position: Vector = ZERO
    orientation: Vector = NO_TURN
    seed: int = 0
    delay: float = 0.0
    frame_id: str = ""

    def __post_init__(self) -> None:
        check_name(self.name)
        for name in ("rate", "delay"):
            self._set(name, self._number(name, getattr(self, name)))
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise ValueError(f"{self}: seed {shown(self.seed)} is not a whole number of at least 0")
        self._set("position", three_finite(self.position, f"{self}: position"))
        self._set("orientation", tuple(rotation.normalize(self.orientation).tolist()))
        self._set("frame_id", self.frame_id or self.name)
        for group in self.groups:
            self._set(group.field, self._noise(group, getattr(self, group.field)))

    def __str__(self) -> str:
        return f"sensor {shown(self.name)}"

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _number(self, name: str, given: Any, least: float = 0.0) -> float:
        value = number(given, f"{self}: {name}")
        if not (math.isfinite(value) and value >= least):
            rule = f" of at least {least:g}" if least > -math.inf else ""
            raise ValueError(f"{self}: {name} {value:g} is not a finite number{rule}")
        return value

    def _vector(self, name: str) -> None:
        """Check a field of three numbers."""
        self._set(name, three_finite(getattr(self, name), f"{self}: {name}"))

    def _noise(self, group: Group, given: Noise) -> Noise:
        if not isinstance(given, Noise):
            raise TypeError(f"{self}: {group.field} {given!r} is no Noise; give one")
        values = {name: self._number(group.prefix + name, getattr(given, name)) for name in _SCALARS}
        for name in _SCALARS:
            if values[name] and name not in group.has:
                raise ValueError(f"{self}: {group.field} has no {name}; leave it out")
        bias = tuple(given.bias) if is_array(given.bias) else (given.bias,)
        if len(bias) not in (0, group.size):
            raise ValueError(
                f"{self}: {group.prefix}bias {shown(list(bias))} has {len(bias)} entries; give {group.size}, or none"
            )
        kept = tuple(self._number(f"{group.prefix}bias", one, -math.inf) for one in bias)
        return Noise(**values, bias=kept)


def place(sensor: Sensor, motion: Numbers) -> Triple:
    """Where a sensor is, world axes [m]."""
    qw, qx, qy, qz = motion[3:7]
    rx, ry, rz = sensor.position
    x, y, z = qrotate(qw, qx, qy, qz, rx, ry, rz)
    return motion[0] + x, motion[1] + y, motion[2] + z


def check_name(name: Any) -> None:
    """Raise ValueError for a name that no topic of ROS can have."""
    if not (isinstance(name, str) and NAME.fullmatch(name)):
        raise ValueError(f"sensor {shown(name)}: its name is that of a topic of ROS; give one of {NAME_RULE}")


@dataclass(frozen=True, eq=False, kw_only=True)
class SensorType:
    """Descriptor of one type of sensor; see docs/how-to/adding_a_sensor.md.

    ``make`` is its dataclass, a Sensor, whose fields beside those are one Noise for each of its groups, and its ``own``
    parameters, by their names below the sensor's with ``_`` for ``.``; ``parameters`` are the rows of all these that no
    other type brings. ``truth(sensor)`` makes a function of Seen that gives three values for each group, filled
    up with zeros; ``show(sensor)`` one that makes of these values, once disturbed, and of Seen the numbers that
    ``columns`` names. With ``accelerations``, Seen has them. ``kernels`` are those that it calls; ``example`` has
    everything that it can have.
    """

    make: type[Any]
    columns: tuple[str, ...]
    truth: Callable[[Any], Callable[[Seen], Sequence[Triple]]]
    show: Callable[[Any], Callable[[Sequence[Triple], Seen], Numbers]]
    own: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    accelerations: bool = False
    kernels: tuple[Request, ...] = ()
    example: Sensor

    @property
    def name(self) -> str:
        """The value of the parameter ``type``."""
        name: str = self.make.type
        return name

    @property
    def groups(self) -> tuple[Group, ...]:
        """Those of its values."""
        groups: tuple[Group, ...] = self.make.groups
        return groups

    @property
    def names(self) -> tuple[str, ...]:
        """Of its parameters below the sensor's name, but for those that all have."""
        return (*(group.prefix + name for group in self.groups for name in group.has), *self.own)

    def has(self, row: Parameter) -> bool:
        """Whether a row of the table is of a parameter that sensors of this type have."""
        last = row.name.removeprefix("sensors.<name>.")
        return last in (*COMMON, *self.names)

    def read(self, name: str, values: Mapping[str, Any], orientation: Sequence[float]) -> Any:
        """The sensor of that name in the parameters of a scene."""
        given = {one: values[f"sensors.{name}.{one}"] for one in (*COMMON, *self.names)}
        noises = {group.field: Noise(**{one: given[group.prefix + one] for one in group.has}) for group in self.groups}
        own = {one.replace(".", "_"): given[one] for one in self.own}
        common = {one: given[one] for one in COMMON}
        return self.make(name=name, orientation=orientation, **common, **noises, **own)


COMMON = ("rate", "position", "seed", "delay", "frame_id")  # what all have, beside type and attitude


def row(name: str, *rest: Any, **options: Any) -> Parameter:
    """A row of the table of parameters, below the name of a sensor."""
    return Parameter(f"sensors.<name>.{name}", *rest, **options)


def noise_rows(group: Group, unit: str, of: str) -> tuple[Parameter, ...]:
    """The rows of a group's Noise, whose values are ``of`` something in a unit."""

    def density(name: str, text: str, per: str) -> Parameter:
        units = ", ".join(f"{one.strip()}{per}" for one in unit.split(","))
        units = units.replace("rad/s/s/", "rad/s²/").replace("m/s²/s/", "m/s³/")
        return row(group.prefix + name, float, 0.0, f"{text} of {of}.", units, least=0.0)

    made = {
        "noise_density": density("noise_density", "White noise", "/√Hz"),
        "bias": row(
            f"{group.prefix}bias", tuple, (), f"Constant offset of {of}, a number for each value.", unit, optional=True
        ),
        "random_walk": density("random_walk", "Random walk of the bias", "/s/√Hz"),
        "quantization": density("quantization", "Step between two values", ""),
        "range": density("range", "Full scale, at which values saturate, 0 = no limit,", ""),
    }
    return tuple(made[name] for name in group.has)
