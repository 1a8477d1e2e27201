"""Commands to actuators: on which topics the node takes them, and what the bytes that arrive there say."""

import contextlib
import importlib
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from std_msgs.msg import Float64MultiArray

from ..messages import cdr
from ..scene.loader import Scene
from . import messages

TOPIC = "actuator_commands"
OF_ROTORS = "actuators"  # where whoever drives Gazebo's multicopters sends, if the package of that message is there
PACKAGE = "actuator_msgs"

Numbers = Sequence[float]
Reader = Callable[[bytes], Numbers]


def topics(scene: Scene) -> dict[str, tuple[type, Reader]]:
    """By topic, the type of its messages, and what reads a command from their bytes, or raises RefusedError.

    None where there are no actuators; that of rotors where all are.
    """
    if not scene["actuators.names"]:
        return {}
    found: dict[str, tuple[type, Reader]] = {TOPIC: (Float64MultiArray, read_numbers)}
    all_rotors = all(scene[f"actuators.{name}.type"] == "rotor" for name in scene["actuators.names"])
    if all_rotors:
        with contextlib.suppress(ImportError):
            kind = importlib.import_module(f"{PACKAGE}.msg").Actuators
            found[OF_ROTORS] = kind, partial(read_speeds, kind)
    return found


def leading(scene: Scene) -> tuple[str, ...]:
    """The topics whose commands advance the simulation in lockstep."""
    return tuple(topics(scene)) if "actuators" in scene["lockstep_on"] else scene["wrench.topics"][:1]


def read_numbers(data: bytes) -> Numbers:
    """The numbers of a Float64MultiArray, whatever its layout says of them. Raises RefusedError for what is none."""
    numbers = cdr.split_numbers(data)
    if numbers is None:
        numbers = tuple(messages.deserialised(data, Float64MultiArray, TOPIC).data)
    return numbers


def read_speeds(kind: type, data: bytes) -> Numbers:
    """The speeds [rad/s] in a message of actuator_msgs. Raises RefusedError for what is none."""
    message: Any = messages.deserialised(data, kind, OF_ROTORS)
    return tuple(message.velocity)
