"""The journal of a run: every call that decides the motion, with the step before which it took effect.

A bag holds it as the topic ``~/journal`` (std_msgs/msg/String, one JSON object a message). Its first entry is the scene.
Numbers are written so that they read back to the bit.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ..scene.loader import Scene
from ..simulation import Simulation

TOPIC = "~/journal"  # of the node, so /ns/rigid_body_node/journal in the bag
TYPE = "std_msgs/msg/String"


@dataclass(frozen=True)
class Entry:
    """A call: at which time [ns] it was logged, how many steps were done then, its name and its arguments.

    Times in one bag never repeat: whatever message has an earlier log time came before it, and the others after it.
    """

    time_ns: int
    step: int
    call: str
    values: Mapping[str, Any]


class JournaledSimulation(Simulation):
    """A Simulation that tells ``journal(step, call, *arguments)`` of each call that decides its motion, once it is done."""

    journal: Callable[..., None]


def read(texts: Iterable[str]) -> list[Entry]:
    """The entries in a bag's journal. Raises BagError with what is wrong about one."""
    raise NotImplementedError


@dataclass(frozen=True)
class Beginning:
    """The first entry: the scene (with the mass and inertia in use, no files needed), and what ran it.

    ``epoch_ns`` is the stamp of step 0. ``kernels`` is compiled.sources_digest() of the node that wrote it: with the
    same one the same bits follow.
    """

    scene: Scene
    epoch_ns: int
    version: str
    kernels: str


def beginning(entries: Iterable[Entry]) -> Beginning:
    """What a journal begins with. Raises BagError when that is no scene."""
    raise NotImplementedError


def replay(
    entries: Iterable[Entry], simulation: Simulation, messages: Iterable[tuple[int, int]]
) -> Iterator[Simulation]:
    """Repeat a run: ``simulation`` (of the journal's scene, fresh) at each message, given as (log time, stamp) [ns].

    Messages come in the order of their log times. The simulation is yielded after the entries logged before the
    message and at the step that its stamp names; read ``motion`` before going on. Raises BagError when the journal has
    a hole, or does not fit the messages.
    """
    raise NotImplementedError
