"""The one table of parameters: names, types, units, defaults, ranges and texts.

The node's ROS parameters, the YAML loader, the messages for bad values and the table in
docs/reference/interface.md follow from it.
"""

import difflib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from .. import effects, sensors
from ..effects import link
from ..mass.shapes import SHAPES
from ..values.parameter import MOST_SHOWN, NAMES, OPEN, Parameter, dotted, shown

MISSPELT = 0.75  # of 1: likeness of names at which one is taken for the other, misspelt; mas and mass have 0.86
MOST_TOLD = 1500  # characters of a message that others made, YAML for one
MOST_BODIES = 10_000
OUTPUTS = ("odom", "accel", "imu", "wrench_applied", "actuator_states", "marker", "tf", "clock")


_ZERO = (0.0, 0.0, 0.0)
PARTS = {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}  # of a quaternion; these are no turn


def attitude(prefix: str, text: str) -> tuple[Parameter, ...]:
    """Rows of an attitude: a quaternion whose parts have names, as lists of four mean w first or w last; or angles."""
    parts = [
        Parameter(
            f"{prefix}.orientation.{part}", float, default, f"Part {part} of the quaternion ({text}); normalised."
        )
        for part, default in PARTS.items()
    ]
    angles = "In its place: roll, pitch, yaw as in URDF; the quaternion is then what follows, and this is empty."
    return (*parts, Parameter(f"{prefix}.rpy", tuple, (), angles, "rad", length=3, optional=True))


TABLE: tuple[Parameter, ...] = (
    Parameter("rate", float, 1000.0, "Steps a second of simulated time.", "Hz", least=1e-3, most=1e6),
    Parameter(
        "publish_rate",
        float,
        100.0,
        "Pose and twist a second of simulated time; must divide rate; 0 = every step.",
        "Hz",
        least=0.0,
    ),
    Parameter(
        "real_time_factor",
        float,
        1.0,
        "Simulated seconds a second of wall time; 0 = as fast as possible.",
        least=0.0,
        most=1e6,
        dynamic=True,
    ),
    Parameter(
        "realtime_priority", int, 0, "SCHED_FIFO priority of the loop, where permitted; 0 = none.", least=0, most=99
    ),
    Parameter("lockstep", bool, False, "Commands advance the simulation, no clock; see lockstep_on."),
    Parameter(
        "lockstep_on",
        NAMES,
        ("wrench",),
        "Which commands advance it: wrench (those on the first of wrench.topics) or actuators; of several bodies also "
        "names of those whose commands are waited for, else all that somebody commands.",
        lone=True,
    ),
    Parameter("steps_per_command", int, 1, "Steps by which such a command advances it.", least=1, most=1_000_000),
    Parameter("start_paused", bool, False, "Wait for ~/pause or ~/step before the first step."),
    Parameter(
        "start_on_command",
        bool,
        False,
        "Keep the body where it is, while time goes on, until the first command or impulse; after ~/reset again.",
    ),
    Parameter(
        "reset_time", bool, False, "~/reset also sets simulated time back; stamps then jump back, which tf dislikes."
    ),
    Parameter("world_frame_id", str, "world", "Name of the world frame in headers."),
    Parameter("twist_frame", str, "body", "Axes in which twist and accel are expressed.", choices=("body", "world")),
    Parameter("wrench.topics", NAMES, ("wrench",), "Topics with commands; each is held on its own, and they add up."),
    Parameter(
        "wrench.max_force",
        float,
        0.0,
        "A command with a larger force is scaled down to it, its direction kept; 0 = no limit.",
        "N",
        least=0.0,
        dynamic=True,
    ),
    Parameter(
        "wrench.max_torque",
        float,
        0.0,
        "A command with a larger torque is scaled down to it, its direction kept; 0 = no limit.",
        "N m",
        least=0.0,
        dynamic=True,
    ),
    Parameter(
        "wrench.timeout",
        float,
        0.5,
        "A command, to actuators too, acts for the whole steps in this, at least one, then zero; 0 = for ever.",
        "s",
        least=0.0,
        most=1e9,
    ),
    Parameter("wrench.frame", str, "body", "Frame of commands whose frame_id is empty.", choices=("body", "world")),
    Parameter("body.frame_id", str, "base_link", "Name of the body frame in headers."),
    Parameter("body.mass", float, 1.0, "Mass.", "kg", above=0.0, dynamic=True),
    Parameter(
        "body.inertia",
        tuple,
        (0.1, 0.1, 0.1, 0.0, 0.0, 0.0),
        "ixx, iyy, izz, ixy, ixz, iyz as in URDF: about the centre of mass, body axes.",
        "kg m²",
        length=6,
        dynamic=True,
    ),
    Parameter(
        "body.center_of_mass", tuple, _ZERO, "Centre of mass from the body frame's origin, body axes.", "m", length=3
    ),
    Parameter(
        "body.shape",
        str,
        "",
        "Shape from which body.inertia follows, centred at body.center_of_mass; see docs/reference/conventions.md.",
        choices=tuple(SHAPES),
        optional=True,
    ),
    Parameter("body.dimensions", tuple, (), "Dimensions of body.shape, in its order.", "m", optional=True),
    Parameter(
        "body.density",
        float,
        0.0,
        "Density from which body.mass follows, with body.shape or body.mesh_file; 0 = not used.",
        "kg/m³",
        least=0.0,
    ),
    Parameter(
        "body.mesh_file",
        str,
        "",
        "STL, OBJ, PLY or OFF file, evenly filled: body.inertia and body.center_of_mass follow.",
        optional=True,
        file=True,
    ),
    Parameter(
        "body.mesh_scale",
        tuple,
        (1.0, 1.0, 1.0),
        "Length of one unit of body.mesh_file along each axis, as URDF's scale: 0.001 for a file in mm.",
        "m",
        above=0.0,
        length=3,
    ),
    Parameter(
        "body.urdf_file",
        str,
        "",
        "URDF file from which body.mass, body.inertia and body.center_of_mass follow.",
        optional=True,
        file=True,
    ),
    Parameter("body.urdf_link", str, "", "Link in body.urdf_file; empty = the only one with mass.", optional=True),
    Parameter("initial.position", tuple, _ZERO, "Position of the body frame's origin, world axes.", "m", length=3),
    *attitude("initial", "body to world"),
    Parameter(
        "initial.linear_velocity", tuple, _ZERO, "Velocity of the body frame's origin, world axes.", "m/s", length=3
    ),
    Parameter("initial.angular_velocity", tuple, _ZERO, "Angular velocity, body axes.", "rad/s", length=3),
    Parameter("gravity", tuple, _ZERO, "Acceleration of free fall, world axes.", "m/s²", length=3, dynamic=True),
    *(row for effect in effects.REGISTRY.values() for row in effect.parameters),
    *sensors.OF_ALL,
    *attitude("sensors.<name>", "its axes to body"),
    *sensors.ROWS,
    Parameter("frames.<name>.position", tuple, _ZERO, "Origin of a frame fixed to the body, body axes.", "m", length=3),
    *attitude("frames.<name>", "that frame to body"),
    Parameter(
        "frames.<name>.axes",
        str,
        "body",
        "Axes of a wrench sent in it: body = the frame's own, which turn with the body; world = fixed in the world.",
        choices=("body", "world"),
    ),
    Parameter("integrator.name", str, "auto", "How time advances; names in docs/how-to/choosing_an_integrator.md."),
    Parameter(
        "integrator.rtol",
        float,
        1e-9,
        "Relative error that an integrator with error control may make in a step.",
        least=1e-13,
        most=1.0,
    ),
    Parameter("outputs", NAMES, (), "What is published beside pose and twist; see Topics above.", choices=OUTPUTS),
    Parameter(
        "record.path",
        str,
        "",
        "Where the node records a bag: a path that does not exist yet; empty = nowhere. See docs/how-to/recording.md.",
        optional=True,
    ),
    Parameter(
        "record.topics",
        NAMES,
        (),
        "Topics recorded; empty = all: pose, twist, outputs, sensors, commands, impulse, set_pose, set_twist, "
        "fluid_velocity.",
    ),
    Parameter("bodies", NAMES, (), "Names of several bodies; empty = one. See docs/how-to/several_bodies.md."),
    Parameter(
        "bodies.count",
        int,
        0,
        "In place of names: so many bodies, all alike, called bodies.prefix and a number from 0 on; 0 = not used.",
        least=0,
        most=MOST_BODIES,
    ),
    Parameter("bodies.prefix", str, "body_", "How the names of counted bodies begin."),
    Parameter(
        "bodies.columns",
        int,
        0,
        "Counted bodies stand in rows of so many along x, from initial.position on; 0 = about as many as rows.",
        least=0,
        most=MOST_BODIES,
    ),
    Parameter("bodies.spacing", tuple, (1.0, 1.0), "Distances of columns and rows, world x and y.", "m", length=2),
    *link.PARAMETERS,
)

BY_NAME = {parameter.name: parameter for parameter in TABLE}
OF_SEVERAL = ("bodies", "links")  # groups that a scene of one body has no use for
LEADING = ("wrench", "actuators")  # of lockstep_on: which commands lead
GROUPS = tuple(dict.fromkeys(name.split(OPEN)[0] for name in BY_NAME if OPEN in name))


def find(name: str, table: Mapping[str, Parameter] = BY_NAME) -> Parameter:
    """The parameter of that name. Raises ValueError with the nearest known name when there is none."""
    if (pattern := _pattern(name)) in table and OPEN not in name:
        return table[pattern]
    raise ValueError(unknown(name, pattern, table))


def is_known(name: str) -> bool:
    """Whether a scene has, or may have, a parameter of that name."""
    return _pattern(name) in BY_NAME and OPEN not in name


def _pattern(name: str) -> str:
    """``name`` with ``<name>`` in place of the name of a member of a group."""
    group, _, rest = name.partition(".")
    member, _, last = rest.partition(".")
    return f"{group}{OPEN}{last}" if group in GROUPS and member and last else name


def has_attitude(prefix: str, table: Mapping[str, Parameter] = BY_NAME) -> bool:
    """Whether there are ``prefix.orientation.w`` and the rest of an attitude."""
    return _pattern(f"{prefix}.orientation.w") in table


def is_group(name: str) -> bool:
    """Whether ``name`` is what parameters of a scene stand below, such as ``body`` or ``frames.arm``."""
    return any(known.startswith(_pattern(f"{name}.x")[:-1]) for known in BY_NAME)


def is_open(name: str) -> bool:
    """Whether a parameter is of a member, with a name of the user's, of a group."""
    return OPEN in _pattern(name)


def names_a_file(name: str) -> bool:
    """Whether a parameter of a scene is the path of a file that is read."""
    return name in BY_NAME and BY_NAME[name].file


def members(group: str, names: Iterable[str]) -> list[str]:
    """Names of the user's among dotted ``names`` of a group such as ``frames``, each once, in alphabetical order."""
    return sorted({name.split(".")[1] for name in names if name.startswith(f"{group}.") and name not in BY_NAME})


def unknown(name: str, pattern: str, known: Iterable[str]) -> str:
    """The sentence for a parameter that is not known: with the known one that ``pattern`` misspells, or those there."""
    known = list(known)
    if f"{pattern}.w" in known:
        name = shown_name(name)
        angles = f"{name.removesuffix('.orientation')}.rpy"
        return f"parameter {name} is an attitude, whose parts are given: {name}.w, .x, .y and .z, or {angles}"
    meant = _meant(pattern, known)
    help_ = f"did you mean {meant}?" if meant else _dotted_member(name, known) or _there(name, known)
    return f"parameter {shown_name(name)} is not known; {help_}"


def _dotted_member(name: str, known: Sequence[str]) -> str:
    """What is wrong, where the name of a member of a group has dots; else empty."""
    group, *parts = name.split(".")
    for count in range(2, len(parts)):
        if f"{group}{OPEN}{'.'.join(parts[count:])}" in known:
            return dotted(".".join(parts[:count]))
    return ""


def _meant(pattern: str, known: Sequence[str]) -> str:
    """The known name that this one is but for its spelling; empty when there is none, or are several."""
    letters, groups = _letters(pattern), {name.rpartition(".")[0] for name in known}
    ways: tuple[Callable[[str], bool], ...] = (
        lambda each: _letters(each) == letters,
        lambda each: each == _angles_of(pattern),
        lambda each: each.endswith(f".{pattern}") or (pattern.startswith(f"{each}.") and each not in groups),
        lambda each: _likeness(pattern, each) >= MISSPELT,
    )
    for way in ways:
        if found := sorted(filter(way, known), key=lambda each: _likeness(pattern, each), reverse=True):
            alone = len(found) == 1 or _likeness(pattern, found[0]) > _likeness(pattern, found[1])
            return found[0] if alone else ""
    return ""


def _letters(name: str) -> str:
    return re.sub(r"<name>|[\W_]", "", name).lower()


def _likeness(one: str, other: str) -> float:
    """From 0 to 1, that of the least like of two names' parts: what stands above them alike is no likeness."""
    parts = one.split("."), other.split(".")
    if len(parts[0]) != len(parts[1]):
        return 0.0
    return min(
        1.0 if "<name>" in (a, b) else difflib.SequenceMatcher(None, a, b).ratio() for a, b in zip(*parts, strict=True)
    )


def _there(name: str, known: Sequence[str]) -> str:
    """What there is in the innermost group that a name is in."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        group = ".".join(parts[:count])
        for prefix in (f"{group}.", _pattern(f"{group}.x")[:-1]):
            if within := dict.fromkeys(each[len(prefix) :].split(".")[0] for each in known if each.startswith(prefix)):
                return f"the parameters of {shown_name(group)} are {', '.join(within)}"
    return f"the parameters are {', '.join(dict.fromkeys(each.split('.')[0] for each in known))}"


def _angles_of(pattern: str) -> str:
    """Where the angles are that ``orientation.roll``, ``rpy.yaw`` or just ``pitch`` means."""
    return re.sub(r"(\.orientation|\.rpy)*\.(rpy|roll|pitch|yaw)$", ".rpy", pattern)


def belongs_to_ros(name: str) -> bool:
    """Whether ``name`` is a parameter that ROS itself has on every node, and no scene speaks of."""
    return name in ("use_sim_time", "start_type_description_service") or name.startswith("qos_overrides.")


def defaults(table: Mapping[str, Parameter] = BY_NAME) -> dict[str, Any]:
    """Name and default of every parameter that a scene always has."""
    return {name: parameter.default for name, parameter in table.items() if OPEN not in name}


def flat(tree: Mapping[Any, Any], prefix: str = "") -> dict[str, Any]:
    """Dotted names and values in nested ones. Raises ValueError when a name is there twice.

    So it does for a member of a group that has nothing in it, as it would be lost.
    """
    values: dict[str, Any] = {}
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping) and not value:
            _check_not_empty(name)
        nested = isinstance(value, Mapping) and (value or is_group(name))  # else it is a value, of no use
        for full, leaf in (flat(value, f"{name}.") if nested else {name: value}).items():
            if full in values:
                raise ValueError(f"parameter {shown_name(full)} is given twice; give it once")
            values[full] = leaf
    return values


def _check_not_empty(name: str) -> None:
    """Raise ValueError when ``name`` is that of a member of a group."""
    group, _, member = name.partition(".")
    if group in GROUPS and member and "." not in member and name not in BY_NAME:
        rows = [row for row in TABLE if row.name.startswith(group + OPEN)]
        first = next((row for row in rows if row.required), rows[0]).name.replace("<name>", member)
        raise ValueError(f"parameter {shown_name(name)} has nothing in it; give its parameters, such as {first}")


def read(given: Mapping[str, Any], table: Mapping[str, Parameter] = BY_NAME) -> dict[str, Any]:
    """Defaults overlaid with ``given`` (dotted names), each checked; every member named gets its missing parameters."""
    values = defaults(table)
    for name, value in given.items():
        values[name] = find(name, table).read(name, value)
    for group in GROUPS:
        for member in members(group, given):
            _complete(values, group, member)
    return values


def _complete(values: dict[str, Any], group: str, member: str) -> None:
    """Add the defaults of what a member of a group was not given. Raises ValueError when it must be given."""
    names = (parameter.name.replace("<name>", member) for parameter in TABLE if parameter.name.startswith(group + OPEN))
    first = next(name for name in names if name in values)
    for parameter in TABLE:
        if parameter.name.startswith(f"{group}{OPEN}"):
            name = parameter.name.replace("<name>", member)
            if parameter.required and name not in values:
                raise ValueError(
                    f"parameter {first} is given without {name}, which has no default; give it, such as "
                    f"{parameter._example}"
                )
            values.setdefault(name, parameter.default)


def shown_name(name: str) -> str:
    """The same of a name: as it is, unless it is too long or cannot be printed."""
    return name if name.isprintable() and 0 < len(name) <= MOST_SHOWN else shown(name)


def one_line(reason: Exception) -> str:
    """What an exception says, on one line, with escapes for what cannot be printed: all of it, or how it begins."""
    text = " ".join(str(reason).split())
    if not text.isprintable():
        text = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return text if len(text) <= MOST_TOLD else f"{text[:MOST_TOLD]}... ({len(text)} characters)"
