"""What the files of a bag hold, topic by topic: the readers of MCAP and SQLite files put it here."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from ..messages.cdr import LAYOUTS
from .rosbags_support import BagError

TEXT = "std_msgs/msg/String"
NUMBERS = "std_msgs/msg/Float64MultiArray"
JOURNAL, OF_ACTUATORS = "journal", "actuator_commands"  # last parts of their topics' names


class DamagedError(Exception):
    """A file in which something is not as it must be; the text says what."""


@dataclass(frozen=True)
class Channel:
    """What a file says of the messages of one type on one topic."""

    topic: str
    kind: str  # such as geometry_msgs/msg/Wrench; empty where the file has no schema
    encoding: str  # of the messages
    schema: str = ""  # how the definition is written: ros2msg, ros2idl
    definition: str = ""


@dataclass
class Topic:
    """The messages of one type on one topic, of all files."""

    name: str
    kind: str
    channels: list[Channel] = field(default_factory=list)
    not_taken: int = 0  # further ones that are there
    receive_ns: list[int] = field(default_factory=list)
    data: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        # Whether the messages themselves are read, too.
        named = self.kind, self.name.split("/")[-1]
        self.wanted = self.kind in LAYOUTS or named in ((TEXT, JOURNAL), (NUMBERS, OF_ACTUATORS))

    def __len__(self) -> int:
        return self.not_taken + len(self.receive_ns)

    def takers(self) -> tuple[Callable[[int], None], Callable[[bytes], None]]:
        """What takes the time of receipt of a message, and what takes its bytes."""
        return self.receive_ns.append, self.data.append if self.wanted else _drop


class Contents(dict[tuple[str, str], Topic]):
    """All topics, by name and type."""

    def of(self, channel: Channel) -> Topic:
        """The topic of a channel; some recorders have several channels for one."""
        key = channel.topic, channel.kind
        topic = self.setdefault(key, Topic(*key))
        if channel not in topic.channels:
            topic.channels.append(channel)
        return topic


@dataclass
class Losses:
    """What is done about a part of a bag that is not there or not whole: the bag is refused, or recovered and noted."""

    recover: bool
    notes: list[str]

    def tell(self, path: Path, what: str, why: str) -> None:
        """Raise BagError with what is wrong about ``path`` and why; to be recovered, note what is wrong."""
        if not self.recover:
            raise BagError(f"{path}: {what}, {why}; --recover takes what is whole in it")
        self.notes.append(f"{path.name} {what}: what is whole in it is taken.")


def _drop(_: bytes) -> None:
    """What is not wanted is counted alone."""
