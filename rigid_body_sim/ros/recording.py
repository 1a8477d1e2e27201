"""The node's own recorder: the bytes that it sends and receives, and the journal of its simulation, as a bag."""

import os
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from ..bags import journal
from ..bags.recorder import Recorder
from ..bags.rosbags_support import BagError
from ..bags.writing import Topic
from ..fleet import Fleet
from ..resim.journaled import JournaledFleet, JournaledSimulation
from ..scene.fleet import FleetScene
from ..scene.loader import Scene
from ..simulation import Simulation
from .loop import Loop
from .messages import type_name

# s. So long may the thread that writes hold the interpreter when the loop wants it; usual are 5 ms, 50 steps.
SWITCH_INTERVAL = 1e-4


class Recordable(Protocol):
    """Something that sends or receives messages."""

    @property
    def end(self) -> Publisher | Subscription:
        """What sends or receives."""

    def record(self, record: Callable[[bytes], None]) -> None:
        """From now on give the bytes of each message to ``record``."""


def simulation_of(scene: Scene) -> Simulation:
    """The simulation that a scene describes; where it is recorded, one that can tell of what decides its motion."""
    return (JournaledSimulation if scene["record.path"] else Simulation).from_scene(scene)


def fleet_of(scene: FleetScene) -> Fleet:
    """The same of several bodies."""
    if not scene["record.path"]:
        return Fleet.from_scene(scene)
    return JournaledFleet.from_scene(scene, JournaledSimulation.from_scene)


def start(node: Node, scene: Scene | FleetScene, loop: Loop[Any], ends: Sequence[Recordable]) -> Recorder | None:
    """Be ready to record those of ``ends`` that the scene asks for, from ``begin`` on; None when it asks for nothing.

    Raises ValueError when ``record.topics`` has something else, or when the bag cannot be made.
    """
    if not scene["record.path"]:
        return None
    chosen = _chosen(node, scene["record.topics"], ends)
    topics = [_topic(each.end) for each in chosen]
    path, journal_topic = os.path.expanduser(scene["record.path"]), node.resolve_topic_name(journal.TOPIC)
    try:
        recorder = Recorder(path, topics, journal_topic, patient=lambda: not loop.in_haste)
    except BagError as reason:
        raise ValueError(f"parameter record.path = {scene['record.path']!r}: {reason}") from None
    sys.setswitchinterval(SWITCH_INTERVAL)
    for place, each in enumerate(chosen):
        each.record(partial(recorder.put, place))
    return recorder


def begin(recorder: Recorder, scene: Scene | FleetScene, loop: Loop[Any]) -> None:
    """Begin the journal with the scene, once the loop has the stamp with which its time begins."""
    recorder.put_entry(loop.simulation.steps, journal.SCENE, journal.scene_values(scene, loop.epoch_ns))
    loop.simulation.journal = recorder.put_entry  # simulation_of or fleet_of made one that has it


def _chosen(node: Node, names: Sequence[str], ends: Sequence[Recordable]) -> list[Recordable]:
    """Those of the given names, or all. Raises ValueError for a name that none has."""
    by_name = {each.end.topic_name: each for each in ends}
    chosen = []
    for name in names:
        try:
            chosen.append(by_name[node.resolve_topic_name(name)])
        except (KeyError, RuntimeError):  # RCLError for what cannot be a name
            known = ", ".join(by_name)
            raise ValueError(f"parameter record.topics: {name!r} is not recorded here; give any of {known}") from None
    return list(dict.fromkeys(chosen)) or list(ends)  # a name may come twice, once with what it resolves to


def _topic(end: Publisher | Subscription) -> Topic:
    qos = end.qos_profile
    return Topic(
        end.topic_name,
        type_name(end.msg_type),
        qos.depth,
        qos.reliability.name.lower(),
        qos.durability.name.lower(),
        qos.history.name.lower(),
    )
