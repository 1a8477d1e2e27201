"""The motion that a bag has recorded: poses, velocities and commands over time. Nothing is simulated."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np

from ..bags.reading import Bag, Messages, Numbers, read
from ..bags.rosbags_support import BagError
from ..kernels.arrays import Floats, Integers
from ..scene.loader import Scene
from ..values import rotation
from . import scenario, several, timing, topics

NANOSECONDS = 1_000_000_000
WRENCH_APPLIED = "wrench_applied"


class Command(NamedTuple):
    """What was commanded on a topic: at ``time`` [s since the first pose], shape (k,).

    ``values`` are force [N] and torque [N m], shape (k, 6), in the axes of ``frames``, or a number for each of n
    actuators, shape (k, n), without frames.
    """

    topic: str
    time: Floats
    values: Floats
    frames: tuple[str, ...]

    def until(self, seconds: float) -> "Command":
        """What of it is not after that ``time``."""
        kept = self.time <= seconds
        return self._replace(time=self.time[kept], values=self.values[kept])


@dataclass(frozen=True)
class RecordedMotion:
    """The motion of one body, a row for each pose of a bag.

    Velocities are those of the twists with the same stamps, not a number where there is none. In a bag without such
    twists they are differences of the poses, and ``measured`` is False.
    """

    stamp_ns: Integers  # (n,), rising
    position: Floats  # (n, 3) [m], world axes, of the body frame's origin
    orientation: Floats  # (n, 4) unit quaternion (w, x, y, z), body → world
    velocity: Floats  # (n, 3) [m/s], world axes, of that point
    angular_velocity: Floats  # (n, 3) [rad/s], body axes
    measured: bool
    topic: str  # of the poses
    wrenches: tuple[Command, ...]
    actuators: tuple[Command, ...]
    notes: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.stamp_ns)

    @property
    def time(self) -> Floats:
        """Seconds since the first pose, shape (n,)."""
        return (self.stamp_ns - self.stamp_ns[0]) / NANOSECONDS

    def until(self, seconds: float) -> "RecordedMotion":
        """What of it is not after that ``time``."""
        kept = self.time <= seconds
        arrays = ("stamp_ns", "position", "orientation", "velocity", "angular_velocity")
        parts = {name: getattr(self, name)[kept] for name in arrays}
        commands = {
            name: tuple(one.until(seconds) for one in getattr(self, name)) for name in ("wrenches", "actuators")
        }
        return replace(self, **cast(dict[str, Any], {**parts, **commands}))


def recorded(path: str | os.PathLike[str], *, pose: str | None = None, body: str | None = None) -> RecordedMotion:
    """The motion in the bag at ``path``, whose poses are on the topic ``pose``: as motion_in says.

    Where its journal tells of several bodies, that of ``body``. Raises ValueError where none of them is named.
    """
    bag = read(path)
    return motion_in(*several.chosen(bag, scenario.scene_of(bag) or Scene(), body), pose)


def motion_in(bag: Bag, scene: Scene, pose: str | None = None) -> RecordedMotion:
    """The motion in a bag; ``pose`` is the topic with the poses, by default ``pose``, else ``odom``, else the only one.

    Raises BagError for a bag without poses, or with several topics of them and no telling which.
    """
    name = topics.pose(bag, scene, pose)
    if name is None:
        raise BagError(f"{bag.path}: has no topic with poses, of type {topics.A_POSE}; it has {topics.there(bag)}")
    notes = list(bag.notes)
    poses = scenario.poses_in_order(bag, name, notes)
    position, orientation = poses.values[:, :3], poses.values[:, 3:7]
    orientation = orientation / np.linalg.norm(orientation, axis=1, keepdims=True)
    twists = scenario.twists_of(bag, topics.twist(bag, name), scene)
    velocities = _of_twists(poses, orientation, twists)
    measured = velocities is not None
    linear, angular = velocities or _differences(poses.stamp_ns, position, orientation)
    return RecordedMotion(
        poses.stamp_ns,
        position,
        orientation,
        linear,
        angular,
        measured,
        name,
        tuple(_wrenches(bag, poses)),
        tuple(_to_actuators(bag, poses)),
        tuple(filter(None, notes)),
    )


def _of_twists(poses: Messages, orientation: Floats, twists: Messages | None) -> tuple[Floats, Floats] | None:
    """Linear velocity in world axes and angular velocity in body axes, of the twists with the poses' stamps."""
    if twists is None:
        return None
    _, at, which = np.intersect1d(poses.stamp_ns, twists.stamp_ns, return_indices=True)
    if not len(at):
        return None
    q, (v, w) = orientation[at], np.split(twists.values[which], 2, axis=1)
    in_world = (twists.frame_ids[which] == poses.frame_ids[at])[:, None]
    linear, angular = np.full((2, len(poses), 3), np.nan)
    linear[at] = np.where(in_world, v, rotation.rotate_each(q, v))
    angular[at] = np.where(in_world, rotation.rotate_each(q * (1.0, -1.0, -1.0, -1.0), w), w)
    return linear, angular


def _differences(stamp_ns: Integers, position: Floats, orientation: Floats) -> tuple[Floats, Floats]:
    """The same by central differences: dx/dt, and the vector part of 2 q̄ ⊗ dq/dt."""
    if len(stamp_ns) < 2:
        return np.full((1, 3), np.nan), np.full((1, 3), np.nan)
    time = (stamp_ns - stamp_ns[0]) / NANOSECONDS
    turns_over = np.sum(orientation[1:] * orientation[:-1], axis=1) < 0.0  # q and −q are one attitude
    q = orientation * np.where(np.concatenate(([0], np.cumsum(turns_over))) % 2, -1.0, 1.0)[:, None]
    dq = np.gradient(q, time, axis=0)
    v, dv = q[:, 1:], dq[:, 1:]
    return np.gradient(position, time, axis=0), 2.0 * (q[:, :1] * dv - dq[:, :1] * v - np.cross(v, dv))


def _wrenches(bag: Bag, poses: Messages) -> Iterator[Command]:
    """What acted, where the bag has that, else what was commanded."""
    applied = [name for name in bag.wrenches if name.endswith(f"/{WRENCH_APPLIED}")]
    commanded = [name for name in bag.wrenches if name.rpartition("/")[2] not in topics.NOT_COMMANDS]
    for name in sorted(applied or commanded):
        yield _command(name, bag.wrenches[name], poses)


def _to_actuators(bag: Bag, poses: Messages) -> Iterator[Command]:
    for name, given in sorted(bag.numbers.items()):
        if any(given.values):
            yield _command(name, _as_messages(given), poses)


def _as_messages(given: Numbers) -> Messages:
    """Those with the usual number of numbers."""
    lengths = np.array([len(values) for values in given.values])
    usual = np.bincount(lengths).argmax()
    kept = lengths == usual
    values = np.array([each for each in given.values if len(each) == usual], float)
    nameless = np.full(len(values), "", object)
    return Messages(given.receive_ns[kept], np.zeros(len(values), np.int64), values, nameless, nameless)


def _command(name: str, messages: Messages, poses: Messages) -> Command:
    times_ns = timing.of_commands(messages, poses, None).ns
    order = np.argsort(times_ns, kind="stable")
    frames = () if not any(messages.frame_ids) else tuple(dict.fromkeys(messages.frame_ids.tolist()))
    return Command(name, (times_ns[order] - poses.stamp_ns[0]) / NANOSECONDS, messages.values[order], frames)
