"""The journal of a run: every call that decides the motion, with the step before which it took effect.

A bag holds it as the topic ``~/journal`` (std_msgs/msg/String, one JSON object a message). Its first entry is the
scene. Python writes a float with as many digits as read back to the bit, so a run can be repeated to the bit.
"""

import dataclasses
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import __version__
from ..kernels import compiled
from ..scene import attitude
from ..scene.fleet import FleetScene, scene_from
from ..scene.loader import Scene
from ..values.body import Body
from ..values.state import State
from ..values.wrench import Wrench
from .rosbags_support import BagError

TOPIC = "~/journal"  # of the node, so /ns/rigid_body_node/journal in the bag
TYPE = "std_msgs/msg/String"
SCENE = "scene"  # first entry
LOST = "lost"  # entries that could not be kept would stand here
CALLS = ("set_wrench", "clear_wrench", "set_actuators", "change", "apply_impulse", "set_state", "reset", "restart_time")
COMMANDS = ("set_wrench", "set_actuators", "apply_impulse")  # those for which start_on_command waits

# What mass, inertia and centre of mass may follow from: an entry has what follows, so that a bag is enough.
_SOURCES = (
    "body.shape",
    "body.dimensions",
    "body.density",
    "body.mesh_file",
    "body.mesh_scale",
    "body.urdf_file",
    "body.urdf_link",
)
_PARTS = ("force_body", "torque_body", "force_world", "torque_world")
STATE = ("position", "orientation", "velocity", "angular_velocity")  # what an entry has of a State
Values = dict[str, Any]  # of JSON


# Texts ----------------------------------------------------------------------------------------------------------------


def scene_values(scene: Scene | FleetScene, epoch_ns: int) -> Values:
    """Values of the first entry, of a run whose step 0 has the stamp ``epoch_ns``."""
    values = scene.values if isinstance(scene, Scene) else scene.parameters(but=_SOURCES)
    kept = {name: value for name, value in values.items() if name not in _SOURCES}
    return {
        "epoch_ns": epoch_ns,
        "version": __version__,
        "kernels": compiled.sources_digest(),
        "parameters": kept,
    }


def text(time_ns: int, step: int, call: str, values: Mapping[str, Any]) -> str:
    """The entry, logged at ``time_ns``, of a call that decides the motion."""
    return json.dumps({"time_ns": time_ns, "step": step, "call": call, **values}, default=_plain, allow_nan=False)


def _plain(value: Any) -> Any:
    """What JSON knows in place of what it does not."""
    if isinstance(value, Wrench):
        points = {"points": value.points} if value.points else {}
        return {**{part: value.values[3 * i : 3 * i + 3] for i, part in enumerate(_PARTS)}, **points}
    if isinstance(value, State):
        return {name: getattr(value, name).tolist() for name in STATE}
    if isinstance(value, Body):
        names = ("mass", "inertia", "center_of_mass")
        return {name: np.asarray(getattr(value, name)).tolist() for name in names}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):  # as effects are
        return dataclasses.asdict(value)
    return np.asarray(value, float).tolist()


# Entries --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Entry:
    """A call: at which time [ns] it was logged, how many steps were done then, its name and its values, as in JSON.

    Of several bodies it is a call for one, whose name is ``body``, or for all.

    Times in one bag never repeat: whatever message has an earlier log time came before it, and the others after it.
    """

    time_ns: int
    step: int
    call: str
    values: Values
    body: str = ""


def read(texts: Iterable[str]) -> list[Entry]:
    """The entries in a bag's journal. Raises BagError with what is wrong about one."""
    return [_read(place, line) for place, line in enumerate(texts)]


def _read(place: int, line: str) -> Entry:
    try:
        values = json.loads(line)
        body = str(values.pop("of", ""))
        entry = Entry(_integer(values, "time_ns"), _integer(values, "step"), values.pop("call"), values, body)
        if entry.call not in (*CALLS, SCENE, LOST):
            raise ValueError(f"call {entry.call!r} is not known to version {__version__}")
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as reason:
        raise BagError(f"entry {place} of the journal is not as rigid_body_node writes it: {reason!r}") from None
    return entry


def _integer(values: Values, name: str) -> int:
    """Taken out of the values. Raises TypeError for what is none."""
    value = values.pop(name)
    if type(value) is not int:
        raise TypeError(f"{name} is no whole number")
    return value


def hole(entry: Entry) -> BagError:
    """What is said of a LOST entry by whoever cannot do without what is lost."""
    return BagError(
        f"the journal has a hole after step {entry.step}, where the recorder's buffer was full; the run can be "
        "repeated up to there"
    )


@dataclass(frozen=True)
class Beginning:
    """The first entry: the scene (with the mass and inertia in use, no files needed), and what ran it.

    ``epoch_ns`` is the stamp of step 0. ``kernels`` is compiled.sources_digest() of the node that wrote it: with the
    same one the same bits follow.
    """

    scene: Scene | FleetScene
    epoch_ns: int
    version: str
    kernels: str


def starts_on_command(first: Entry) -> bool:
    """Whether the body of a journal's scene stays until the first of COMMANDS, and after a reset again."""
    return bool(first.values["parameters"].get("start_on_command", False))  # earlier versions have no such parameter


def beginning(entries: Iterable[Entry]) -> Beginning:
    """What a journal begins with. Raises BagError when that is no scene."""
    first = next(iter(entries), None)
    if first is None or first.call != SCENE:
        raise BagError("the journal does not begin with a scene; give a bag whose first file is there")
    values = dict(first.values)
    try:
        scene, epoch_ns = scene_from(attitude.named(values["parameters"])), _integer(values, "epoch_ns")
        return Beginning(scene, epoch_ns, values["version"], values["kernels"])
    except (AttributeError, KeyError, TypeError, ValueError) as reason:
        raise BagError(f"the scene in the journal cannot be read by version {__version__}: {reason}") from None
