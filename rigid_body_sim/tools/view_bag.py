"""What rigid_body_view shows of a bag: the motion of each body, the commands, and the look that the scene gives it."""

from pathlib import Path

import numpy as np

from .. import commands
from ..bags.content import OF_ACTUATORS
from ..bags.reading import Bag, Messages, read
from ..bags.rosbags_support import BagError
from ..kernels.arrays import Floats, Integers
from ..messages.cdr import NANOSECONDS
from ..scenarios import scenario, topics
from ..scene.fleet import FleetScene, load_any
from ..scene.loader import DEFAULT_NODE, Scene
from ..view.look import UNKNOWN, Look, of_values
from ..view.moment import Levels, Recording, Wrenches, level

BODY = "body"  # the name of the only one
A_POSE = "pose"


def shown(path: Path, scene_file: Path | None, wanted: tuple[str, ...]) -> tuple[dict[str, Recording], dict[str, Look]]:
    """Recordings and looks by body: each topic with poses is one; of several in a namespace the one named pose.

    The scene is that in ``scene_file``, else that in the bag's journal. Raises BagError for a bag that cannot be read
    or has no poses of a body that is ``wanted``, OSError and ValueError as load_scene does.
    """
    bag = read(path)
    scene = load_any(scene_file, DEFAULT_NODE) if scene_file is not None else scenario.scene_of(bag)
    found = {_name(topic): topic for topic in _poses(bag)}
    if missing := [name for name in wanted if name not in found]:
        raise BagError(f"{path}: has no poses of {missing[0]}; it has those of {', '.join(found) or 'nothing'}")
    found = {name: topic for name, topic in found.items() if not wanted or name in wanted}
    if not found:
        raise BagError(f"{path}: has no topic with poses, of type {topics.A_POSE}; it has {topics.there(bag)}")
    scenes = {name: _scene_of(name, scene) for name in found}
    looks = {name: of_values(one.values) if one is not None else UNKNOWN for name, one in scenes.items()}
    begin_ns = int(min(_times(bag.poses[topic])[0] for topic in found.values()))
    recordings = {
        name: _recording(bag, topic, scenes[name] or Scene(), looks[name], begin_ns) for name, topic in found.items()
    }
    return recordings, looks


def _scene_of(name: str, scene: Scene | FleetScene | None) -> Scene | None:
    """That of a body, of several by the last part of its namespace."""
    if not isinstance(scene, FleetScene):
        return scene
    return scene.scenes.get(name.rpartition("/")[2])


def _poses(bag: Bag) -> list[str]:
    """One topic with poses of each namespace."""
    by_space: dict[str, list[str]] = {}
    for topic in bag.poses:
        if not topic.endswith("/set_pose"):
            by_space.setdefault(topic.rpartition("/")[0], []).append(topic)
    usual = [[topic for topic in found if topic.endswith(f"/{A_POSE}")] or found for found in by_space.values()]
    return [found[0] for found in usual]


def _name(topic: str) -> str:
    return topic.rpartition("/")[0].strip("/") or BODY


def _times(messages: Messages) -> Integers:
    """Times [ns] of messages: of their headers, where these rise, else of their receipt."""
    rising = bool((np.diff(messages.stamp_ns) > 0).all()) and messages.stamp_ns[-1] > 0
    return messages.stamp_ns if rising else messages.receive_ns


def _recording(bag: Bag, topic: str, scene: Scene, look: Look, begin_ns: int) -> Recording:
    poses, space = bag.poses[topic], topic.rpartition("/")[0]
    motion = Recording((_times(poses) - begin_ns) / NANOSECONDS, poses.values[:, :3], poses.values[:, 3:])

    def when(receive_ns: Integers) -> Floats:
        """The time of the motion at which something was received."""
        return np.interp(receive_ns, poses.receive_ns, motion.time)

    wrench = next((name for name in (f"{space}/wrench_applied", f"{space}/wrench") if name in bag.wrenches), None)
    if wrench is not None:
        sent = bag.wrenches[wrench]
        motion = motion._replace(wrenches=_wrenches(sent, when(sent.receive_ns), motion, scene))
    numbers, count = bag.numbers.get(f"{space}/{OF_ACTUATORS}"), len(look.actuators)
    if numbers is not None and count and all(len(row) == count for row in numbers.values):
        shares = [[level(*each) for each in zip(look.actuators, row, strict=True)] for row in numbers.values]
        motion = motion._replace(levels=Levels(when(numbers.receive_ns), np.array(shares)))
    return motion


def _wrenches(messages: Messages, time: Floats, motion: Recording, scene: Scene) -> Wrenches:
    """Commands in body axes, at the attitudes at which they came; what is not understood is no wrench."""
    rows, center = np.zeros((len(messages), 6)), scene["body.center_of_mass"]
    for i, frame in enumerate(messages.frame_ids):
        numbers = messages.values[i].tolist()
        try:
            meant = commands.meaning(frame, scene, "wrench")(numbers[:3], numbers[3:])
        except (commands.RefusedError, ValueError):
            continue
        rows[i] = meant.about_origin(tuple(motion.at(time[i]).orientation), list(center))
    return Wrenches(time, rows[:, :3], rows[:, 3:])
