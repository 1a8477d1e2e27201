"""What a bag says about a run: where it starts, and which commands reached it when."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..bags import journal as journals
from ..bags.reading import ODOMETRY, POSE, TWIST, Bag, Messages
from ..bags.rosbags_support import BagError
from ..kernels import compiled
from ..kernels import state as flat
from ..kernels.arrays import Floats, Integers
from ..kernels.compiled import sources_digest
from ..scene.fleet import FleetScene
from ..scene.loader import Scene
from ..values import rotation
from ..values.state import State, flatten
from ..values.wrench import Wrench
from . import timing, topics

NANOSECONDS = 1_000_000_000
ROUNDED_NS = 2.0  # by which the time from one stamp to another may differ from whole steps
MOST_POSES = 50_000_000  # that a bag without any is given
SAME_START = 1e-9  # m, rad, m/s, rad/s: a first pose this near to the scene's initial one is that one
CUT_OR_RECORD = "cut the bag there, or let the node record (record.path)"
STAYS = "Until the first command the body stays where it is (start_on_command)."
SCENE, BAG = "scene", "bag"  # where the initial state comes from


@dataclass(frozen=True)
class Choices:
    """What a user may choose; None is decided by what is in the bag. Raises ValueError for what cannot be chosen."""

    topics: tuple[str, ...] = ()
    pose: str | None = None
    times: str | None = None  # timing.HEADER or RECEIVE
    start: str | None = None  # SCENE or BAG

    def __post_init__(self) -> None:
        for name, known in (("times", (timing.HEADER, timing.RECEIVE)), ("start", (SCENE, BAG))):
            if (chosen := getattr(self, name)) not in (None, *known):
                raise ValueError(f"{name}={chosen!r} is not known; give {known[0]!r}, {known[1]!r} or None")


BY_WHAT_IS_THERE = Choices()


@dataclass(frozen=True)
class Commands:
    """The commands of all topics, in the order in which they reached the simulation."""

    topics: tuple[str, ...]  # the first leads in lockstep
    topic: Integers  # (n,) index into topics
    time_ns: Integers  # (n,) simulated time since the start; without meaning in lockstep
    values: Floats  # (n, 6 or more) force [N] and torque [N m], or numbers for actuators; then zeros
    frame_ids: NDArray[np.object_]  # (n,) of str
    actuators: frozenset[str] = frozenset()  # the topics with commands to actuators

    def part(self, which: Integers | slice) -> "Commands":
        """Some of them."""
        names = ("topic", "time_ns", "values", "frame_ids")
        return replace(self, **{name: getattr(self, name)[which] for name in names})


@dataclass(frozen=True)
class Scenario:
    """What to simulate but the scene, as a bag tells it. It can be pickled and sent to another process.

    Poses are wanted at ``stamp_ns``; step 0 has the stamp ``epoch_ns``. Where there is a journal, it takes the place of
    the commands.
    """

    epoch_ns: int
    stamp_ns: Integers  # (m,)
    receive_ns: Integers  # (m,) of the poses
    twist_receive_ns: Integers  # (m,) of the twists of these stamps, or else of the poses
    recorded: Floats | None  # (m, 7) poses
    pose_topic: str
    twist_topic: str
    out_topics: tuple[str, str]  # under which poses (PoseStamped) and twists (TwistStamped) are written
    start: State | None = None  # None is the scene's
    commands: Commands | None = None
    journal: tuple[journals.Entry, ...] = ()
    notes: tuple[str, ...] = ()

    def waits(self, scene: Scene) -> bool:
        """Whether the body stays until the first command; where the bag begins late, that was before."""
        if self.journal:
            return journals.starts_on_command(self.journal[0])
        return bool(scene["start_on_command"]) and self.start is None

    def last_step(self, rate: float) -> int:
        """The step of the last pose, at a rate [Hz]."""
        return round((int(self.stamp_ns.max()) - self.epoch_ns) * (rate / NANOSECONDS))


# What to simulate -----------------------------------------------------------------------------------------------------


def scene_of(bag: Bag) -> Scene | FleetScene | None:
    """The scene in the bag's journal, of one body or of several; None without one.

    Raises BagError for a journal that cannot be read.
    """
    return journals.beginning(journals.read(bag.journal)).scene if bag.journal else None


def prepare(bag: Bag, scene: Scene, choices: Choices = BY_WHAT_IS_THERE) -> Scenario:
    """What a bag says about a run of this scene. Raises BagError when that cannot be simulated again."""
    pose = topics.pose(bag, scene, choices.pose)
    twist = topics.twist(bag, pose)
    notes = list(bag.notes)
    if bag.journal:
        return _by_journal(bag, scene, pose, twist, notes)
    names = topics.commands(bag, scene, choices.topics)
    if not names and pose is None:
        raise BagError(
            f"{bag.path}: has no topic of type {topics.A_COMMAND} with commands and none with poses, of type "
            f"{topics.A_POSE}; it has {topics.there(bag)}"
        )
    notes += _not_taken(bag, names)
    if further := topics.not_compared(bag, pose):
        notes.append(f"Not compared: {topics.counted(bag, further)}; --pose chooses.")
    if pose is None:
        return _without_poses(bag, scene, names, choices, notes)
    return _by_commands(bag, scene, names, pose, twist, choices, notes)


def _not_taken(bag: Bag, names: Sequence[str]) -> list[str]:
    """Sentences about what moved the body, perhaps, and is not taken for that."""
    notes = []
    if not names:
        notes.append(f"The bag has no commands of type {topics.A_COMMAND}: the motion is a free one.")
    if unknown := topics.left_out(bag, names):
        told = topics.counted(bag, unknown)
        notes.append(f"Left out, because only a journal tells when they took effect: {told}.")
    if others := topics.not_used(bag, names):
        notes.append(f"Not used: {topics.counted(bag, others)}; --topic chooses, once for each topic.")
    return notes


def _by_commands(
    bag: Bag,
    scene: Scene,
    names: Sequence[str],
    pose: str,
    twist: str | None,
    choices: Choices,
    notes: list[str],
) -> Scenario:
    _check_frames(bag, pose, scene)
    poses, twists = poses_in_order(bag, pose, notes), twists_of(bag, twist, scene)
    first, start, told = _start(bag, scene, pose, poses, twists, choices.start)
    notes.append(told)
    if scene["start_on_command"] and start is None:
        notes.append(STAYS)
    poses = _chosen(poses, slice(first, None))
    epoch_ns = 0 if scene["lockstep"] and start is None else int(poses.stamp_ns[0])
    notes.append(_between_steps(poses.stamp_ns - epoch_ns, scene["rate"]))
    if scene["lockstep"]:
        commands = _in_lockstep(bag, names, scene, poses if start else None, notes)
    else:
        commands = _since(epoch_ns, _by_time(bag, scene, names, poses, choices.times, notes))
    return Scenario(
        epoch_ns,
        poses.stamp_ns,
        poses.receive_ns,
        _received(twists, poses),
        poses.values,
        pose,
        twist or topics.beside(pose, "twist"),
        _out_topics(bag, pose, twist),
        start,
        commands,
        notes=tuple(filter(None, notes)),
    )


def poses_in_order(bag: Bag, pose: str, notes: list[str]) -> Messages:
    """The poses by their stamps, each stamp once; what is odd about them is noted."""
    poses = _true_poses(bag, pose, notes)
    notes.append(timing.oddities(f"Stamps of {pose}", poses.stamp_ns))
    poses = _chosen(poses, timing.order(bag.path, pose, poses.stamp_ns, CUT_OR_RECORD))
    return _chosen(poses, timing.last_of_equal(poses.stamp_ns))


def _true_poses(bag: Bag, pose: str, notes: list[str]) -> Messages:
    """The poses without those that are none: they are counted. Raises BagError when none is left."""
    poses = bag.poses[pose]
    finite, turned = np.isfinite(poses.values), poses.values[:, 3:] != 0.0
    true: NDArray[np.bool_] = np.all(finite, axis=1) & np.any(turned, axis=1)
    if true.all():
        return poses
    first = int(np.argmin(true))
    found = (
        f"{int((~true).sum())} of {len(true)} poses on {pose} are not finite or have a quaternion of zeros, the first "
        f"is message {first + 1}, stamped {timing.seconds(int(poses.stamp_ns[first]))}"
    )
    if not true.any():
        raise BagError(f"{bag.path}: {found}; give a bag with poses, or another topic with --pose")
    notes.append(f"{found}: left out.")
    return _chosen(poses, true)


def _by_journal(bag: Bag, scene: Scene, pose: str | None, twist: str | None, notes: list[str]) -> Scenario:
    if pose is None:
        raise BagError(f"{bag.path}: has a journal, but no pose to compare with; record pose, too")
    poses = _true_poses(bag, pose, notes)
    twists = bag.twists.get(twist or "")
    entries = tuple(journals.read(bag.journal))
    notes.append("Simulated by the node's own journal: each command takes effect at the step at which it did.")
    beginning = journals.beginning(entries)
    if beginning.scene["start_on_command"]:
        notes.append(STAYS)
    notes.append(_other_kernels(beginning))
    return Scenario(
        beginning.epoch_ns,
        poses.stamp_ns,
        poses.receive_ns,
        _received(twists, poses),
        poses.values,
        pose,
        twist or topics.beside(pose, "twist"),
        _out_topics(bag, pose, twist),
        journal=entries,
        notes=tuple(filter(None, notes)),
    )


def _other_kernels(beginning: journals.Beginning) -> str:
    if beginning.kernels == sources_digest():
        return ""
    return f"It was recorded by version {beginning.version} with other kernels: the last digits may differ."


def _without_poses(bag: Bag, scene: Scene, names: Sequence[str], choices: Choices, notes: list[str]) -> Scenario:
    """From the first command to the last, with a pose as often as the scene publishes one."""
    if scene["lockstep"] or choices.start == BAG:
        what = "lockstep" if scene["lockstep"] else "--start bag"
        raise BagError(f"{bag.path}: has no poses, which {what} needs; record pose and twist, too")
    notes.append("The bag has no poses: the scene's initial state is where the first command takes effect.")
    commands = _by_time(bag, scene, names, None, choices.times, notes)
    epoch_ns = int(commands.time_ns[0])
    commands = _since(epoch_ns, commands)
    period = scene.steps_per_publish * NANOSECONDS / scene["rate"]
    count = int(commands.time_ns[-1] // period) + 2
    if count > MOST_POSES:
        raise BagError(f"{bag.path}: its commands span {count:.3g} poses at this publish_rate; give a lower one")
    stamp_ns = epoch_ns + np.rint(np.arange(count) * period).astype(np.int64)
    out_topics = topics.beside(names[0], "pose"), topics.beside(names[0], "twist")
    told = tuple(filter(None, notes))
    return Scenario(
        epoch_ns, stamp_ns, stamp_ns, stamp_ns, None, *out_topics, out_topics, commands=commands, notes=told
    )


def _between_steps(since_ns: Integers, rate: float) -> str:
    """A sentence about stamps that no step has; empty when there are none."""
    steps = timing.nearest_steps(since_ns, rate)
    off = np.abs(since_ns - np.rint(steps * (NANOSECONDS / rate)))
    between = int((off > ROUNDED_NS).sum())
    if not between:
        return ""
    return f"{between} poses lie between two steps, by up to {off.max() / NANOSECONDS:.3g} s; the nearest step counts."


def _received(twists: Messages | None, poses: Messages) -> Integers:
    """When the twist of each pose's stamp was received; of a stamp that comes again, the first."""
    received = poses.receive_ns.copy()
    if twists is not None:
        _, pose, twist = np.intersect1d(poses.stamp_ns, twists.stamp_ns, return_indices=True)
        received[pose] = twists.receive_ns[twist]
    return received


def _out_topics(bag: Bag, pose: str, twist: str | None) -> tuple[str, str]:
    """As recorded, where the messages are of the types that are written."""
    twist = twist or topics.beside(pose, "twist")
    return (
        pose if bag.types[pose] == POSE else topics.beside(pose, "pose"),
        twist if bag.types.get(twist, TWIST) == TWIST else topics.beside(twist, "twist"),
    )


def _check_frames(bag: Bag, pose: str, scene: Scene) -> None:
    messages = bag.poses[pose]
    for name in dict.fromkeys(messages.frame_ids.tolist()):
        if name.removeprefix("/") not in (scene["world_frame_id"], ""):
            raise BagError(
                f"{bag.path}: {pose} is in frame {name!r}, the scene's world is {scene['world_frame_id']!r}; "
                "give the scene of this bag with --scene, or another topic with --pose"
            )
    for name in dict.fromkeys(messages.child_ids.tolist()):
        if name.removeprefix("/") not in (scene["body.frame_id"], ""):
            raise BagError(
                f"{bag.path}: {pose} is of frame {name!r}, the scene's body is {scene['body.frame_id']!r}; "
                "give the scene of this bag with --scene, or another topic with --pose"
            )


def twists_of(bag: Bag, twist: str | None, scene: Scene) -> Messages | None:
    """The twists on that topic; those of an Odometry without a child frame are the body's, in its axes."""
    if twist is None:
        return None
    twists = bag.twists[twist]
    if bag.types[twist] != ODOMETRY:
        return twists
    frames = [name or scene["body.frame_id"] for name in twists.frame_ids.tolist()]
    return replace(twists, frame_ids=np.array(frames, object))


# Where it starts ------------------------------------------------------------------------------------------------------


def _start(
    bag: Bag, scene: Scene, pose: str, poses: Messages, twists: Messages | None, asked: str | None
) -> tuple[int, State | None, str]:
    """Index of the pose to start with, the state there (None: the scene's), and a sentence about it."""
    at = f"the first pose, stamped {timing.seconds(int(poses.stamp_ns[0]))}"
    if asked == SCENE:
        return 0, None, f"Starts from the scene's initial state, as asked for, at {at}."
    if asked is None and _begins_with(scene, poses, twists):
        return 0, None, f"Starts from the scene's initial state, at {at}."
    first = _first_with_twist(poses, twists)
    if first is None or twists is None:
        raise BagError(
            f"{bag.path}: begins after the start, and no twist of the body tells the velocities at the first "
            f"pose of {pose}; give --start scene, or a scene with them in initial.*"
        )
    index, twist = first
    state = _state(bag, scene, poses, index, twists, twist)
    at = timing.seconds(int(poses.stamp_ns[index]))
    why = "as asked for" if asked else "the bag begins after the scene's initial state"
    return index, state, f"Starts from the recorded pose and twist stamped {at}: {why}."


def _begins_with(scene: Scene, poses: Messages, twists: Messages | None) -> bool:
    """Whether the first pose is the scene's initial state, or in lockstep the answer to the first command."""
    if scene["lockstep"]:
        step = int(timing.nearest_steps(poses.stamp_ns[:1], scene["rate"])[0])
        return step in (0, scene["steps_per_command"])
    motion = _initial_motion(scene)
    there = np.abs(poses.values[0, :3] - motion[:3]).max() <= SAME_START * max(1.0, np.abs(motion[:3]).max())
    there = there and rotation.angles_between(poses.values[:1, 3:7], motion[None, 3:7])[0] <= SAME_START
    if not there or twists is None:
        return bool(there)
    same = np.flatnonzero(twists.stamp_ns == poses.stamp_ns[0])
    expected = motion[13:19] if _last(twists.frame_ids, same) == scene["body.frame_id"] else motion[7:13]
    return not len(same) or bool(np.abs(twists.values[same[-1]] - expected).max() <= SAME_START)


def _initial_motion(scene: Scene) -> Floats:
    """What Simulation.motion would be at the scene's initial state, to the bit, shape (19,)."""
    model = scene.terms().model(Wrench())
    state = flatten(scene.initial_state(), model)
    return np.array(compiled.ready(flat.read_motion, state, model)(state, model))


def _last(frame_ids: NDArray[np.object_], same: Integers) -> str:
    return frame_ids[same[-1]].removeprefix("/") if len(same) else ""


def _first_with_twist(poses: Messages, twists: Messages | None) -> tuple[int, int] | None:
    """Indices of the first pose and twist of one stamp."""
    if twists is None:
        return None
    _, pose, twist = np.intersect1d(poses.stamp_ns, twists.stamp_ns, return_indices=True)
    return (int(pose[0]), int(twist[0])) if len(pose) else None


def _state(bag: Bag, scene: Scene, poses: Messages, index: int, twists: Messages, twist: int) -> State:
    values, frame = poses.values[index].tolist(), twists.frame_ids[twist].removeprefix("/")
    orientation, velocity, w = values[3:7], twists.values[twist, :3].tolist(), twists.values[twist, 3:].tolist()
    if frame not in (scene["body.frame_id"], scene["world_frame_id"]):
        raise BagError(
            f"{bag.path}: twists are in frame {frame!r}; the scene knows {scene['body.frame_id']!r} and "
            f"{scene['world_frame_id']!r}"
        )
    try:
        orientation = rotation.normalize(orientation)
        if frame == scene["body.frame_id"]:
            velocity = rotation.rotate(orientation, velocity).tolist()
        else:
            w = rotation.rotate_back(orientation, w).tolist()
        return State(values[:3], orientation, velocity, w)
    except ValueError as reason:
        raise BagError(f"{bag.path}: cannot start from the recorded pose and twist: {reason}") from None


# Commands -------------------------------------------------------------------------------------------------------------


def _by_time(
    bag: Bag,
    scene: Scene,
    names: Sequence[str],
    poses: Messages | None,
    asked: str | None,
    notes: list[str],
) -> Commands:
    """In the order in which they took effect, with times as in the poses' stamps."""
    chosen, times_ns, longest_ns = [], [], scene["wrench.timeout"] * NANOSECONDS or math.inf
    for name in names:
        messages = _given(bag, name, scene, notes)
        times = timing.of_commands(messages, poses, asked)
        notes += [_told(name, times), timing.oddities(f"Times of {name}", times.ns, longest_ns)]
        order = timing.order(bag.path, name, times.ns, "choose --times receive, or cut the bag there")
        chosen.append(_chosen(messages, order))
        times_ns.append(times.ns[order])
    return _merged(bag, names, chosen, times_ns)


def _given(bag: Bag, name: str, scene: Scene, notes: list[str]) -> Messages:
    """The commands on a topic; of those to actuators, the ones that have as many numbers."""
    if name not in bag.numbers:
        return bag.wrenches[name]
    numbers, count = bag.numbers[name], len(scene["actuators.names"])
    whole = np.array([len(values) == count for values in numbers.values], bool)
    if wrong := int((~whole).sum()):
        notes.append(f"{wrong} messages on {name} do not have {count} numbers: left out, as the node does.")
    kept = [values for values, is_whole in zip(numbers.values, whole.tolist(), strict=True) if is_whole]
    nameless = np.full(len(kept), "", object)
    stamp_ns = np.zeros(len(kept), np.int64)
    values = np.array(kept, float).reshape(len(kept), count)
    return Messages(numbers.receive_ns[whole], stamp_ns, values, nameless, nameless)


def _since(epoch_ns: int, commands: Commands) -> Commands:
    return replace(commands, time_ns=commands.time_ns - epoch_ns)


def _told(name: str, times: timing.Times) -> str:
    return f"Commands on {name} take effect at {times.source}."


def _in_lockstep(bag: Bag, names: Sequence[str], scene: Scene, start: Messages | None, notes: list[str]) -> Commands:
    """In the order in which they were received; of a bag that begins late, those after its first pose."""
    if names:
        notes.append(
            f"Lockstep: each command on {names[0]} advances the simulation by {scene['steps_per_command']} steps, "
            "in the order in which they were received."
        )
    given = [_given(bag, name, scene, notes) for name in names]
    merged = _merged(bag, names, given, [messages.receive_ns for messages in given])
    if start is None:
        return merged
    return merged.part(merged.time_ns > start.receive_ns[0])


def _merged(bag: Bag, names: Sequence[str], given: Sequence[Messages], times_ns: Sequence[Integers]) -> Commands:
    if not names:
        none = np.zeros(0, int)
        return Commands((), none, none, np.zeros((0, 6)), np.zeros(0, object))
    time_ns = np.concatenate(times_ns)
    order = np.argsort(time_ns, kind="stable")
    topic = np.repeat(np.arange(len(given)), [len(messages) for messages in given])
    width = max(6, *(messages.values.shape[1] for messages in given))
    values = np.concatenate([_padded(messages.values, width) for messages in given])
    frame_ids = np.concatenate([messages.frame_ids for messages in given])
    actuators = frozenset(names) & bag.numbers.keys()
    return Commands(tuple(names), topic[order], time_ns[order], values[order], frame_ids[order], actuators)


def _padded(values: Floats, width: int) -> Floats:
    return np.pad(values, ((0, 0), (0, width - values.shape[1])))


def _chosen(messages: Messages, which: Integers | NDArray[np.bool_] | slice) -> Messages:
    names = ("receive_ns", "stamp_ns", "values", "frame_ids", "child_ids")
    return Messages(*(getattr(messages, name)[which] for name in names))
