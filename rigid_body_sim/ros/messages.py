"""Commands in ROS messages, and why some are refused; what a wrench means is in commands."""

import contextlib
from collections.abc import Iterator
from typing import Any

from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header

from ..commands import NOT_FINITE, UNKNOWN_FRAME, Limit, RefusedError, make_wrench, meaning, unlimited
from ..scene.loader import Scene
from ..values.parameter import shown
from ..values.wrench import Wrench

NANOSECONDS = 1_000_000_000
LATEST_STAMP_NS = 2**31 * NANOSECONDS - 1  # builtin_interfaces/Time counts seconds in 32 bits: until 2038-01-19

NOT_FOR_INTEGRATOR = "not for this integrator"
NOT_A_ROTATION = "not a rotation"
NO_FLOW = "no flow"
MALFORMED = "malformed"
STOPPED = "stopped"
WRONG_LENGTH = "wrong length"  # counted where there are actuators
REFUSALS = (NOT_FINITE, UNKNOWN_FRAME, NOT_FOR_INTEGRATOR, NOT_A_ROTATION, NO_FLOW, MALFORMED, STOPPED)


def type_name(kind: type) -> str:
    """The name of a message's type as ROS writes it, ``geometry_msgs/msg/Wrench``."""
    return f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"


def inside(space: str, topic: str) -> str:
    """A topic in a namespace; one of its own place, ``/clock`` or ``~/journal``, is none of those."""
    return f"{space}/{topic}" if space and topic[:1] not in ("/", "~") else topic


def overridable(node: Node, space: str, topic: str) -> QoSOverridingOptions | None:
    """That parameters ``qos_overrides.*`` may change the QoS of a topic.

    They are three for each topic: of one in the namespace of one of several bodies they are there when they are given.
    """
    begin = f"qos_overrides.{node.resolve_topic_name(topic)}."
    if space and not any(name.startswith(begin) for name in node._parameter_overrides):
        return None
    return QoSOverridingOptions.with_default_policies()


def stamp(header: Header, time_ns: int) -> None:
    """Write a time [ns] into a header, or the latest one that it holds."""
    header.stamp.sec, header.stamp.nanosec = divmod(min(time_ns, LATEST_STAMP_NS), NANOSECONDS)


def check_frame(what: str, frame_id: str, known: set[str]) -> str:
    """The frame without a leading '/'. Raises RefusedError unless it is known or empty."""
    name = frame_id.removeprefix("/")
    if name and name not in known:
        choice = " or ".join(sorted(known))
        raise RefusedError(
            UNKNOWN_FRAME, f"{what} in frame {shown(name)} refused: send it in {choice}, or leave frame_id empty"
        )
    return name


@contextlib.contextmanager
def refusing(what: str, reason: str = NOT_FINITE) -> Iterator[None]:
    """Turn a ValueError about the numbers in a message into a refusal for that reason."""
    try:
        yield
    except ValueError as text:
        raise RefusedError(reason, f"{what} refused: {text}") from None


def deserialised(data: bytes, kind: type, what: str) -> Any:
    """The message of type ``kind`` in the bytes. Raises RefusedError when there is none."""
    try:
        return deserialize_message(data, kind)
    except Exception:  # RMWError for bytes, and whatever else a type support makes of them
        name = f"{kind.__module__.split('.')[0]}/{kind.__name__}"
        raise RefusedError(
            MALFORMED,
            f"{what} of {len(data)} bytes refused: they are not a serialised {name}; "
            "send one with the message definition of this ROS version",
        ) from None


def read_wrench(message: WrenchStamped, scene: Scene, what: str = "wrench", limit: Limit = unlimited) -> Wrench:
    """The wrench that a command means, from the frame in its header; ``what`` it is called when it is refused.

    Raises RefusedError when it cannot be accepted.
    """
    f, t = message.wrench.force, message.wrench.torque
    return make_wrench(meaning(message.header.frame_id, scene, what), (f.x, f.y, f.z), (t.x, t.y, t.z), what, limit)
