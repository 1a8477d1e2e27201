"""The schema's parameters as ROS parameters of a node."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..integrators import RULE
from ..scene import attitude, parameter_file, schema
from ..scene.fleet import FleetScene, by_name, scene_from, split
from ..scene.loader import Scene
from ..values.parameter import NAMES, shown
from ..values.parameter import Parameter as SceneParameter

_QOS = "qos_overrides."
DEEPEST = 1_000_000  # messages in a queue: more would fill the memory before it is full
_QOS_CHOICES = {
    "durability": ("system_default", "transient_local", "volatile"),
    "history": ("system_default", "keep_last", "keep_all"),
    "reliability": ("system_default", "reliable", "best_effort"),
}

Known = Callable[[str], SceneParameter]
_FIXED = "is read at start only; start the node again with another value for it"
SIM_TIME = "use_sim_time"
_USE_SIM_TIME = (
    f"parameter {SIM_TIME} = true: this node makes the simulated time and would wait for itself; leave it false here "
    "and set it on the nodes that follow"
)


def declare(node: Node, given: Mapping[str, Any]) -> Scene | FleetScene:
    """Check the parameters given to ``node``, declare all of them, and return the scene they describe.

    Raises ValueError, with a sentence that names the parameter, when one is unknown or bad.
    """
    scene = scene_from(all_given(node, given))
    if node.get_parameter(SIM_TIME).value:
        raise ValueError(_USE_SIM_TIME)
    declare_values(node, scene.values, scene.parameter)
    return scene


def declare_values(node: Node, values: Mapping[str, Any], known: Known) -> None:
    """Declare parameters with values that were checked and converted: what was given is not read again.

    rclpy would do so, more strictly: 1 is no 1.0 there. ``known(name)`` is what is known of one.
    """
    for name, value in values.items():
        parameter = known(name)
        if value == ():
            _declare_empty_array(node, name, parameter)
        else:
            node.declare_parameter(name, _plain(value), _descriptor(parameter), ignore_override=True)


class Refusals:
    """Lets a node answer what it refuses in its own words, where rclpy has but "read-only" and "Wrong parameter type".

    rclpy looks at the parameters that the first callback hands on, so what will be refused is kept from it: it gets
    use_sim_time, which every node has and may set, with the value that it has. No exception may leave a callback: it
    would end the node.
    """

    def __init__(self, node: Node, table: Mapping[str, SceneParameter], known: Known | None = None):
        self._node, self._table = node, table
        self._known = known or partial(schema.find, table=table)
        node.add_pre_set_parameters_callback(self._complete)
        node.add_on_set_parameters_callback(self._set)

    def _complete(self, parameters: list[Parameter]) -> list[Parameter]:
        self._asked = {parameter.name: parameter for parameter in map(self._as_declared, parameters)}
        try:
            self._check()
            return [*self._asked.values(), *self._following()]
        except ValueError:
            return [self._node.get_parameter(SIM_TIME)]

    def _set(self, _: list[Parameter]) -> SetParametersResult:
        try:
            self._check()
            self._accept()
        except ValueError as reason:
            return SetParametersResult(successful=False, reason=str(reason))
        return SetParametersResult(successful=True)

    def _check(self) -> None:
        """Raise ValueError for a parameter that is none, is fixed, or arrived as a text that was meant for numbers."""
        for name, parameter in self._asked.items():
            given = f"parameter {schema.shown_name(name)} = {shown(parameter.value)}:"
            if parameter.type_ == Parameter.Type.NOT_SET:
                raise ValueError(f"{given} is no value, and parameters cannot be taken away; give one")
            attitude.refuse_row(name, parameter.value, self._table)
            if not schema.belongs_to_ros(name):
                self._check_own(given, self._known(name), parameter)
            elif name != SIM_TIME:
                raise ValueError(f"{given} {_FIXED}")

    @property
    def _dynamic(self) -> list[str]:
        """Names of those that may be set now."""
        return [each.name for each in self._table.values() if each.dynamic]

    def _check_own(self, given: str, known: SceneParameter, parameter: Parameter) -> None:
        if not known.dynamic:
            dynamic = ", ".join(self._dynamic)
            raise ValueError(
                f"{given} {_FIXED}; {f'these may be set now: {dynamic}' if dynamic else 'so is every other'}"
            )
        if parameter.type_ == Parameter.Type.STRING and known.type in (float, tuple):
            raise ValueError(f"{given} is a text; {_as_numbers(known, parameter)}")

    def _as_declared(self, parameter: Parameter) -> Parameter:
        """``2`` for a double is meant as 2.0; rclpy would refuse it."""
        try:
            wanted = self._known(parameter.name).type
        except ValueError:
            return parameter
        if wanted is float and parameter.type_ == Parameter.Type.INTEGER:
            return Parameter(parameter.name, value=float(parameter.value))
        if wanted is tuple and parameter.type_ == Parameter.Type.INTEGER_ARRAY:
            return Parameter(parameter.name, value=[float(entry) for entry in parameter.value])
        return parameter

    def _following(self) -> list[Parameter]:
        """What changes with what is asked for. Raises ValueError when that is refused."""
        return []

    def _accept(self) -> None:
        """Do what is asked for. Raises ValueError, and has done nothing, to refuse it."""


class Changes(Refusals):
    """Lets dynamic parameters change while the node runs, all that are set together or none.

    ``take(scene)`` gets the scene with the new values; it raises ValueError, and has done nothing, to refuse it.
    """

    def __init__(self, node: Node, scene: Scene | FleetScene, take: Callable[[Any], None]):
        self._scene, self._take = scene, take
        super().__init__(node, schema.BY_NAME, scene.parameter)

    def _check(self) -> None:
        super()._check()
        sim_time = self._asked[SIM_TIME].value if SIM_TIME in self._asked else False
        if sim_time is True:
            raise ValueError(_USE_SIM_TIME)
        if sim_time is not False:
            raise ValueError(f"parameter {SIM_TIME} = {shown(sim_time)}: is not of type bool; leave it false")

    @property
    def _dynamic(self) -> list[str]:
        own = tuple(by_name(self._scene))
        return [name for name in self._scene.values if not split(name, own)[0] and self._known(name).dynamic]

    def _check_own(self, given: str, known: SceneParameter, parameter: Parameter) -> None:
        super()._check_own(given, known, parameter)
        if not self._scene.has(parameter.name):
            raise ValueError(f"{given} {_none_such(parameter.name, self._scene)}")

    def _following(self) -> list[Parameter]:
        self._declare_asked()
        old, changed = self._scene.values, self._changed().values
        also = [name for name, value in changed.items() if name not in self._asked and value != old.get(name)]
        return [Parameter(name, value=_plain(changed[name])) for name in also]

    def _declare_asked(self) -> None:
        """Those of counted bodies are there when they are first set: declared, they would be thousands."""
        asked, self._asked = self._asked, {}  # rclpy calls ``_set`` of what is declared, too
        new = [name for name in asked if not self._node.has_parameter(name)]
        declare_values(self._node, {name: self._scene.value_of(name) for name in new}, self._known)
        self._asked = asked

    def _accept(self) -> None:
        scene = self._changed()
        self._take(scene)
        self._scene = scene

    def _changed(self) -> Scene | FleetScene:
        named = {name: parameter.value for name, parameter in self._asked.items()}
        return self._scene.changed({name: value for name, value in named.items() if not schema.belongs_to_ros(name)})


def _none_such(name: str, scene: Scene | FleetScene) -> str:
    """Why a parameter of a member that a group lacks cannot be set, and which members there are."""
    body, name = split(name, tuple(by_name(scene)))
    values = scene.values if isinstance(scene, Scene) else scene.scenes[body].values if body else scene.first.values
    group, member, _ = name.split(".", 2)
    there = ", ".join(f"{group}.{each}" for each in schema.members(group, values))
    remedy = f"those there are {there}" if there else f"there are no {group}; give them at the start"
    return f"there is no {schema.shown_name(f'{group}.{member}')}, and none is added while the node runs; {remedy}"


def _as_numbers(known: SceneParameter, parameter: Parameter) -> str:
    """What to write in place of a text, which a list is to `ros2 param set` when its numbers are of two kinds."""
    try:
        numbers = known.read(parameter.name, parameter_file.value(parameter.value))
    except ValueError:
        return f"give {known.rule if known.type is tuple else 'a number'}"
    return f"write {shown(numbers)}, with a point in every number"


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _declare_empty_array(node: Node, name: str, parameter: SceneParameter) -> None:
    """rclpy takes an empty list for bytes when it declares one; when it sets one it can be told the type."""
    kind = Parameter.Type.STRING_ARRAY if parameter.type == NAMES else Parameter.Type.DOUBLE_ARRAY
    node.declare_parameter(name, kind, ignore_override=True)
    node.set_parameters([Parameter(name, kind, [])])
    descriptor = _descriptor(parameter)
    descriptor.type = kind.value
    node.set_descriptor(name, descriptor)


def all_given(node: Node, given: Mapping[str, Any]) -> dict[str, Any]:
    """``given``, and what rclpy was given, but for ROS's own; it offers no public way to those not declared yet."""
    values = {}
    for name, parameter in node._parameter_overrides.items():
        if name.startswith(_QOS):
            _check_qos(name, parameter.value)
        elif not schema.belongs_to_ros(name):
            value = parameter.value
            # An empty array arrives as no value at all.
            values[name] = value if isinstance(value, str | bool | int | float) else list(value or ())
    return {**values, **given}


def of_ros(given: Mapping[str, Any]) -> list[Parameter]:
    """Those of ``given`` that are ROS's own, for rclpy. Raises ValueError for a value that no parameter can have."""
    parameters = []
    for name, value in given.items():
        if schema.belongs_to_ros(name):
            try:
                parameters.append(Parameter(name, value=value))
            except TypeError:
                raise ValueError(
                    f"parameter {name} = {shown(value)}: is not allowed; see docs/reference/interface.md"
                ) from None
    return parameters


def _check_qos(name: str, value: Any) -> None:
    policy = name.rpartition(".")[2]
    if policy == "depth" and (isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= DEEPEST):
        raise ValueError(
            f"parameter {name} = {shown(value)}: is not a whole number from 1 to {DEEPEST}; give one such as 10"
        )
    choices = _QOS_CHOICES.get(policy)
    if choices is not None and value not in choices:
        raise ValueError(f"parameter {name} = {shown(value)}: is not allowed; give one of {', '.join(choices)}")


def refuse_undeclared(node: Node) -> None:
    """Raise ValueError for a parameter given to ``node`` that it has not declared, QoS overrides included."""
    declared = sorted(node._parameters)
    for name in node._parameter_overrides:
        if name not in declared:
            raise ValueError(schema.unknown(name, name, declared))


def _descriptor(parameter: SceneParameter) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        description=f"{parameter.text}{f' [{parameter.unit}]' if parameter.unit else ''}",
        additional_constraints=RULE if parameter.name == "integrator.name" else parameter.rule,
        read_only=not parameter.dynamic,
    )
    if parameter.type is float and parameter.most is not None:
        low = parameter.least if parameter.least is not None else parameter.above
        descriptor.floating_point_range = [FloatingPointRange(from_value=low or 0.0, to_value=parameter.most)]
    return descriptor
