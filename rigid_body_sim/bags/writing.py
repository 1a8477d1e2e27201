"""Write bags as rosbag2 of ROS 2 Jazzy does: a folder with one MCAP file and metadata.yaml, version 9."""

import contextlib
import os
import struct
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from .rosbags_support import BagError, require, typestore

Message = tuple[int, int, bytes]  # place of its topic among the topics, time [ns], serialised message (CDR)

CHUNK_BYTES = 1 << 18
_AT_ONCE = 1000  # messages packed between two looks at the size of the chunk
_RECORD = struct.Struct("<BQHIQQ")  # of MCAP: op code, length of the rest, channel, sequence, log and publish time
_MESSAGE = 0x05
_COUNTED = _RECORD.size - 9  # bytes of it that the length counts
_CHECKSUM = struct.Struct("<I")
_TO_CHECKSUM = 9 + 24  # bytes from the begin of a chunk's record: op code and length, two times and a size
_TEXT_HEAD = struct.Struct("<4sI")
_LITTLE_ENDIAN = b"\x00\x01\x00\x00"  # plain CDR


@dataclass(frozen=True)
class Topic:
    """A topic of a bag: its full name, its type (``geometry_msgs/msg/PoseStamped``) and the QoS it was offered with."""

    name: str
    type: str
    depth: int = 10
    reliability: str = "reliable"
    durability: str = "volatile"
    history: str = "keep_last"


class BagWriter:
    """A bag that is being written, at ``folder``, which must not exist. Use it as a context manager, or close it.

    ``written`` counts the messages that the operating system has. Raises BagError when the folder exists or cannot be
    made, for an unknown type, and without rosbags.
    """

    def __init__(self, folder: str | os.PathLike[str], topics: Sequence[Topic]):
        types = typestore().types
        for topic in topics:
            if topic.type not in types:
                raise BagError(f"topic {topic.name}: type {topic.type} is not one of ROS 2 Jazzy; give one that is")
        self._bag = _open(Path(folder))
        self._storage = self._bag.storage
        self._channels = [self._add(topic) for topic in topics]
        self._safe_bytes = 0  # of the file: up to the end of the last chunk that is in it
        self._is_open = True
        self.written = 0

    def _add(self, topic: Topic) -> int:
        qos = [_qos(topic)]
        return self._bag.add_connection(topic.name, topic.type, typestore=typestore(), offered_qos_profiles=qos).id

    def write(self, messages: Iterable[Message]) -> None:
        """Add messages, many at once: rosbags adds one in 6 µs, this in 2.5.

        Raises OSError when the disk does not take them; the bag then ends with the last chunk, and is closed.
        """
        rest = iter(messages)
        while batch := list(islice(rest, _AT_ONCE)):
            self._append(batch)
            if self._storage.chunk.bio.tell() >= CHUNK_BYTES:
                self.flush()

    def _append(self, batch: Sequence[Message]) -> None:
        channels, chunk, pack = self._channels, self._storage.chunk, _RECORD.pack
        index, at = chunk.msgs, chunk.bio.tell()
        pieces: list[bytes] = []
        for place, time_ns, data in batch:
            channel = channels[place]
            index[channel].append((time_ns, at))
            pieces += pack(_MESSAGE, _COUNTED + len(data), channel, 0, time_ns, time_ns), data
            at += _RECORD.size + len(data)
        chunk.bio.write(b"".join(pieces))

    def flush(self) -> None:
        """Hand everything to the operating system, as a chunk: what a reader finds if the process is killed now.

        Raises OSError as ``write`` does.
        """
        index = self._storage.chunk.msgs
        if not index:
            return
        self._count(index)
        with self._keeping_whole_chunks():
            self._close_chunk()
            self._storage.bio.flush()
        self._safe_bytes = self._storage.bio.tell()
        self.written += sum(map(len, index.values()))

    def _close_chunk(self) -> None:
        """Add the chunk to the file, with the checksum of its records, in whose place rosbags writes "none"."""
        file, begin = self._storage.bio, self._storage.bio.tell()
        checksum = zlib.crc32(self._storage.chunk.bio.getbuffer())
        self._storage.close_chunk()
        file.seek(begin + _TO_CHECKSUM)
        file.write(_CHECKSUM.pack(checksum))
        file.seek(0, os.SEEK_END)

    def _count(self, index: dict[int, list[tuple[int, int]]]) -> None:
        """Note of the messages in a chunk what rosbags notes of each, for chunk, file and metadata.yaml."""
        for channel, places in index.items():
            self._storage.channel_stats[channel] += len(places)
            self._bag.counts[channel] += len(places)
        first_ns = min(time_ns for places in index.values() for time_ns, _ in places)
        last_ns = max(time_ns for places in index.values() for time_ns, _ in places)
        for noted in (self._storage.chunk, self._storage):
            noted.message_start_time = min(noted.message_start_time, first_ns)
            noted.message_end_time = max(noted.message_end_time, last_ns)
        self._bag.min_timestamp = min(self._bag.min_timestamp, first_ns)
        self._bag.max_timestamp = max(self._bag.max_timestamp, last_ns)

    @contextlib.contextmanager
    def _keeping_whole_chunks(self) -> Iterator[None]:
        """Whatever goes wrong within, the file is cut off after its last whole chunk."""
        try:
            yield
        except OSError:
            self.abandon()
            raise

    def close(self) -> None:
        """Write index and metadata.yaml. Raises OSError as ``write`` does; a second call does nothing."""
        if self._is_open:
            self.flush()
            with self._keeping_whole_chunks():
                self._bag.close()
            self._is_open = False

    def abandon(self) -> None:
        """Close without index and metadata.yaml, after the last whole chunk."""
        self._is_open = False
        with contextlib.suppress(OSError):  # it tries once more to write what did not fit
            self._storage.bio.close()
        with contextlib.suppress(OSError):  # somebody has removed it
            if self._bag.storage is not None:  # else it has its index, and only the description could not be written
                os.truncate(self._storage.path, self._safe_bytes)
            self._bag.metapath.with_suffix(".yaml.tmp").unlink(missing_ok=True)

    def __enter__(self) -> "BagWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Close; after an exception, abandon."""
        if kind is None:
            self.close()
        else:
            self.abandon()


def _open(folder: Path) -> Any:
    """rosbags' writer, with its file made: ``NAME_0.mcap``, as rosbag2 names the first file of the folder NAME.

    rosbags leaves the number out, and then ``ros2 bag reindex`` does not see the file. Raises BagError when it cannot
    be made.
    """
    require()
    from rosbags.rosbag2 import StoragePlugin, Writer, WriterError

    try:
        bag = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        bag.open()
        bag.storage.path = bag.storage.path.rename(file_in(folder))
    except WriterError:
        raise BagError(f"{folder} exists already; give a folder that does not exist yet") from None
    except OSError as reason:
        raise BagError(f"{folder} cannot be made ({reason.strerror}); give a folder that can be") from None
    return bag


def file_in(folder: Path) -> Path:
    """The file of a bag that is written here."""
    return folder / f"{folder.name}_0.mcap"


def _qos(topic: Topic) -> Any:
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

    for_ever = QosTime(0x7FFFFFFFFFFFFFFF // 1_000_000_000, 0x7FFFFFFFFFFFFFFF % 1_000_000_000)
    return Qos(
        QosHistory[topic.history.upper()],
        topic.depth,
        QosReliability[topic.reliability.upper()],
        QosDurability[topic.durability.upper()],
        deadline=for_ever,
        lifespan=for_ever,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=for_ever,
        avoid_ros_namespace_conventions=False,
    )


def serialised_text(text: str) -> bytes:
    """The text as a serialised std_msgs/msg/String (CDR)."""
    data = text.encode() + b"\x00"
    return _TEXT_HEAD.pack(_LITTLE_ENDIAN, len(data)) + data
