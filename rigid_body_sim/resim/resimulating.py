"""Simulates again what a bag holds: by its journal to the bit, or by its commands and their times."""

import contextlib
import gc
import hashlib
import heapq
import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..bags.journal import Entry
from ..fleet import Fleet
from ..kernels.arrays import Floats
from ..scenarios import timing
from ..scenarios.command_feed import AT_ONCE, TO_MISS_NONE, CommandFeed, Progress
from ..scenarios.scenario import Scenario
from ..scene.fleet import FleetScene
from ..scene.loader import Scene
from ..simulation import Simulation
from . import journaled

_LAST = 10  # poses that tell whether commands before them are missing: a recorder that is late mixes up a few


@dataclass(frozen=True)
class Track:
    """The motion at the stamps of a Scenario, as Simulation.motion gives it: shape (m, 19)."""

    motion: Floats
    state: str  # hash of everything that decides how the motion would go on
    steps: int
    refused: int = 0  # commands left out, as the node leaves them out
    reason: str = ""  # why, of the first
    doubt: str = ""  # what makes it doubtful that the bag has the commands that the node took, in lockstep

    @property
    def poses(self) -> Floats:
        """Shape (m, 7)."""
        return self.motion[:, :7]


def run(scenario: Scenario, scene: Scene, progress: Progress = lambda time: None) -> Track:
    """The motion of the scene under what the bag holds, at the stamps of the bag's poses.

    Raises ValueError for a scene that cannot be simulated, SimulationError for a step that cannot be done, and BagError
    when nothing of the commands can be used, or they do not lead where the poses are.
    """
    simulation = Simulation.from_scene(scene)
    if scenario.start is not None:
        simulation.reset(scenario.start)
    with _little_collecting():
        if scenario.journal:
            return _replay(scenario, simulation, progress)
        return _Run(scenario, scene, simulation, progress).track()


@contextlib.contextmanager
def _little_collecting() -> Iterator[None]:
    """Python's collector need not look again and again at all that is there: that takes a third of the time."""
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _replay(scenario: Scenario, simulation: Simulation, progress: Progress) -> Track:
    motion = np.empty((len(scenario.stamp_ns), 19))
    messages = list(zip(scenario.receive_ns.tolist(), scenario.stamp_ns.tolist(), strict=True))
    for i, then in enumerate(journaled.replay(scenario.journal, simulation, messages)):
        motion[i] = then.motion
        if i % AT_ONCE == 0:
            progress(then.time)
    return Track(motion, state_hash(simulation), simulation.steps)


def run_together(scenarios: Mapping[str, Scenario], scene: FleetScene, journal: Sequence[Entry]) -> dict[str, Track]:
    """The motions of bodies with links between them, which are advanced together; by the journal of all of them.

    Raises as ``run`` does.
    """
    fleet = Fleet.from_scene(scene)
    motion = {name: np.empty((len(one.stamp_ns), 19)) for name, one in scenarios.items()}
    messages = heapq.merge(*(_messages(name, one) for name, one in scenarios.items()))
    taken = dict.fromkeys(scenarios, 0)
    with _little_collecting():
        for name, then in journaled.replay_fleet(journal, fleet, messages):
            motion[name][taken[name]] = then.motion
            taken[name] += 1
    return {name: Track(one, state_hash(fleet[name]), fleet[name].steps) for name, one in motion.items()}


def _messages(name: str, scenario: Scenario) -> Iterator[tuple[int, int, str]]:
    for log_ns, stamp_ns in zip(scenario.receive_ns.tolist(), scenario.stamp_ns.tolist(), strict=True):
        yield log_ns, stamp_ns, name


class _Run:
    """One simulation under commands, whose motion is kept at the steps nearest to the stamps."""

    def __init__(self, scenario: Scenario, scene: Scene, simulation: Simulation, progress: Progress):
        self._scenario, self._scene, self._simulation = scenario, scene, simulation
        self._feed = CommandFeed(scenario, scene, simulation, self._advance, progress)
        self._steps = timing.nearest_steps(scenario.stamp_ns - scenario.epoch_ns, scene["rate"]).tolist()
        self._motion = np.empty((len(self._steps), 19))
        self._starts_on_command = scenario.waits(scene)
        self._taken, self._next = 0, self._steps[0]  # of the samples: how many are taken, and the step of the next one

    def track(self) -> Track:
        """Simulate up to the last sample."""
        feed = self._feed
        feed.give_all()
        doubt = self._doubt() if feed.led_ns else ""
        return Track(
            self._motion, state_hash(self._simulation), self._simulation.steps, feed.refused, feed.reason, doubt
        )

    def _doubt(self) -> str:
        """Whether commands and poses were received as they are in lockstep: each command before the pose it led to."""
        wanted = np.array(self._steps) // self._scene["steps_per_command"]
        ahead = np.searchsorted(self._feed.led_ns, self._scenario.receive_ns, side="right") - wanted
        if (ahead[-_LAST:] < 0).all():
            what = "The last poses were received before the commands that lead to them: the bag may lack some"
            return f"{what}; {TO_MISS_NONE}."
        if (ahead > 0).all():
            what = f"At every pose more commands had been received than lead to it, by {ahead.min()} or more"
            return f"{what}: the node may have missed them; {TO_MISS_NONE}."
        return ""

    def _advance(self, step: int) -> None:
        """Go to a step, keeping the motion at the samples on the way and there."""
        if step >= self._next:
            self._keep_up_to(step)
        if step > self._simulation.steps:
            self._go_to(step)

    def _keep_up_to(self, step: int) -> None:
        simulation, steps, taken = self._simulation, self._steps, self._taken
        while taken < len(steps) and steps[taken] <= step:
            if steps[taken] > simulation.steps:
                self._go_to(steps[taken])
            self._motion[taken] = simulation.motion
            taken += 1
        self._taken, self._next = taken, steps[taken] if taken < len(steps) else math.inf

    def _go_to(self, step: int) -> None:
        waiting = self._starts_on_command and not self._feed.begun
        advance = self._simulation.wait if waiting else self._simulation.step
        advance(step - self._simulation.steps)


def state_hash(simulation: Simulation) -> str:
    """Of everything that decides how the motion would go on, but what is held."""
    saved = simulation.save()
    state = saved.state + saved.memory
    return hashlib.sha256(struct.pack(f"<{len(state)}d", *state)).hexdigest()[:16]
