"""Write bags as rosbag2 of ROS 2 Jazzy does: a folder with one MCAP file and metadata.yaml, version 9."""

import contextlib
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import yaml

from .. import __version__
from .rosbags_support import BagError, require, typestore

Message = tuple[int, int, bytes]  # place of its topic among the topics, time [ns], serialised message (CDR)

CHUNK_BYTES = 1 << 18
_HEAD_BYTES = 31  # of a message in MCAP, before what was sent
VERSION = 9  # of metadata.yaml
_UNFINISHED = "metadata.yaml.tmp"
_FOR_EVER = dict(zip(("sec", "nsec"), divmod(2**63 - 1, 10**9), strict=True))


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
    made, for an unknown type, and without rosbags and mcap.
    """

    def __init__(self, folder: str | os.PathLike[str], topics: Sequence[Topic]):
        require()
        types = typestore().types
        for topic in topics:
            if topic.type not in types:
                raise BagError(f"topic {topic.name}: type {topic.type} is not one of ROS 2 Jazzy; give one that is")
        self._folder, self._topics = Path(folder), topics
        self._file = _open(self._folder)
        self._mcap = _start(self._file)
        schemas = {kind: self._add_type(kind) for kind in dict.fromkeys(topic.type for topic in topics)}
        self._channels = [self._add(topic, schemas[topic.type]) for topic in topics]
        self._counts = [0] * len(topics)
        self._first_ns, self._last_ns = 2**63 - 1, 0
        self._unwritten = self._unwritten_bytes = 0
        self._safe_bytes: int | None = 0  # of the file: up to the end of the last chunk in it; None: it is whole
        self._is_open = True
        self.written = 0

    def _add_type(self, kind: str) -> int:
        definition, _ = typestore().generate_msgdef(kind, ros_version=2)
        number: int = self._mcap.register_schema(kind, "ros2msg", definition.encode())
        return number

    def _add(self, topic: Topic, schema: int) -> int:
        told = {"offered_qos_profiles": _yaml([_qos(topic)]).strip(), "topic_type_hash": _type_hash(topic)}
        number: int = self._mcap.register_channel(topic.name, "cdr", schema, told)
        return number

    def write(self, messages: Iterable[Message]) -> None:
        """Add messages, many at once.

        Raises OSError when the disk does not take them; the bag then ends with the last chunk, and is closed.
        """
        add, channels, counts = self._mcap.add_message, self._channels, self._counts
        for place, time_ns, data in messages:
            add(channels[place], time_ns, data, time_ns)
            counts[place] += 1
            self._unwritten += 1
            self._unwritten_bytes += _HEAD_BYTES + len(data)
            if time_ns < self._first_ns:
                self._first_ns = time_ns
            if time_ns > self._last_ns:
                self._last_ns = time_ns
            if self._unwritten_bytes >= CHUNK_BYTES:
                self.flush()

    def flush(self) -> None:
        """Hand everything to the operating system, as a chunk: what a reader finds if the process is killed now.

        Raises OSError as ``write`` does.
        """
        if self._unwritten:
            with self._keeping_whole_chunks():
                self._mcap.flush()
                self._safe_bytes = self._file.tell()
            self.written += self._unwritten
            self._unwritten = self._unwritten_bytes = 0

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
        if not self._is_open:
            return
        self.flush()
        about = self._description()
        with self._keeping_whole_chunks():
            self._mcap.add_metadata("rosbag2", {"serialized_metadata": _yaml(about).strip()})
            self._mcap.finish()
            self._file.close()
            self._safe_bytes = None
            unfinished = self._folder / _UNFINISHED
            unfinished.write_text(_yaml({"rosbag2_bagfile_information": about}), encoding="utf-8")
            unfinished.replace(self._folder / "metadata.yaml")
        self._is_open = False

    def abandon(self) -> None:
        """Close without index and metadata.yaml, after the last whole chunk."""
        self._is_open = False
        with contextlib.suppress(OSError):  # it tries once more to write what did not fit
            self._file.close()
        with contextlib.suppress(OSError):  # somebody has removed it
            if self._safe_bytes is not None:  # else it has its index, and only the description could not be written
                os.truncate(file_in(self._folder), self._safe_bytes)
            (self._folder / _UNFINISHED).unlink(missing_ok=True)

    def _description(self) -> dict[str, Any]:
        """What metadata.yaml says of the bag, as rosbag2 of Jazzy does."""
        begins = {"nanoseconds_since_epoch": self._first_ns}
        lasts = {"nanoseconds": max(0, self._last_ns - self._first_ns)}
        count = sum(self._counts)
        return {
            "version": VERSION,
            "storage_identifier": "mcap",
            "relative_file_paths": [file_in(self._folder).name],
            "duration": lasts,
            "starting_time": begins,
            "message_count": count,
            "topics_with_message_count": [
                {"topic_metadata": _metadata(topic), "message_count": number}
                for topic, number in zip(self._topics, self._counts, strict=True)
            ],
            "compression_format": "",
            "compression_mode": "",
            "files": [
                {"path": file_in(self._folder).name, "starting_time": begins, "duration": lasts, "message_count": count}
            ],
            "custom_data": None,
            "ros_distro": "jazzy",
        }

    def __enter__(self) -> "BagWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Close; after an exception, abandon."""
        if kind is None:
            self.close()
        else:
            self.abandon()


def _open(folder: Path) -> BinaryIO:
    """The file of a new bag. Raises BagError when it cannot be made."""
    try:
        folder.mkdir(parents=True)
        return file_in(folder).open("xb")
    except FileExistsError:
        raise BagError(f"{folder} exists already; give a folder that does not exist yet") from None
    except OSError as reason:
        raise BagError(f"{folder} cannot be made ({reason.strerror}); give a folder that can be") from None


def _start(file: BinaryIO) -> Any:
    """The writer of an MCAP file for ROS 2, whose chunks end where ``flush`` ends them."""
    from mcap.writer import CompressionType, Writer

    mcap = Writer(file, chunk_size=2**62, compression=CompressionType.NONE)
    mcap.start("ros2", f"rigid_body_sim-{__version__}")
    return mcap


def file_in(folder: Path) -> Path:
    """The file of a bag that is written here, named as rosbag2 names the first one, else `reindex` does not see it."""
    return folder / f"{folder.name}_0.mcap"


def _metadata(topic: Topic) -> dict[str, Any]:
    return {
        "name": topic.name,
        "type": topic.type,
        "serialization_format": "cdr",
        "offered_qos_profiles": [_qos(topic)],
        "type_description_hash": _type_hash(topic),
    }


def _type_hash(topic: Topic) -> str:
    return str(typestore().hash_rihs01(topic.type))


def _qos(topic: Topic) -> dict[str, Any]:
    return {
        "history": topic.history,
        "depth": topic.depth,
        "reliability": topic.reliability,
        "durability": topic.durability,
        "deadline": _FOR_EVER,
        "lifespan": _FOR_EVER,
        "liveliness": "automatic",
        "liveliness_lease_duration": _FOR_EVER,
        "avoid_ros_namespace_conventions": False,
    }


class _Plain(yaml.SafeDumper):
    """Without anchors: what is there twice is written twice, as rosbag2 does."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _yaml(content: Any) -> str:
    text: str = yaml.dump(content, Dumper=_Plain, sort_keys=False, default_flow_style=False)
    return text
