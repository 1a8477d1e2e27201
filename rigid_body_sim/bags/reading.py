"""Reads what matters here from a bag of ROS 2: wrench commands, poses, twists and the journal. No ROS."""

import dataclasses
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..physics.arrays import Floats, Integers
from ..scene.schema import shown_name
from . import cdr, records
from .rosbags_support import BagError, require, typestore

WRENCHES = ("geometry_msgs/msg/WrenchStamped", "geometry_msgs/msg/Wrench")
POSE = "geometry_msgs/msg/PoseStamped"
TWIST = "geometry_msgs/msg/TwistStamped"
TEXT = "std_msgs/msg/String"
JOURNAL = "journal"  # last part of its topic's name
_FILES = (".mcap", ".db3")
_PACKED = ".zstd"
_TO_GIVE = "give the folder of a bag, or its .mcap or .db3 file"


@dataclass(frozen=True)
class Messages:
    """The messages of one topic in the order in which they were received.

    A wrench has force and torque [N, N m], 6 numbers; a pose position [m] and quaternion w, x, y, z, 7 numbers; a twist
    linear and angular velocity [m/s, rad/s], 6 numbers. Without a header, stamps are zero and frames empty.
    """

    receive_ns: Integers  # (n,), rising
    stamp_ns: Integers  # (n,), as in the headers
    values: Floats  # (n, 6) or (n, 7)
    frame_ids: NDArray[np.object_]  # (n,) of str

    def __len__(self) -> int:
        return len(self.stamp_ns)


@dataclass(frozen=True)
class Recording:
    """What a bag holds of the kinds known here, by topic; ``notes`` are sentences about how it was read."""

    path: Path
    wrenches: dict[str, Messages] = field(default_factory=dict)
    poses: dict[str, Messages] = field(default_factory=dict)
    twists: dict[str, Messages] = field(default_factory=dict)
    journal: list[str] = field(default_factory=list)  # JSON texts, in the order of writing
    types: dict[str, str] = field(default_factory=dict)  # type of every topic that has a message
    notes: list[str] = field(default_factory=list)


def read(path: str | os.PathLike[str], *, recover: bool = False) -> Recording:
    """What is in a bag: a folder, or a lone file, of MCAP or SQLite, packed or not.

    With ``recover``, of an MCAP file without an end what is whole. Raises BagError: for what is no bag, is damaged or
    packed in an unknown way, holds no message, or messages of other definitions than ROS 2 Jazzy has.
    """
    require()
    path = Path(path)
    try:
        return _read(path, recover)
    except BagError:
        raise
    except Exception as reason:  # whatever rosbags, SQLite and the unpackers make of damaged files
        text = shown_name(" ".join(str(reason).split()).rstrip(".") or type(reason).__name__)
        raise BagError(f"{path}: cannot be read, it is damaged or of an unknown kind: {text}") from None


def _read(path: Path, recover: bool) -> Recording:
    notes: list[str] = []
    topics = [topic for topic in _gather(path, recover, notes) if topic.receive_ns or topic.not_taken]
    if not topics:
        raise BagError(f"{path}: holds no message; give a bag with wrench commands")
    recording = Recording(path, types={topic.name: topic.kind for topic in topics}, notes=notes)
    for topic in topics:
        _take(recording, topic)
    return recording


# Files ----------------------------------------------------------------------------------------------------------------


@dataclass
class _Topic:
    """The messages of one type on one topic."""

    name: str
    kind: str
    definition: Any
    not_taken: int = 0  # further ones that are there
    receive_ns: list[int] = field(default_factory=list)
    data: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        # Whether the messages themselves are read, too.
        self.wanted = self.kind in cdr.LAYOUTS or (self.kind == TEXT and self.name.split("/")[-1] == JOURNAL)


class _Topics(dict[tuple[str, str], _Topic]):
    """All of them, by name and type."""

    def of(self, connection: Any) -> _Topic:
        """The topic of a connection; some recorders have several connections for one."""
        key = connection.topic, connection.msgtype
        return self.setdefault(key, _Topic(*key, connection.msgdef))


def _gather(path: Path, recover: bool, notes: list[str]) -> list[_Topic]:
    """All topics of a bag, with the messages of those wanted, file after file."""
    from rosbags.rosbag2 import Reader

    files, topics = _files(path), _Topics()
    described = path.is_dir() and (path / "metadata.yaml").exists()
    if described and not any(map(_lacks_end, files)):
        with Reader(path) as reader:  # it also knows what metadata.yaml must be, and packed messages
            if reader.compression_mode or any(file.suffix != ".mcap" for file in files):
                _take_read(reader, topics)
                return list(topics.values())
    elif path.is_dir():
        notes.append("The folder is read file by file, without its description in metadata.yaml.")
    with tempfile.TemporaryDirectory() as folder:
        for file in files:
            plain = _unpacked(file, Path(folder)) if file.suffix == _PACKED else file
            _take_file(file, plain, topics, recover, notes)
    return list(topics.values())


def _take_file(file: Path, plain: Path, topics: _Topics, recover: bool, notes: list[str]) -> None:
    """Take the messages of a file, from ``plain``, which is the same unpacked."""
    from rosbags.rosbag2 import Reader

    if _lacks_end(plain):
        if not recover:
            raise BagError(
                f"{file}: has no end, its writer was killed or the file was cut; --recover takes what is whole in it"
            )
        notes.append(f"{file.name} has no end: what is whole in it is taken.")
    if plain.suffix == ".mcap" and records.is_mcap(plain):
        _take_messages(records.scan(plain), topics)
    else:
        with Reader(plain) as reader:
            _take_read(reader, topics)


def _take_read(reader: Any, topics: _Topics) -> None:
    """Take what a reader of rosbags gives."""
    for connection in reader.connections:
        topics.of(connection).not_taken += 0 if topics.of(connection).wanted else connection.msgcount
    wanted = [connection for connection in reader.connections if topics.of(connection).wanted]
    _take_messages(reader.messages(wanted) if wanted else (), topics)


def _take_messages(messages: Iterable[tuple[Any, int, bytes]], topics: _Topics) -> None:
    takers: dict[int, tuple[Callable[[int], None], Callable[[bytes], None]]] = {}
    for connection, receive_ns, data in messages:
        taker = takers.get(id(connection))
        if taker is None:
            topic = topics.of(connection)
            taker = takers[id(connection)] = topic.receive_ns.append, topic.data.append if topic.wanted else _drop
        taker[0](receive_ns)
        taker[1](data)


def _drop(_: bytes) -> None:
    """What is not wanted is counted alone."""


def _lacks_end(file: Path) -> bool:
    return file.suffix == ".mcap" and records.lacks_end(file)


def _files(path: Path) -> list[Path]:
    """The files of a bag. Raises BagError when there is none."""
    if not path.exists():
        raise BagError(f"{path}: does not exist; {_TO_GIVE}")
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if _kind(file) in _FILES)
        if not files and not (path / "metadata.yaml").exists():
            raise BagError(f"{path}: is a folder without metadata.yaml, .mcap or .db3 file, so no bag; {_TO_GIVE}")
        return files
    if path.suffix == ".bag":
        raise BagError(f"{path}: is a bag of ROS 1; convert it (rosbags-convert, from pip install rosbags)")
    if _kind(path) not in _FILES:
        raise BagError(f"{path}: is no bag; {_TO_GIVE}")
    return [path]


def _kind(file: Path) -> str:
    return file.with_suffix("").suffix if file.suffix == _PACKED else file.suffix


def _unpacked(file: Path, folder: Path) -> Path:
    from backports import zstd  # rosbags needs it, too

    with zstd.open(file) as packed, (folder / file.stem).open("wb") as plain:
        shutil.copyfileobj(packed, plain)
    return folder / file.stem


# Messages -------------------------------------------------------------------------------------------------------------


def _take(recording: Recording, topic: _Topic) -> None:
    """Put the messages of a topic where they belong in the recording."""
    if not topic.wanted:
        return
    _check_definition(recording.path, topic)
    if topic.kind == TEXT:
        if recording.journal:
            raise BagError(f"{recording.path}: has journals of several nodes; give a bag of one node")
        recording.journal.extend(_in_order(topic, [_text(recording.path, topic, data) for data in topic.data]))
        return
    homes = {POSE: recording.poses, TWIST: recording.twists, **dict.fromkeys(WRENCHES, recording.wrenches)}
    if topic.name in homes[topic.kind]:
        raise BagError(f"{recording.path}: topic {topic.name} has wrenches of two types; give a bag with one")
    homes[topic.kind][topic.name] = _messages(recording.path, topic)


def _messages(path: Path, topic: _Topic) -> Messages:
    layout = cdr.LAYOUTS[topic.kind]
    stamp_ns, frame_ids, values, unusual = cdr.decode(topic.data, layout)
    for i in unusual.tolist():
        stamp_ns[i], frame_ids[i], values[i] = _read_slowly(path, topic, i, layout)
    if topic.kind == POSE:
        values = values[:, [0, 1, 2, 6, 3, 4, 5]]  # x, y, z, w in messages
    order = np.argsort(topic.receive_ns, kind="stable")  # files of one bag may overlap
    receive_ns = np.array(topic.receive_ns, np.int64)
    return Messages(receive_ns[order], stamp_ns[order], values[order], frame_ids[order])


def _read_slowly(path: Path, topic: _Topic, index: int, layout: cdr.Layout) -> tuple[int, str, list[float]]:
    """Stamp, frame and doubles of a message that is not laid out as usual: in another encoding, say."""
    message = _deserialised(path, topic, topic.data[index], f"message {index + 1}")
    numbers = list(_floats(message))
    if not layout.stamped:
        return 0, "", numbers
    stamp = message.header.stamp
    return stamp.sec * cdr.NANOSECONDS + stamp.nanosec, message.header.frame_id, numbers


def _text(path: Path, topic: _Topic, data: bytes) -> str:
    return _deserialised(path, topic, data, "a message").data


def _deserialised(path: Path, topic: _Topic, data: bytes, which: str) -> Any:
    try:
        return typestore().deserialize_cdr(data, topic.kind)
    except Exception:  # whatever damaged bytes lead to
        raise BagError(
            f"{path}: {which} of topic {topic.name}, of {len(data)} bytes, is not a serialised {topic.kind}"
        ) from None


def _floats(message: Any) -> Iterator[float]:
    for entry in dataclasses.fields(message):
        value = getattr(message, entry.name)
        if isinstance(value, float):
            yield value
        elif dataclasses.is_dataclass(value):
            yield from _floats(value)


def _in_order(topic: _Topic, texts: list[str]) -> list[str]:
    return [texts[i] for i in np.argsort(topic.receive_ns, kind="stable")]


def _check_definition(path: Path, topic: _Topic) -> None:
    """Raise BagError where the bag says that a message has other fields than in ROS 2 Jazzy."""
    if not topic.definition.data:
        return
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    text = topic.definition.data
    if topic.definition.format == MessageDefinitionFormat.IDL:
        types = get_types_from_idl(text)
    else:
        types = get_types_from_msg(text, topic.kind)
    for name, (_, fields) in types.items():
        known = typestore().fielddefs.get(name)
        if known is None or known[1] != fields:
            raise BagError(
                f"{path}: topic {topic.name} holds {topic.kind} in which {name} has other fields than in ROS 2 Jazzy; "
                "convert the bag"
            )
