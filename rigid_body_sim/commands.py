"""What a wrench command means: the frames in which it may be sent, and why some are refused."""

import math
from collections.abc import Callable, Sequence

from .scene.loader import Scene
from .values.parameter import shown
from .values.wrench import Wrench

NOT_FINITE = "not finite"
UNKNOWN_FRAME = "unknown frame"

Vector = Sequence[float]
Meaning = Callable[[Vector, Vector], Wrench]  # of a force [N] and a torque [N m] in some frame
Limit = Callable[[Vector, Vector], tuple[Vector, Vector]]  # of a force [N] and a torque [N m]


class RefusedError(Exception):
    """A command that is not accepted: ``reason`` is the kind of fault, such as NOT_FINITE; the text says the rest."""

    def __init__(self, reason: str, text: str):
        super().__init__(text)
        self.reason = reason


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
    text = f"{what} in frame {shown(name)} refused: send it in one of {known}, or leave frame_id empty"
    raise RefusedError(UNKNOWN_FRAME, text)


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
    if not all(map(math.isfinite, (*force, *torque))):
        raise RefusedError(
            NOT_FINITE, f"{what} with force {shown(force)} and torque {shown(torque)} refused: it is not finite"
        )
    try:
        return meaning(*limit(force, torque))
    except ValueError as reason:
        raise RefusedError(
            NOT_FINITE, f"{what} with force {shown(force)} and torque {shown(torque)} refused: {reason}"
        ) from None


def unlimited(force: Vector, torque: Vector) -> tuple[Vector, Vector]:
    """Both as they are."""
    return force, torque
