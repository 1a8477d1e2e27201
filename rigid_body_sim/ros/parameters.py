"""The schema's parameters as ROS parameters of a node."""

from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..scene import schema
from ..scene.loader import Scene

_QOS = "qos_overrides."
_QOS_CHOICES = {
    "durability": ("system_default", "transient_local", "volatile"),
    "history": ("system_default", "keep_last", "keep_all"),
    "reliability": ("system_default", "reliable", "best_effort"),
}

_USE_SIM_TIME = (
    "parameter use_sim_time = true: this node makes the simulated time and would wait for itself; leave it false here "
    "and set it on the nodes that follow"
)


def declare(node: Node) -> Scene:
    """Check the parameters given to ``node``, declare all of them, and return the scene they describe.

    Raises ValueError, with a sentence that names the parameter, when one is unknown or bad.
    """
    scene = Scene(_given(node))
    if node.get_parameter("use_sim_time").value:
        raise ValueError(_USE_SIM_TIME)
    for name, value in scene.values.items():
        # Checked and converted above (1 for 1.0, say): the value given must not be read a second time, more strictly.
        if value == ():
            _declare_empty_array(node, name)
        else:
            value = list(value) if isinstance(value, tuple) else value
            node.declare_parameter(name, value, _descriptor(name), ignore_override=True)
    node.add_on_set_parameters_callback(_refuse_sim_time)
    return scene


def _declare_empty_array(node: Node, name: str) -> None:
    """rclpy takes an empty list for bytes when it declares one; when it sets one it can be told the type."""
    kind = Parameter.Type.STRING_ARRAY if schema.find(name).type == schema.NAMES else Parameter.Type.DOUBLE_ARRAY
    node.declare_parameter(name, kind, ignore_override=True)
    node.set_parameters([Parameter(name, kind, [])])
    descriptor = _descriptor(name)
    descriptor.type = kind.value
    node.set_descriptor(name, descriptor)


def _given(node: Node) -> dict[str, Any]:
    """Dotted names and values from files and the command line; rclpy offers no public way to those not declared yet."""
    given = {}
    for name, parameter in node._parameter_overrides.items():
        if name.startswith(_QOS):
            _check_qos(name, parameter.value)
        elif not schema.belongs_to_ros(name):
            value = parameter.value
            # An empty array arrives as no value at all.
            given[name] = value if isinstance(value, str | bool | int | float) else list(value or ())
    return given


def _check_qos(name: str, value: Any) -> None:
    policy = name.rpartition(".")[2]
    if policy == "depth" and (isinstance(value, bool) or not isinstance(value, int) or value < 1):
        raise ValueError(f"parameter {name} = {value!r}: is not a whole number of at least 1; give one such as 10")
    choices = _QOS_CHOICES.get(policy)
    if choices is not None and value not in choices:
        raise ValueError(f"parameter {name} = {value!r}: is not allowed; give one of {', '.join(choices)}")


def refuse_undeclared(node: Node) -> None:
    """Raise ValueError for a parameter given to ``node`` that it has not declared, QoS overrides included."""
    declared = sorted(node._parameters)
    for name in node._parameter_overrides:
        if name not in declared:
            raise ValueError(schema.unknown(name, name, declared))


def _descriptor(name: str) -> ParameterDescriptor:
    parameter = schema.find(name)
    descriptor = ParameterDescriptor(
        description=f"{parameter.text}{f' [{parameter.unit}]' if parameter.unit else ''}",
        additional_constraints=parameter.rule,
        read_only=True,
    )
    if parameter.type is float and parameter.most is not None:
        low = parameter.least if parameter.least is not None else parameter.above
        descriptor.floating_point_range = [FloatingPointRange(from_value=low or 0.0, to_value=parameter.most)]
    return descriptor


def _refuse_sim_time(parameters: list[Parameter]) -> SetParametersResult:
    wanted = any(parameter.name == "use_sim_time" and parameter.value for parameter in parameters)
    return SetParametersResult(successful=not wanted, reason=_USE_SIM_TIME if wanted else "")
