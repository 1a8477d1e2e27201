"""The bag that rigid_body_resim writes: pose and twist at the recorded stamps, under its name only when it is whole."""

import heapq
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from ..bags import codec
from ..bags.reading import POSE, TWIST
from ..bags.rosbags_support import BagError
from ..bags.writing import BagWriter, Message, Topic
from ..resim.resimulating import Track
from ..scenarios.scenario import Scenario
from ..scene.loader import Scene

_POSE_IN_MESSAGES = [0, 1, 2, 4, 5, 6, 3]  # quaternion x, y, z, w
_TWIST_WORLD, _TWIST_BODY = slice(7, 13), slice(13, 19)
_AT_ONCE = 10_000  # messages


def check(path: Path) -> None:
    """Raise BagError unless a bag can be made at ``path``."""
    if os.path.lexists(path):
        raise BagError(f"--out {path}: exists already; give a folder that does not exist yet")
    if not path.absolute().parent.is_dir():
        raise BagError(f"--out {path}: there is no folder {path.absolute().parent}")


class Run(NamedTuple):
    """One body simulated again; ``name`` is empty where it is the only one."""

    name: str
    scenario: Scenario
    scene: Scene
    track: Track


def write(path: Path, runs: Sequence[Run]) -> None:
    """Write the bag. Raises BagError and OSError, and leaves nothing, when that is not possible."""
    path = path.absolute()
    beside = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    try:
        kinds = POSE, TWIST
        topics = [Topic(*one) for run in runs for one in zip(run.scenario.out_topics, kinds, strict=True)]
        with BagWriter(beside / path.name, topics) as bag:
            messages = (_messages(run, 2 * place) for place, run in enumerate(runs))
            bag.write(heapq.merge(*messages, key=lambda message: message[1]))
        check(path)
        (beside / path.name).rename(path)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _messages(run: Run, place: int) -> Iterator[Message]:
    """Pose and twist of one body, the topics at ``place`` and the next one."""
    _, scenario, scene, track = run
    frame, columns = scene["body.frame_id"], _TWIST_BODY
    if scene["twist_frame"] == "world":
        frame, columns = scene["world_frame_id"], _TWIST_WORLD
    for first in range(0, len(scenario.stamp_ns), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        stamps, motion = scenario.stamp_ns[part], track.motion[part]
        poses = codec.encode(stamps, scene["world_frame_id"], motion[:, _POSE_IN_MESSAGES])
        twists = codec.encode(stamps, frame, motion[:, columns])
        received = scenario.receive_ns[part].tolist(), scenario.twist_receive_ns[part].tolist()
        for pose_ns, twist_ns, pose, twist in zip(*received, poses, twists, strict=True):
            yield place, pose_ns, pose
            yield place + 1, twist_ns, twist
