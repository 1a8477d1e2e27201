"""Write bags as rosbag2 of ROS 2 Jazzy does: a folder with one MCAP file and metadata.yaml, version 9."""

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

Message = tuple[int, int, bytes]  # place of its topic among the topics, time [ns], serialised message (CDR)


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

    Raises BagError when the folder exists or cannot be made, for an unknown type, and without rosbags.
    """

    def __init__(self, folder: str | os.PathLike[str], topics: Sequence[Topic]):
        raise NotImplementedError

    def write(self, messages: Iterable[Message]) -> None:
        """Add messages. Raises OSError when the disk does not take them; the bag then ends with the last chunk."""
        raise NotImplementedError

    def flush(self) -> None:
        """Hand everything to the operating system, as a chunk: what a reader finds if the process is killed now."""
        raise NotImplementedError

    def close(self) -> None:
        """Write index and metadata.yaml."""
        raise NotImplementedError

    def __enter__(self) -> "BagWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_) -> None:
        """Close; after an exception leave what is there, without index and metadata.yaml."""
        raise NotImplementedError
