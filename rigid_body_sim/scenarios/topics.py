"""Which topics of a bag are the commands, the pose and the twist of the body that is simulated again."""

from collections.abc import Collection, Mapping, Sequence

from ..bags.reading import POSES, Bag
from ..bags.rosbags_support import ACTUATORS, BagError
from ..scene.loader import Scene

NOT_COMMANDS = ("impulse", "wrench_applied")  # of type WrenchStamped, too
MOST_LISTED = 12
OTHERS = ("impulse", "set_pose", "set_twist", "fluid_velocity")  # which change the motion without being wrench commands
USUAL = ("pose", "odom")  # names of the topics that have the body's poses
A_COMMAND = "geometry_msgs/WrenchStamped or Wrench"
A_POSE = "geometry_msgs/PoseStamped, PoseWithCovarianceStamped or TransformStamped, or nav_msgs/Odometry"


def commands(bag: Bag, scene: Scene, asked: Sequence[str]) -> tuple[str, ...]:
    """Names of the topics with commands: those asked for, else those of the scene, or the only one with wrenches.

    The first leads in lockstep. None for a bag with poses and without commands. Raises BagError when there is neither,
    or no telling which.
    """
    actuators = _to_actuators(bag, scene)
    if asked:
        heard = [name for name in asked if not any(_is(silent, name) for silent in bag.silent)]
        known = {**bag.wrenches, **{name: bag.numbers[name] for name in actuators}}
        return tuple(_of_type(bag, name, known, A_COMMAND) for name in heard)
    wrenches = _with_wrenches(bag, scene)
    return actuators + wrenches if "actuators" in scene["lockstep_on"] else wrenches + actuators


def _to_actuators(bag: Bag, scene: Scene) -> tuple[str, ...]:
    """The topic on which there is a command with as many numbers as the scene has actuators."""
    count = len(scene["actuators.names"])
    found = [name for name, given in bag.numbers.items() if count and count in map(len, given.values)]
    if len(found) > 1:
        raise BagError(f"{bag.path}: has commands to the actuators of several bodies: {_listed(found)}; cut it to one")
    return tuple(found)


def _with_wrenches(bag: Bag, scene: Scene) -> tuple[str, ...]:
    found = [name for name in bag.wrenches if _last(name) not in NOT_COMMANDS]
    named = [[name for name in found if _is(name, topic)] for topic in scene["wrench.topics"]]
    if any(named) and all(len(names) <= 1 for names in named):
        return tuple(dict.fromkeys(name for names in named for name in names))
    if len(found) <= 1:
        return tuple(found)
    raise BagError(f"{bag.path}: has several topics of type {A_COMMAND}: {_listed(found)}; choose with --topic")


def pose(bag: Bag, scene: Scene, asked: str | None) -> str | None:
    """Name of the topic with the body's poses; None when there is none. Raises BagError when there is no telling.

    That is the one asked for, else the one named ``pose``, else ``odom``, else the only one of a type, in the order of
    POSES.
    """
    if asked is not None:
        return _of_type(bag, asked, bag.poses, A_POSE)
    found = [name for name in bag.poses if _last(name) != "set_pose"]
    groups = [[name for name in found if _last(name) == usual] for usual in USUAL]
    groups += [[name for name in found if bag.types[name] == kind] for kind in POSES]
    likeliest = next(filter(None, groups), [])
    if len(likeliest) > 1:
        raise BagError(
            f"{bag.path}: has several topics of type {bag.types[likeliest[0]]}: {_listed(likeliest)}; "
            f"choose the body's in {scene['world_frame_id']!r} with --pose"
        )
    return next(iter(likeliest), None)


def twist(bag: Bag, pose: str | None) -> str | None:
    """Name of the topic with the twists: that of the poses, else ``twist`` or ``odom`` beside it, else the only one."""
    if pose is None:
        return None
    found = [name for name in bag.twists if _last(name) != "set_twist"]
    for name in (pose, beside(pose, "twist"), beside(pose, "odom")):
        if name in found:
            return name
    return found[0] if len(found) == 1 else None


def beside(topic: str, last: str) -> str:
    """A topic in the namespace of another one."""
    return f"{topic.rpartition('/')[0]}/{last}"


def there(bag: Bag) -> str:
    """The topics of a bag and their types, in words."""
    return _listed([f"{name} ({kind or 'without a type'})" for name, kind in bag.types.items()])


def left_out(bag: Bag, known: Collection[str]) -> list[str]:
    """Topics that changed the motion, perhaps, and of whose messages only the node's own journal knows the effect."""
    return [
        name for name, kind in bag.types.items() if (_last(name) in OTHERS or kind == ACTUATORS) and name not in known
    ]


def not_used(bag: Bag, known: Collection[str]) -> list[str]:
    """Further topics that may be commands."""
    found = (*bag.wrenches, *bag.numbers)
    return [name for name in found if _last(name) not in NOT_COMMANDS and name not in known]


def not_compared(bag: Bag, pose: str | None) -> list[str]:
    """Further topics with poses, but for those that set the state."""
    return [name for name in bag.poses if _last(name) not in OTHERS and name != pose]


def counted(bag: Bag, names: Collection[str]) -> str:
    """Topics in words, with the number and the type of their messages."""
    return _listed([f"{name} ({bag.counts[name]} {bag.types[name]})" for name in names])


def _of_type(bag: Bag, asked: str, messages: Mapping[str, object], kind: str) -> str:
    found = [name for name in bag.types if _is(name, asked)]
    if not found:
        raise BagError(f"{bag.path}: has no topic {asked}; it has {_listed(bag.types)}")
    if found[0] not in messages:
        raise BagError(f"{bag.path}: topic {found[0]} is of type {bag.types[found[0]]}; give one of type {kind}")
    return found[0]


def _is(name: str, asked: str) -> bool:
    """Whether a topic of a bag is the one that somebody calls so, in whatever namespace when that is left out."""
    return name == asked or (not asked.startswith("/") and name.endswith(f"/{asked}"))


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def _listed(names: Collection[str]) -> str:
    first, more = sorted(names)[:MOST_LISTED], len(names) - MOST_LISTED
    return ", ".join([*first, *([f"{more} more"] if more > 0 else [])])
