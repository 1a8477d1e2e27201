"""The bag of a trajectory: pose and twist as the node publishes them, and the commands of its run."""

import contextlib
import heapq
import os
import re
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..bags import codec
from ..bags.reading import POSE, TWIST, WRENCHES
from ..bags.rosbags_support import BagError
from ..bags.writing import BagWriter, Topic
from ..kernels.arrays import Floats, Integers
from ..rate import NANOSECONDS, Rate
from .schedule import WrenchSchedule

_NAMESPACE = re.compile(r"/?([A-Za-z_][A-Za-z0-9_]*(/|$))*")
_POSE = [0, 1, 2, 4, 5, 6, 3]  # of a motion: position and quaternion, which in messages is x, y, z, w
_TWIST_BODY = slice(13, 19)  # of a motion
_BODY, _WORLD = slice(0, 6), slice(6, 12)  # of Wrench.values
_SECONDS = 2**31  # of a stamp in a message: it is earlier than that
_AT_ONCE = 10_000  # messages


@dataclass(frozen=True)
class Names:
    """What stands before the topics, and the frames. Raises ValueError for what cannot be the name of such."""

    namespace: str
    world_frame_id: str
    body_frame_id: str

    def __post_init__(self) -> None:
        if not _NAMESPACE.fullmatch(self.namespace):
            raise ValueError(
                f"namespace {self.namespace!r} is no name in ROS; give one such as '/fleet/robot_1', or '' for none"
            )
        frames = self.world_frame_id, self.body_frame_id
        if frames[0] == frames[1] or any(not name or name.startswith("/") for name in frames):
            raise ValueError(
                f"world_frame_id {frames[0]!r} and body_frame_id {frames[1]!r}: give two names that differ, are not "
                "empty and do not begin with '/'"
            )

    def topic(self, last: str, kind: str) -> Topic:
        """The topic of that name in the namespace."""
        return Topic("/".join(["", *filter(None, self.namespace.split("/")), last]), kind)


class Series(NamedTuple):
    """Messages on a topic, in one frame: their stamps [ns], shape (n,), and the numbers in them, shape (n, k)."""

    topic: Topic
    stamp_ns: Integers
    frame_id: str
    values: Floats

    def messages(self, place: int) -> Iterator[tuple[int, int, bytes]]:
        """Time, place and bytes of each; it is received when it is stamped."""
        for first in range(0, len(self.stamp_ns), _AT_ONCE):
            stamps = self.stamp_ns[first : first + _AT_ONCE]
            data = codec.encode(stamps, self.frame_id, self.values[first : first + _AT_ONCE])
            yield from zip(stamps.tolist(), [place] * len(data), data, strict=True)


def write(
    folder: str | os.PathLike[str],
    names: Names,
    rate: float,
    steps: Integers,
    motion: Floats,
    commands: WrenchSchedule | None,
) -> None:
    """Do what Trajectory.to_bag says, of states at ``steps`` whose motion, shape (n, 19), is as Simulation.motion."""
    stamp_ns = _stamps(rate, steps)
    series = [
        Series(names.topic("pose", POSE), stamp_ns, names.world_frame_id, motion[:, _POSE]),
        Series(names.topic("twist", TWIST), stamp_ns, names.body_frame_id, motion[:, _TWIST_BODY]),
    ]
    if commands is not None:
        at = commands.steps + steps[0]
        taken = at < steps[-1]  # a run that ended early has not come to the others
        series += _commanded(names, _stamps(rate, at[taken]), commands.values[taken])
    topics = list(dict.fromkeys(each.topic for each in series))
    with _whole(folder, topics) as bag:
        merged = heapq.merge(*(each.messages(topics.index(each.topic)) for each in series))
        bag.write((place, time_ns, data) for time_ns, place, data in merged)


def _stamps(rate: float, steps: Integers) -> Integers:
    nanoseconds = Rate(rate).nanoseconds
    found = [nanoseconds(step) for step in steps.tolist()]
    if found and found[-1] >= _SECONDS * NANOSECONDS:
        raise BagError(
            f"step {steps[-1]} at {rate:g} Hz is at {steps[-1] / rate:.12g} s, but a stamp in a message is below "
            "2^31 s; save the trajectory as a file of numpy's (save)"
        )
    return np.array(found, np.int64)


def _commanded(names: Names, stamp_ns: Integers, values: Floats) -> list[Series]:
    """Rows of a schedule as messages. Each row replaces the one before, so all are on one topic where that can be."""
    topic = names.topic("wrench", WRENCHES[0])
    in_body, in_world = (values[:, part].any(axis=1) for part in (_BODY, _WORLD))
    if (in_body & in_world).any():  # a message has one frame
        return [
            Series(topic, stamp_ns, names.body_frame_id, values[:, _BODY]),
            Series(names.topic("wrench_world", WRENCHES[0]), stamp_ns, names.world_frame_id, values[:, _WORLD]),
        ]
    # Zeros are zero in either frame: in that of the others where those are in one.
    by_world = in_world if in_body.any() else np.full(len(values), in_world.any())
    return [
        Series(topic, stamp_ns[which], frame_id, values[which, part])
        for which, frame_id, part in (
            (~by_world, names.body_frame_id, _BODY),
            (by_world, names.world_frame_id, _WORLD),
        )
        if which.any()
    ]


@contextlib.contextmanager
def _whole(folder: str | os.PathLike[str], topics: Sequence[Topic]) -> Iterator[BagWriter]:
    """A bag to write into; unless all of it can be written, nothing is left."""
    bag = BagWriter(folder, topics)
    try:
        with bag:
            yield bag
    except BaseException as reason:
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(reason, OSError):
            raise BagError(
                f"{os.fspath(folder)} cannot be written to its end ({reason.strerror}), and nothing is left of it; "
                "give a folder where there is room"
            ) from None
        raise
