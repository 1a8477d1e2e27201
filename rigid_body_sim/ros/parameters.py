"""The schema's parameters as ROS parameters of a node."""

from collections.abc import Callable, Mapping
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..integrators import RULE
from ..scene import schema
from ..scene.loader import Scene

_QOS = "qos_overrides."
DEEPEST = 1_000_000  # messages in a queue: more would fill the memory before it is full
_QOS_CHOICES = {
    "durability": ("system_default", "transient_local", "volatile"),
    "history": ("system_default", "keep_last", "keep_all"),
    "reliability": ("system_default", "reliable", "best_effort"),
}

_USE_SIM_TIME = (
    "parameter use_sim_time = true: this node makes the simulated time and would wait for itself; leave it false here "
    "and set it on the nodes that follow"
)


def declare(node: Node, given: Mapping[str, Any]) -> Scene:
    """Check the parameters given to ``node``, declare all of them, and return the scene they describe.

    Raises ValueError, with a sentence that names the parameter, when one is unknown or bad.
    """
    scene = Scene(all_given(node, given))
    if node.get_parameter("use_sim_time").value:
        raise ValueError(_USE_SIM_TIME)
    declare_values(node, scene.values, schema.BY_NAME)
    return scene


def declare_values(node: Node, values: Mapping[str, Any], table: Mapping[str, schema.Parameter]) -> None:
    """Declare the parameters of a table with values that were checked and converted: what was given is not read again.

    rclpy would do so, more strictly: 1 is no 1.0 there.
    """
    for name, value in values.items():
        parameter = schema.find(name, table)
        if value == ():
            _declare_empty_array(node, name, parameter)
        else:
            node.declare_parameter(name, _plain(value), _descriptor(parameter), ignore_override=True)


class Changes:
    """Lets dynamic parameters change while the node runs, all that are set together or none.

    ``take(scene)`` gets the scene with the new values; it raises ValueError, and has done nothing, to refuse it. No
    exception may leave a callback: it would end the node.
    """

    def __init__(self, node: Node, scene: Scene, take: Callable[[Scene], None]):
        self._node, self._scene, self._take = node, scene, take
        node.add_pre_set_parameters_callback(self._complete)
        node.add_on_set_parameters_callback(self._set)

    def _complete(self, parameters: list[Parameter]) -> list[Parameter]:
        """Whole numbers as floats where those are meant, and what follows from the new values beside them."""
        self._asked = {parameter.name: parameter for parameter in map(_as_declared, parameters)}
        try:
            changed = self._changed().values
        except ValueError:
            # Refused with the reason once rclpy has looked at names and types. Of an unknown name it does not tell
            # which it is, and an empty list it does not pass on.
            known = [parameter for name, parameter in self._asked.items() if self._node.has_parameter(name)]
            return known or [Parameter("body.mass", value=self._scene["body.mass"])]
        old = self._scene.values
        also = [name for name, value in changed.items() if name not in self._asked and value != old.get(name)]
        return [*self._asked.values(), *(Parameter(name, value=_plain(changed[name])) for name in also)]

    def _set(self, _: list[Parameter]) -> SetParametersResult:
        sim_time = self._asked.get("use_sim_time")
        if sim_time is not None and sim_time.value:
            return SetParametersResult(successful=False, reason=_USE_SIM_TIME)
        try:
            scene = self._changed()
            self._take(scene)
        except ValueError as reason:
            return SetParametersResult(successful=False, reason=str(reason))
        self._scene = scene
        return SetParametersResult(successful=True)

    def _changed(self) -> Scene:
        for name in self._asked:
            if not self._node.has_parameter(name):
                raise ValueError(schema.unknown(name, name, self._scene.values))
        named = {name: parameter.value for name, parameter in self._asked.items()}
        return self._scene.changed({name: value for name, value in named.items() if not schema.belongs_to_ros(name)})


def _as_declared(parameter: Parameter) -> Parameter:
    """``2`` for a double is meant as 2.0; rclpy would refuse it."""
    try:
        wanted = schema.find(parameter.name).type
    except ValueError:
        return parameter
    if wanted is float and parameter.type_ == Parameter.Type.INTEGER:
        return Parameter(parameter.name, value=float(parameter.value))
    if wanted is tuple and parameter.type_ == Parameter.Type.INTEGER_ARRAY:
        return Parameter(parameter.name, value=[float(entry) for entry in parameter.value])
    return parameter


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _declare_empty_array(node: Node, name: str, parameter: schema.Parameter) -> None:
    """rclpy takes an empty list for bytes when it declares one; when it sets one it can be told the type."""
    kind = Parameter.Type.STRING_ARRAY if parameter.type == schema.NAMES else Parameter.Type.DOUBLE_ARRAY
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
                    f"parameter {name} = {schema.shown(value)}: is not allowed; see docs/interface.md"
                ) from None
    return parameters


def _check_qos(name: str, value: Any) -> None:
    policy = name.rpartition(".")[2]
    if policy == "depth" and (isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= DEEPEST):
        raise ValueError(
            f"parameter {name} = {schema.shown(value)}: is not a whole number from 1 to {DEEPEST}; give one such as 10"
        )
    choices = _QOS_CHOICES.get(policy)
    if choices is not None and value not in choices:
        raise ValueError(f"parameter {name} = {schema.shown(value)}: is not allowed; give one of {', '.join(choices)}")


def refuse_undeclared(node: Node) -> None:
    """Raise ValueError for a parameter given to ``node`` that it has not declared, QoS overrides included."""
    declared = sorted(node._parameters)
    for name in node._parameter_overrides:
        if name not in declared:
            raise ValueError(schema.unknown(name, name, declared))


def _descriptor(parameter: schema.Parameter) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        description=f"{parameter.text}{f' [{parameter.unit}]' if parameter.unit else ''}",
        additional_constraints=RULE if parameter.name == "integrator.name" else parameter.rule,
        read_only=not parameter.dynamic,
    )
    if parameter.type is float and parameter.most is not None:
        low = parameter.least if parameter.least is not None else parameter.above
        descriptor.floating_point_range = [FloatingPointRange(from_value=low or 0.0, to_value=parameter.most)]
    return descriptor
