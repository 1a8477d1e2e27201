"""Scenes: checked parameters, read from a ROS parameter file or any mapping, and the physics they describe."""

import logging
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from .. import sensors
from ..effects import REGISTRY
from ..effects.actuators import MOST_STEPS_LATE
from ..sensors.base import Sensor
from ..sensors.instrument import in_steps
from ..terms import Terms
from ..values import rotation
from ..values.body import Body, positive
from ..values.parameter import Parameter, shown
from ..values.state import State
from ..values.wrench import Wrench
from . import attitude, mass_source, parameter_file, schema


@dataclass(frozen=True)
class Frame:
    """A frame fixed to the body in which wrenches may be sent; see ``frames.<name>.*`` in the schema.

    ``position`` [m] is that of its origin in the body frame; ``orientation`` (w, x, y, z) takes components in its axes
    to those in body axes. A wrench in it is given in the axes that ``axes`` names, its own or the world's.
    """

    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    axes: str

    def wrench(self, force: Sequence[float], torque: Sequence[float]) -> Wrench:
        """The wrench of a force [N] at this frame's origin and a torque [N m], both in ``axes``."""
        if self.axes == "world":
            return Wrench(torque_world=torque, points=[(self.position, force)])
        with np.errstate(over="ignore", invalid="ignore"):  # Wrench refuses what comes of it
            f_body = rotation.rotate(self.orientation, force)
            tau_body = rotation.rotate(self.orientation, torque)
            about_origin = tau_body + np.cross(self.position, f_body)
        return Wrench(force_body=f_body.tolist(), torque_body=about_origin.tolist())


MOST_STEPS_PER_PUBLISH = 1e9
ALWAYS_TOPICS = (  # of the node, beside outputs and those with wrenches; some only where there is what they are for
    *("pose", "twist", "impulse", "set_pose", "set_twist", "fluid_velocity", "actuator_commands", "actuators"),
    *("tf", "tf_static", "clock", "diagnostics", "rosout", "parameter_events"),
)
MOST_NAMED = 3  # parameters that do not go together, in a message
DEFAULT_NODE = "/rigid_body_node"
_log = logging.getLogger("rigid_body_sim")


class Scene:
    """Checked parameters by dotted name, ``scene["body.mass"]``, and what they describe.

    They are given by dotted names or nested, ``{"body": {"mass": 2.0}}``. Mass, inertia and centre of mass have the
    values in use, also where they follow from a shape or a file; so has a quaternion that was given as angles.
    Relative paths of files begin at ``folder``, by default the working directory; what another scene has read already
    is in ``files``. ``notes`` are sentences about how it was read that whoever gave it should see once.

    Raises ValueError, with a sentence that names the parameter, for an unknown name, a bad value, or values that do not
    go together.
    """

    def __init__(
        self,
        given: Mapping[str, Any] | None = None,
        folder: str | os.PathLike[str] = "",
        *,
        files: mass_source.Files | None = None,
    ):
        self._given, self._folder = schema.flat(given or {}), folder
        self._files: mass_source.Files = {} if files is None else files
        self._check_one_body()
        self.values = attitude.read(self._given)
        source = mass_source.resolve(self.values, self._given, folder, self._files)
        self.values.update(source.followed)
        self.notes = (*source.notes, *self._notes_of_time())
        self.steps_per_publish = self._steps_per_publish()
        self.frames = self._frames()
        self._check_lockstep()
        self._check_actuated()
        self._check_delays()
        self._check_sensors()
        self.terms()
        self.initial_state()

    def _notes_of_time(self) -> Iterator[str]:
        timeout, rate = self["wrench.timeout"], self["rate"]
        if 0.0 < timeout * rate < 1.0 - 1e-6:
            yield (
                f"parameter wrench.timeout = {timeout:g}: is shorter than a step of {1.0 / rate:.6g} s, "
                "and a command acts for one step"
            )
        for name in schema.members("sensors", self.values):
            delay = self[f"sensors.{name}.delay"]
            if abs(delay * rate - round(delay * rate)) > 1e-6:
                yield (
                    f"parameter sensors.{name}.delay = {delay:g}: is no whole number of steps of {1.0 / rate:.6g} s, "
                    f"and taken as {round(delay * rate) / rate:.6g} s"
                )

    def changed(self, changes: Mapping[str, Any]) -> "Scene":
        """The scene with other values for some parameters; what followed from others follows from them anew.

        Files are not read again, unless another one is named.

        Raises ValueError as the constructor does.
        """
        given = attitude.over(self._given, schema.flat(changes), self.values)
        return Scene(given, self._folder, files=self._files)

    def has_given(self, group: str) -> bool:
        """Whether any parameter of a group was given."""
        return any(name.startswith(f"{group}.") for name in self._given)

    def has(self, name: str) -> bool:
        """Whether there is a parameter of that name here: of a group, those of its members."""
        return name in self.values

    def value_of(self, name: str) -> Any:
        """The value of a parameter."""
        return self.values[name]

    @staticmethod
    def parameter(name: str) -> Parameter:
        """The parameter of that name in the table. Raises ValueError with the nearest known name when there is none."""
        return schema.find(name)

    def given(self, name: str) -> Any:
        """The value as it was given, where it was, else the one in use."""
        return self._given.get(name, self.values[name])

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def body(self) -> Body:
        """The body described by ``body.*``."""
        mass, inertia, center = self["body.mass"], self["body.inertia"], self["body.center_of_mass"]
        try:
            positive(mass, "mass", "kg")
        except ValueError as reason:
            raise ValueError(f"parameter body.mass = {mass}: {reason}") from None
        try:
            return Body(mass, inertia, center)
        except ValueError as reason:
            name = "body.center_of_mass" if str(reason).startswith("center_of_mass") else "body.inertia"
            raise ValueError(f"parameter {name} = {shown(self[name])}: {reason}") from None

    def initial_state(self) -> State:
        """The state described by ``initial.*``."""
        orientation = attitude.quaternion(self.values, "initial")
        position, velocity, omega = (
            self[f"initial.{last}"] for last in ("position", "linear_velocity", "angular_velocity")
        )
        return State(position, orientation, velocity, omega)

    def terms(self) -> Terms:
        """The body and all that acts on it without being sent."""
        return Terms(
            self.body(), self["gravity"], self["integrator.rtol"], **{name: self.effect(name) for name in REGISTRY}
        )

    def effect(self, name: str) -> Any:
        """What is described of the effect of that name in the registry; of those that may be many all, by name."""
        effect = REGISTRY[name]
        try:
            return effect.read(self.values, partial(schema.members, names=self.values))
        except ValueError as reason:
            if str(reason).startswith("parameter "):
                raise
            field = str(reason).split()[0]
            if field in effect.fields and not effect.many:
                raise ValueError(f"parameter {effect.fields[field]}{str(reason).removeprefix(field)}") from None
            groups = (name, *effect.groups)
            given = [schema.shown_name(one) for one in self._given if one.split(".")[0] in groups]
            more = f" and {len(given) - MOST_NAMED} more" if len(given) > MOST_NAMED else ""
            raise ValueError(f"parameter {', '.join(given[:MOST_NAMED])}{more}: {reason}") from None

    def sensors(self) -> tuple[Sensor, ...]:
        """Those described by ``sensors.*``, in alphabetical order."""
        return tuple(map(self._sensor, schema.members("sensors", self.values)))

    def _sensor(self, name: str) -> Sensor:
        try:
            sensor = sensors.read(name, self.values, attitude.quaternion(self.values, f"sensors.{name}"))
            in_steps(sensor, self["rate"])
        except ValueError as reason:
            said, given = str(reason), f"sensor {shown(name)}: "
            told = f"parameter sensors.{name}: {said.removeprefix(given)}"
            raise ValueError(told if said.startswith(given) else said) from None
        return sensor

    def _check_sensors(self) -> None:
        """Leave out parameters that the type of a sensor does not have; see sensors.read.

        Raises ValueError for a sensor that cannot be, or one with the name of another topic of the node.
        """
        there = (*ALWAYS_TOPICS, *self["outputs"], *(topic.lstrip("/") for topic in self["wrench.topics"]))
        for sensor in self.sensors():
            if sensor.name in there:
                raise ValueError(
                    f"parameter sensors.{sensor.name}: the node already has a topic {sensor.name}; give the sensor "
                    "another name, which is that of its topic"
                )
            for row in sensors.ROWS:
                if not sensors.REGISTRY[sensor.type].has(row):
                    self.values.pop(row.name.replace("<name>", sensor.name), None)

    def _steps_per_publish(self) -> int:
        rate, publish_rate = self["rate"], self["publish_rate"]
        if publish_rate == 0.0:
            return 1
        if rate / publish_rate > MOST_STEPS_PER_PUBLISH:
            raise ValueError(
                f"parameter publish_rate = {publish_rate:g}: is too low for rate = {rate:g} Hz; "
                f"give 0 (every step) or at least {rate / MOST_STEPS_PER_PUBLISH:g}"
            )
        steps = round(rate / publish_rate)
        if steps < 1 or abs(steps * publish_rate - rate) > 1e-5 * rate:
            nearest = rate / max(1, steps)
            raise ValueError(
                f"parameter publish_rate = {publish_rate:g}: does not divide rate = {rate:g} Hz into whole steps; "
                f"the nearest that does is {nearest:.9g}"
            )
        return steps

    def _check_one_body(self) -> None:
        """Raise ValueError for what is of several bodies: see fleet.FleetScene."""
        for name in self._given:
            if name.split(".")[0] in schema.OF_SEVERAL:
                known = schema.find(name)
                if schema.is_open(name) or known.read(name, self._given[name]) != known.default:
                    raise ValueError(
                        f"parameter {schema.shown_name(name)} = {shown(self._given[name])}: is of a scene of several "
                        "bodies, and here is one; FleetScene and load_fleet take several"
                    )

    def _check_lockstep(self) -> None:
        on = self["lockstep_on"]
        if len(on) != 1 or on[0] not in schema.LEADING:
            raise ValueError(
                f"parameter lockstep_on = {shown(on)}: is not allowed; give one of {', '.join(schema.LEADING)}"
            )

    def _check_actuated(self) -> None:
        """Raise ValueError for what needs actuators, where there are none."""
        if self["actuators.names"]:
            return
        for name, given in (("lockstep_on", self["lockstep_on"]), ("outputs", self["outputs"])):
            for value in given:
                if value.startswith("actuator"):
                    raise ValueError(
                        f"parameter {name}: {value} needs actuators, and there are none; name them in actuators.names"
                    )

    def _check_delays(self) -> None:
        """Raise ValueError for a delay of an actuator that is too many steps."""
        rate = self["rate"]
        for name in self["actuators.names"]:
            delay = self.values.get(f"actuators.{name}.delay", 0.0)
            if delay * rate > MOST_STEPS_LATE:
                raise ValueError(
                    f"parameter actuators.{name}.delay = {delay:g}: is more than {MOST_STEPS_LATE} steps at rate = "
                    f"{rate:g} Hz; give at most {MOST_STEPS_LATE / rate:g}"
                )

    def _frames(self) -> dict[str, Frame]:
        names = schema.members("frames", self.values)
        taken = [self["world_frame_id"], self["body.frame_id"], *names]
        for name, count in Counter(taken).items():
            if name.startswith("/"):
                bare = shown(name.lstrip("/"))
                raise ValueError(f"frame name {shown(name)} begins with '/', as no name in ROS 2 does; give {bare}")
            if count > 1:
                raise ValueError(
                    f"frame name {shown(name)} is used twice; "
                    "world_frame_id, body.frame_id and frames.* must all differ"
                )
        return {name: self._frame(name) for name in names}

    def _frame(self, name: str) -> Frame:
        position, axes = self[f"frames.{name}.position"], self[f"frames.{name}.axes"]
        orientation = rotation.normalize(attitude.quaternion(self.values, f"frames.{name}"))
        return Frame(position, tuple(orientation.tolist()), axes)


def load_scene(path: str | os.PathLike[str], node: str = DEFAULT_NODE) -> Scene:
    """The scene in a ROS parameter file, as the node of the full name ``node`` takes it: see parameter_file.

    Relative paths in it begin at its folder. The scene's notes are logged as warnings.

    Raises OSError when the file cannot be read and ValueError, beginning with the path, when it is not such a file, has
    nothing for that node, or holds a parameter that is unknown or bad.
    """
    given = parameter_file.of_scene(path, node)
    try:
        scene = Scene(given)
    except ValueError as reason:
        raise ValueError(f"{os.fspath(path)}: {schema.one_line(reason)}") from None
    log_notes(path, scene.notes)
    return scene


def log_notes(path: str | os.PathLike[str], notes: Iterable[str]) -> None:
    """Tell what whoever gave a scene should see once."""
    for note in notes:
        _log.warning("%s: %s", os.fspath(path), note)
