"""Commands in ROS messages: what they mean, and why some are refused."""

import contextlib
import math
from collections.abc import Callable, Iterator
from typing import Any

from geometry_msgs.msg import WrenchStamped
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header

from ..physics.wrench import Wrench
from ..scene.loader import Scene

NANOSECONDS = 1_000_000_000

NOT_FINITE = "not finite"
UNKNOWN_FRAME = "unknown frame"
NOT_FOR_INTEGRATOR = "not for this integrator"
NOT_A_ROTATION = "not a rotation"
MALFORMED = "malformed"
STOPPED = "stopped"
REFUSALS = (NOT_FINITE, UNKNOWN_FRAME, NOT_FOR_INTEGRATOR, NOT_A_ROTATION, MALFORMED, STOPPED)

Vector = tuple[float, ...]
Meaning = Callable[[Vector, Vector], Wrench]  # of a force [N] and a torque [N m] in some frame
Limit = Callable[[Vector, Vector], tuple[Vector, Vector]]  # of a force [N] and a torque [N m]


class RefusedError(Exception):
    """A command that is not accepted: ``reason`` is one of REFUSALS, the text says what would be right."""

    def __init__(self, reason: str, text: str):
        super().__init__(text)
        self.reason = reason


def stamp(header: Header, time_ns: int) -> None:
    """Write a time [ns] into a header."""
    header.stamp.sec, header.stamp.nanosec = divmod(time_ns, NANOSECONDS)


def meaning(frame_id: str, scene: Scene, what: str) -> Meaning:
    """What a force and a torque mean when they are sent in a frame. Raises RefusedError for an unknown frame."""
    name = frame_id.removeprefix("/")
    if not name:
        name = scene["body.frame_id"] if scene["wrench.frame"] == "body" else scene["world_frame_id"]
    if name == scene["body.frame_id"]:
        return lambda force, torque: Wrench(force_body=force, torque_body=torque)
    if name == scene["world_frame_id"]:
        return lambda force, torque: Wrench(force_world=force, torque_world=torque)
    if name in scene.frames:
        return scene.frames[name].wrench
    known = ", ".join([scene["body.frame_id"], scene["world_frame_id"], *scene.frames])
    text = f"{what} in frame {name!r} refused: send it in one of {known}, or leave frame_id empty"
    raise RefusedError(UNKNOWN_FRAME, text)


def check_frame(what: str, frame_id: str, known: set[str]) -> str:
    """The frame without a leading '/'. Raises RefusedError unless it is known or empty."""
    name = frame_id.removeprefix("/")
    if name and name not in known:
        choice = " or ".join(sorted(known))
        raise RefusedError(
            UNKNOWN_FRAME, f"{what} in frame {name!r} refused: send it in {choice}, or leave frame_id empty"
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


def scaled_down(vector: Vector, most: float) -> Vector:
    """``vector``, or where it is longer than ``most``, one of that length in its direction."""
    largest = max(map(abs, vector))
    if math.hypot(*vector) <= most:
        return vector
    unit = [component / largest for component in vector]  # lengths of floats near the largest are not finite
    factor = most / math.hypot(*unit)
    return tuple(factor * component for component in unit)


def make_wrench(meaning: Meaning, force: Vector, torque: Vector, what: str, limit: Limit) -> Wrench:
    """The wrench of a force [N] and a torque [N m] within limits. Raises RefusedError when it is not finite."""
    if not all(map(math.isfinite, force + torque)):
        raise RefusedError(NOT_FINITE, f"{what} with force {force} and torque {torque} refused: it is not finite")
    try:
        return meaning(*limit(force, torque))
    except ValueError as reason:
        raise RefusedError(NOT_FINITE, f"{what} with force {force} and torque {torque} refused: {reason}") from None


def unlimited(force: Vector, torque: Vector) -> tuple[Vector, Vector]:
    """Both as they are."""
    return force, torque


def read_wrench(message: WrenchStamped, scene: Scene, what: str = "wrench", limit: Limit = unlimited) -> Wrench:
    """The wrench that a command means, from the frame in its header; ``what`` it is called when it is refused.

    Raises RefusedError when it cannot be accepted.
    """
    f, t = message.wrench.force, message.wrench.torque
    return make_wrench(meaning(message.header.frame_id, scene, what), (f.x, f.y, f.z), (t.x, t.y, t.z), what, limit)
