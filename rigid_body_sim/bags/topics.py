"""Which topics of a bag are the commands, the pose and the twist of the body that is simulated again."""

from collections.abc import Collection, Mapping, Sequence

from ..scene.loader import Scene
from .reading import Messages, Recording
from .rosbags_support import BagError

NOT_COMMANDS = ("impulse", "wrench_applied")  # of type WrenchStamped, too
MOST_LISTED = 12
OTHERS = ("impulse", "set_pose", "set_twist")  # which change the motion without being wrench commands


def commands(recording: Recording, scene: Scene, asked: Sequence[str]) -> tuple[str, ...]:
    """Names of the topics with wrench commands: those asked for, else those of the scene, else the only one.

    The first leads in lockstep. Raises BagError when there is none, or no telling which.
    """
    if asked:
        return tuple(_of_type(recording, name, recording.wrenches, "WrenchStamped or Wrench") for name in asked)
    found = [name for name in recording.wrenches if _last(name) not in NOT_COMMANDS]
    named = [[name for name in found if _is(name, topic)] for topic in scene["wrench.topics"]]
    if any(named) and all(len(names) <= 1 for names in named):
        return tuple(dict.fromkeys(name for names in named for name in names))
    if len(found) == 1:
        return tuple(found)
    kind = "geometry_msgs/WrenchStamped or Wrench"
    if not found:
        raise BagError(
            f"{recording.path}: has no topic of type {kind} with commands; it has "
            + _listed([f"{name} ({its})" for name, its in recording.types.items()])
        )
    raise BagError(f"{recording.path}: has several topics of type {kind}: {_listed(found)}; choose with --topic")


def pose(recording: Recording, scene: Scene, asked: str | None) -> str | None:
    """Name of the topic with the body's poses; None when there is none. Raises BagError when there is no telling."""
    return _one(recording, recording.poses, "pose", "PoseStamped", asked, scene["world_frame_id"])


def twist(recording: Recording, pose: str | None) -> str | None:
    """Name of the topic with the twists that go with ``pose``: ``twist`` beside it, or else the only one."""
    if pose is None:
        return None
    beside = f"{pose.rpartition('/')[0]}/twist"
    found = [name for name in recording.twists if _last(name) != "set_twist"]
    return beside if beside in found else found[0] if len(found) == 1 else None


def left_out(recording: Recording, known: Collection[str]) -> list[str]:
    """Topics that changed the motion, perhaps, and of whose messages only the node's own journal knows the effect."""
    return [name for name in recording.types if _last(name) in OTHERS and name not in known]


def _one(
    recording: Recording, messages: Mapping[str, Messages], usual: str, kind: str, asked: str | None, frame: str
) -> str | None:
    if asked is not None:
        return _of_type(recording, asked, messages, kind)
    found = [name for name in messages if _last(name) != f"set_{usual}"]
    usually = [name for name in found if _last(name) == usual]
    if len(found) > 1 and len(usually) != 1:
        raise BagError(
            f"{recording.path}: has several topics of type {kind}: {_listed(found)}; choose the body's in {frame!r} "
            f"with --{usual}"
        )
    return next(iter(usually or found), None)


def _of_type(recording: Recording, asked: str, messages: Mapping[str, Messages], kind: str) -> str:
    found = [name for name in recording.types if _is(name, asked)]
    if not found:
        raise BagError(f"{recording.path}: has no topic {asked}; it has {_listed(recording.types)}")
    if found[0] not in messages:
        raise BagError(
            f"{recording.path}: topic {found[0]} is of type {recording.types[found[0]]}; give one of type "
            f"geometry_msgs/{kind}"
        )
    return found[0]


def _is(name: str, asked: str) -> bool:
    """Whether a topic of a bag is the one that somebody calls so, in whatever namespace when that is left out."""
    return name == asked or (not asked.startswith("/") and name.endswith(f"/{asked}"))


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def _listed(names: Collection[str]) -> str:
    first, more = sorted(names)[:MOST_LISTED], len(names) - MOST_LISTED
    return ", ".join([*first, *([f"{more} more"] if more > 0 else [])])
