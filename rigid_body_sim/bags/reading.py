"""Reads what matters here from a bag of ROS 2: wrench commands, poses, twists and the journal. No ROS."""

import os
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import Floats, Integers
from ..messages.cdr import LAYOUTS
from ..scene.schema import shown_name
from . import codec, files, unpacking
from .content import NUMBERS, TEXT, Channel, DamagedError, Losses, Topic
from .rosbags_support import BagError, require, typestore

WRENCHES = ("geometry_msgs/msg/WrenchStamped", "geometry_msgs/msg/Wrench")
POSE = "geometry_msgs/msg/PoseStamped"
TWIST = "geometry_msgs/msg/TwistStamped"
ODOMETRY = "nav_msgs/msg/Odometry"
POSES = (POSE, ODOMETRY, "geometry_msgs/msg/PoseWithCovarianceStamped", "geometry_msgs/msg/TransformStamped")
TWISTS = (TWIST, ODOMETRY, "geometry_msgs/msg/TwistWithCovarianceStamped")
_IDL_PART = re.compile(r"^=+\nIDL: .*$", re.MULTILINE)  # what rosbag2 has above the definition of each type
_POSE = [0, 1, 2, 6, 3, 4, 5]  # of the doubles in a message, whose quaternion is x, y, z, w
_TWIST, _TWIST_IN_ODOMETRY = slice(0, 6), slice(43, 49)  # the latter after a pose and its covariance
MOST_DEFINITION = 100_000  # characters; those of Jazzy have a few thousand


@dataclass(frozen=True)
class Messages:
    """The messages of one topic in the order in which they were received.

    A wrench has force and torque [N, N m], 6 numbers; a pose position [m] and quaternion w, x, y, z, 7 numbers; a twist
    linear and angular velocity [m/s, rad/s], 6 numbers, in the axes of its frame, which in an Odometry is the child's.
    Without a header, stamps are zero and frames empty.
    """

    receive_ns: Integers  # (n,), rising
    stamp_ns: Integers  # (n,), as in the headers
    values: Floats  # (n, 6) or (n, 7)
    frame_ids: NDArray[np.object_]  # (n,) of str
    child_ids: NDArray[np.object_]  # (n,) of str, the frames whose poses they are; empty where that is not told

    def __len__(self) -> int:
        return len(self.stamp_ns)


@dataclass(frozen=True)
class Numbers:
    """The messages of one topic that are any numbers without a header, in the order in which they were received."""

    receive_ns: Integers  # (n,), rising
    values: list[tuple[float, ...]]  # n of them

    def __len__(self) -> int:
        return len(self.values)


@dataclass(frozen=True)
class Bag:
    """What a bag holds of the kinds known here, by topic; ``notes`` are sentences about how it was read."""

    path: Path
    wrenches: dict[str, Messages] = field(default_factory=dict)
    poses: dict[str, Messages] = field(default_factory=dict)
    twists: dict[str, Messages] = field(default_factory=dict)
    numbers: dict[str, Numbers] = field(default_factory=dict)
    journal: list[str] = field(default_factory=list)  # JSON texts, in the order of writing
    types: dict[str, str] = field(default_factory=dict)  # type of every topic that has a message
    counts: dict[str, int] = field(default_factory=dict)  # of their messages
    silent: dict[str, str] = field(default_factory=dict)  # type of every other topic
    notes: list[str] = field(default_factory=list)


def read(path: str | os.PathLike[str], *, recover: bool = False) -> Bag:
    """What is in a bag: a folder, or a lone file, of MCAP or SQLite, packed or not.

    With ``recover``, of a bag that is not whole what is. Raises BagError: for what is no bag, is damaged, not whole or
    packed in an unknown way, holds no message, or messages of other definitions than ROS 2 Jazzy has.
    """
    require()
    path = Path(path)
    try:
        return _read(path, Losses(recover, []))
    except BagError:
        raise
    except MemoryError:
        raise BagError(f"{path}: does not fit into memory; cut the bag (ros2 bag convert)") from None
    except Exception as reason:  # whatever SQLite, the unpackers and rosbags make of damaged files
        text = shown_name(" ".join(str(reason).split()).rstrip(".") or type(reason).__name__)
        raise BagError(f"{path}: cannot be read, it is damaged or of an unknown kind: {text}") from None


def _read(path: Path, losses: Losses) -> Bag:
    contents = files.gather(path, losses)
    bag = Bag(path, notes=losses.notes)
    for topic in contents.values():
        (bag.types if len(topic) else bag.silent)[topic.name] = topic.kind
        bag.counts[topic.name] = bag.counts.get(topic.name, 0) + len(topic)
    if not bag.types:
        raise BagError(f"{path}: holds no message; give a bag with wrench commands or poses")
    for topic in sorted(contents.values(), key=lambda topic: topic.kind != TEXT):  # the journal first
        if topic.wanted and len(topic):
            _take(bag, topic)
    return bag


def _take(bag: Bag, topic: Topic) -> None:
    """Put the messages of a topic where they belong in the bag."""
    _check(bag, topic)
    topic.data = [unpacking.message(data) if data.startswith(unpacking.ZSTD) else data for data in topic.data]
    if topic.kind == TEXT:
        if bag.journal:
            raise BagError(f"{bag.path}: has journals of several nodes; give a bag of one node")
        texts = [_text(bag.path, topic, data) for data in topic.data]
        bag.journal.extend([texts[i] for i in np.argsort(topic.receive_ns, kind="stable")])
        return
    if topic.kind == NUMBERS:
        bag.numbers[topic.name] = _numbers(bag, topic)
        return
    messages = _messages(bag, topic)
    for home, kinds in ((bag.wrenches, WRENCHES), (bag.poses, POSES), (bag.twists, TWISTS)):
        if topic.kind in kinds:
            if topic.name in home:
                raise BagError(f"{bag.path}: topic {topic.name} has messages of two types; give a bag with one")
            home[topic.name] = _meant(messages, topic.kind, home is bag.poses)


def _messages(bag: Bag, topic: Topic) -> Messages:
    """The messages, with all doubles in them."""
    layout, bad = LAYOUTS[topic.kind], list[int]()
    stamp_ns, frame_ids, child_ids, values, unusual = codec.decode(topic.data, layout)
    for i in unusual.tolist():
        try:
            stamp_ns[i], frame_ids[i], child_ids[i], values[i] = codec.decode_one(topic.data[i], layout)
        except codec.NotCdrError as reason:
            _note_bad(bag, topic, i, reason, bad)
    order, receive_ns = _in_order(bag, topic, bad), np.array(topic.receive_ns, np.int64)
    return Messages(receive_ns[order], stamp_ns[order], values[order], frame_ids[order], child_ids[order])


def _numbers(bag: Bag, topic: Topic) -> Numbers:
    values, bad = list[tuple[float, ...]](), list[int]()
    for i, data in enumerate(topic.data):
        values.append(())
        try:
            values[i] = codec.decode_numbers(data)
        except codec.NotCdrError as reason:
            _note_bad(bag, topic, i, reason, bad)
    order = _in_order(bag, topic, bad)
    return Numbers(np.array(topic.receive_ns, np.int64)[order], [values[i] for i in order.tolist()])


def _note_bad(bag: Bag, topic: Topic, i: int, reason: Exception, bad: list[int]) -> None:
    """Note message i as none of its type. Raises BagError, but where the node's own recorder has what was refused."""
    if not (bag.journal and topic.kind in (*WRENCHES, NUMBERS)):
        raise _not_one(bag.path, topic, topic.data[i], f"message {i + 1}", reason) from None
    bad.append(i)


def _in_order(bag: Bag, topic: Topic, bad: list[int]) -> Integers:
    """Indices of the messages but the bad ones, as they were received: files of one bag may overlap."""
    if bad:
        bag.notes.append(f"{len(bad)} messages on {topic.name} are no {topic.kind}: left out, as the node does.")
    order = np.argsort(topic.receive_ns, kind="stable")
    return order[~np.isin(order, bad)]


def _meant(messages: Messages, kind: str, poses: bool) -> Messages:
    """What messages of that kind tell: their wrenches, poses or twists."""
    if poses:
        return replace(messages, values=messages.values[:, _POSE])
    if kind == ODOMETRY:
        return replace(messages, values=messages.values[:, _TWIST_IN_ODOMETRY], frame_ids=messages.child_ids)
    return replace(messages, values=messages.values[:, _TWIST])


def _text(path: Path, topic: Topic, data: bytes) -> str:
    try:
        return codec.decode_text(data)
    except codec.NotCdrError as reason:
        raise _not_one(path, topic, data, "a message", reason) from None


def _not_one(path: Path, topic: Topic, data: bytes, which: str, reason: Exception) -> BagError:
    what = f"{which} of topic {topic.name}, of {len(data)} bytes, is not a serialised {topic.kind}"
    return BagError(f"{path}: {what}: it {reason}")


def _check(bag: Bag, topic: Topic) -> None:
    """Raise BagError where the bag says that messages have another encoding, or other fields than in ROS 2 Jazzy."""
    for channel in topic.channels:
        if not channel.encoding.startswith("cdr") and channel.encoding:  # else the message itself tells which CDR
            raise BagError(
                f"{bag.path}: topic {topic.name} is encoded as {channel.encoding!r}, which is not known here; "
                "give a bag with messages in CDR, as ROS 2 has them"
            )
        if channel.definition:
            _check_definition(bag, topic, channel)


def _check_definition(bag: Bag, topic: Topic, channel: Channel) -> None:
    if len(channel.definition) > MOST_DEFINITION:
        size = len(channel.definition)
        raise DamagedError(f"the definition of {topic.kind} has {size} characters; at most {MOST_DEFINITION} are read")
    try:
        types = _types(topic.kind, channel)
    except Exception:  # whatever rosbags makes of texts that it cannot read
        bag.notes.append(f"The definition of {topic.kind} in the bag cannot be read: that of ROS 2 Jazzy is taken.")
        return
    for name, fields in types.items():
        known = typestore().fielddefs.get(name)
        if known is None or known[1] != fields:
            raise BagError(
                f"{bag.path}: topic {topic.name} holds {topic.kind} in which {name} has other fields than in "
                "ROS 2 Jazzy; convert the bag"
            )


def _types(kind: str, channel: Channel) -> dict[str, Any]:
    """The fields of the types that a definition defines."""
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    if channel.schema == "ros2msg":
        return {name: fields for name, (_, fields) in get_types_from_msg(channel.definition, kind).items()}
    parts = _IDL_PART.split(channel.definition) if "idl" in channel.schema else ()
    texts = ("".join(line for line in part.splitlines(True) if not line.startswith("#")) for part in parts)
    found = [get_types_from_idl(text) for text in texts if text.strip()]
    return {name: fields for types in found for name, (_, fields) in types.items()}
