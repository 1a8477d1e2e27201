"""Scenes: checked parameters, read from a ROS parameter file or any mapping, and the physics they describe."""

import os
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TextIO

import numpy as np
import yaml

from ..physics import rotation
from ..physics.body import Body, positive
from ..physics.resistance import Drag, Tether
from ..physics.state import State
from ..physics.terms import Terms
from ..physics.wrench import PointForce, Wrench
from . import attitude, mass_source, schema


@dataclass(frozen=True)
class Frame:
    """A frame fixed to the body in which wrenches may be sent; see ``frames.<name>.*`` in the schema."""

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
MOST_CHARACTERS = 1_000_000  # of a scene file; the scenes of this package have 1000


class Scene:
    """Checked parameters by dotted name, ``scene["body.mass"]``, and what they describe.

    They are given by dotted names or nested, ``{"body": {"mass": 2.0}}``. Mass, inertia and centre of mass have the
    values in use, also where they follow from a shape or a file; so has a quaternion that was given as angles.
    Relative paths of files begin at ``folder``, by default the working directory; what another scene has read already
    is in ``files``.

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
        self.values = attitude.read(self._given)
        self.values.update(mass_source.resolve(self.values, self._given, folder, self._files))
        self.steps_per_publish = self._steps_per_publish()
        self.frames = self._frames()
        self.body()
        self.initial_state()

    def changed(self, changes: Mapping[str, Any]) -> "Scene":
        """The scene with other values for some parameters; what followed from others follows from them anew.

        Files are not read again, unless another one is named.

        Raises ValueError as the constructor does.
        """
        changes = schema.flat(changes)
        return Scene(
            {**attitude.replaced(self._given, changes, self.values), **changes}, self._folder, files=self._files
        )

    def given(self, name: str) -> Any:
        """The value as it was given, where it was, else the one in use."""
        return self._given.get(name, self.values[name])

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def body(self) -> Body:
        """The body described by ``body.*``."""
        mass, inertia = self["body.mass"], self["body.inertia"]
        try:
            positive(mass, "mass", "kg")
        except ValueError as reason:
            raise ValueError(f"parameter body.mass = {mass}: {reason}") from None
        try:
            return Body(mass, inertia, self["body.center_of_mass"])
        except ValueError as reason:
            raise ValueError(f"parameter body.inertia = {list(inertia)}: {reason}") from None

    def initial_state(self) -> State:
        """The state described by ``initial.*``."""
        orientation = attitude.quaternion(self.values, "initial")
        position, velocity, omega = (
            self[f"initial.{last}"] for last in ("position", "linear_velocity", "angular_velocity")
        )
        return State(position, orientation, velocity, omega)

    def terms(self) -> Terms:
        """The body and all that acts on it without being sent."""
        return Terms(self.body(), self["gravity"], self.drag(), self.tethers(), self.forces(), self["integrator.rtol"])

    def drag(self) -> Drag:
        """The drag described by ``drag.*``."""
        return Drag(**{name: self[f"drag.{name}"] for name in Drag.__dataclass_fields__})

    def tethers(self) -> tuple[Tether, ...]:
        """The tethers described by ``tethers.*``, in the order of their names."""
        return tuple(
            Tether(**{last: self[f"tethers.{name}.{last}"] for last in Tether.__dataclass_fields__})
            for name in schema.members("tethers", self.values)
        )

    def forces(self) -> tuple[PointForce, ...]:
        """(point [m, body axes], force [N, world axes]) of each of ``forces.*``, in the order of their names."""
        return tuple(
            (self[f"forces.{name}.body_point"], self[f"forces.{name}.force"])
            for name in schema.members("forces", self.values)
        )

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

    def _frames(self) -> dict[str, Frame]:
        names = schema.members("frames", self.values)
        taken = [self["world_frame_id"], self["body.frame_id"], *names]
        for name, count in Counter(taken).items():
            if name.startswith("/"):
                bare = schema.shown(name.lstrip("/"))
                raise ValueError(
                    f"frame name {schema.shown(name)} begins with '/', as no name in ROS 2 does; give {bare}"
                )
            if count > 1:
                raise ValueError(
                    f"frame name {schema.shown(name)} is used twice; "
                    "world_frame_id, body.frame_id and frames.* must all differ"
                )
        return {name: self._frame(name) for name in names}

    def _frame(self, name: str) -> Frame:
        position, axes = self[f"frames.{name}.position"], self[f"frames.{name}.axes"]
        orientation = rotation.normalize(attitude.quaternion(self.values, f"frames.{name}"))
        return Frame(position, tuple(orientation.tolist()), axes)


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """The scene in a ROS parameter file: ``/**: ros__parameters: ...`` with one node section.

    Relative paths in it begin at its folder. Raises OSError when the file cannot be read and ValueError, beginning with
    the path, when it is not such a file or holds a parameter that is unknown or bad.
    """
    with open(path, encoding="utf-8") as file:
        try:
            given = parameters_in(yaml.load(_text(file), Loader=_StrictLoader))
            own = {name: value for name, value in given.items() if not schema.belongs_to_ros(name)}
            return Scene(own, os.path.dirname(path))
        except (yaml.YAMLError, ValueError) as reason:
            raise ValueError(f"{os.fspath(path)}: {schema.one_line(reason)}") from None
        except RecursionError:
            raise ValueError(f"{os.fspath(path)}: is nested too deeply; parameters are a few levels deep") from None


def _text(file: TextIO) -> str:
    text = file.read(MOST_CHARACTERS + 1)
    if len(text) > MOST_CHARACTERS:
        raise ValueError(f"has more than {MOST_CHARACTERS} characters; a scene file has a few thousand")
    return text


def parameters_in(document: Any) -> dict[str, Any]:
    """Dotted names and values in a parsed ROS parameter file. Raises ValueError when it is not one."""
    if not isinstance(document, Mapping) or len(document) != 1:
        raise ValueError("a scene file holds one section, such as '/**:', with 'ros__parameters:' below it")
    (section,) = document.values()
    if not isinstance(section, Mapping) or set(section) != {"ros__parameters"}:
        raise ValueError("the node section of a scene file holds 'ros__parameters:' and nothing beside it")
    parameters = section["ros__parameters"]
    if parameters is not None and not isinstance(parameters, Mapping):
        raise ValueError(f"'ros__parameters:' holds {schema.shown(parameters)}; it needs names with values below it")
    return schema.flat(parameters or {})


class _StrictLoader(yaml.SafeLoader):
    """YAML without surprises: no key twice, no aliases, and texts, numbers, truth values, lists and maps alone.

    1e-3 is a number, which PyYAML takes for a text; 2024-01-01 and 1:30 are texts, which it takes for a date and 90.
    """

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise ValueError("a scene file has an alias (*name); write the value out, as ROS parameter files need")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        pairs = node.value if isinstance(node, yaml.MappingNode) else ()  # else the rest of PyYAML refuses it
        keys = [self.construct_object(key, deep=True) for key, _ in pairs]
        for key in keys:
            if not isinstance(key, str | int | float | None):
                raise ValueError(f"key {schema.shown(key)} is no name; parameters and their groups have names")
        for key, count in Counter(keys).items():
            if count > 1:
                raise ValueError(f"key {schema.shown(key)} is given twice in one section; give it once")
        return super().construct_mapping(node, deep)

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        return _number(self.construct_scalar(node), lambda text: int(text, 8 if _OCTAL.match(text) else 0))

    def construct_yaml_float(self, node: yaml.ScalarNode) -> float:
        return _number(
            self.construct_scalar(node), lambda text: float(text.replace(".inf", "inf").replace(".nan", "nan"))
        )

    def construct_yaml_bool(self, node: yaml.ScalarNode) -> bool:
        text = self.construct_scalar(node)
        if text.lower() not in self.bool_values:
            raise ValueError(f"{schema.shown(text)} is no truth value; write true or false")
        return self.bool_values[text.lower()]


def _number(text: str, convert: Callable[[str], Any]) -> Any:
    try:
        return convert(text.lower())
    except ValueError:
        raise ValueError(f"{schema.shown(text)} cannot be read as a number; write it as 2, 2.0 or 2e-3") from None


_TAG = "tag:yaml.org,2002:"
_OCTAL = re.compile(r"^[-+]?0\d")
_KINDS = ("null", "bool", "int", "float", "str", "seq", "map")
_NUMBERS = {
    "int": re.compile(r"^[-+]?(0[0-7]*|[1-9]\d*|0x[0-9a-fA-F]+)$"),
    "float": re.compile(r"^[-+]?((\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?|\.(inf|Inf|INF))$|^\.(nan|NaN|NAN)$"),
}
_StrictLoader.yaml_constructors = {_TAG + kind: getattr(_StrictLoader, f"construct_yaml_{kind}") for kind in _KINDS} | {
    None: yaml.SafeLoader.construct_undefined
}
_StrictLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag in (_TAG + "null", _TAG + "bool")]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _kind, _pattern in _NUMBERS.items():
    _StrictLoader.add_implicit_resolver(_TAG + _kind, _pattern, list("-+0123456789."))
