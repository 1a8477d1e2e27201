"""Simulates again what a bag holds: by its journal to the bit, or by its commands and their times."""

import contextlib
import gc
import hashlib
import math
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import commands
from ..bags.rosbags_support import BagError
from ..held import steps_held
from ..kernels.arrays import Floats, Integers
from ..scenarios import timing
from ..scenarios.scenario import Commands, Scenario
from ..scene.loader import Scene
from ..simulation import Simulation
from . import journaled

_AT_ONCE = 4096  # commands or messages between two reports of progress
_LAST = 10  # poses that tell whether commands before them are missing: a recorder that is late mixes up a few
TO_MISS_NONE = (
    "start the first command when node and recorder hear it (ros2 topic pub -w 2), or let the node record (record.path)"
)

Progress = Callable[[float], None]  # is told the simulated time [s] since the start


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
        if i % _AT_ONCE == 0:
            progress(then.time)
    return Track(motion, _hash(simulation), simulation.steps)


class _Run:
    """One simulation under commands, whose motion is kept at the steps nearest to the stamps."""

    def __init__(self, scenario: Scenario, scene: Scene, simulation: Simulation, progress: Progress):
        self._scenario, self._scene, self._simulation, self._progress = scenario, scene, simulation, progress
        self._steps = timing.nearest_steps(scenario.stamp_ns - scenario.epoch_ns, scene["rate"]).tolist()
        self._motion = np.empty((len(self._steps), 19))
        self._taken, self._next = 0, self._steps[0]  # of the samples: how many are taken, and the step of the next one
        self._hold = scene["wrench.timeout"] or None
        self._limit = _limit(scene)
        self._meanings: dict[str, commands.Meaning] = {}
        self._refused, self._reason = 0, ""
        self._led_ns: list[int] = []  # in lockstep, times of receipt of the commands that led to a step

    def track(self) -> Track:
        """Simulate up to the last sample."""
        given = self._scenario.commands
        assert given is not None  # a Scenario has them where it has no journal
        if self._scene["lockstep"]:
            self._answer_commands(given)
        else:
            self._follow_times(given)
        if self._refused and self._refused == len(given.values):
            raise BagError(f"none of the {self._refused} commands can be used: {self._reason}")
        doubt = self._doubt() if self._led_ns else ""
        return Track(self._motion, _hash(self._simulation), self._simulation.steps, self._refused, self._reason, doubt)

    def _follow_times(self, given: Commands) -> None:
        simulation, accept, hold = self._simulation, self._accept, self._hold
        steps = timing.steps_at(given.time_ns, self._scene["rate"])
        first, last = self._hold_earlier(given, steps), int(np.searchsorted(steps, self._steps[-1], side="right"))
        for block in _blocks(first, last):
            self._progress(simulation.time)
            rows = zip(steps[block].tolist(), *_columns(given.part(block)), strict=True)
            for step, topic, frame_id, force, torque in rows:
                if step >= self._next:
                    self._advance(step)
                elif (ahead := step - simulation.steps) > 0:  # what most commands need, and quicker
                    simulation.step(ahead)
                accept(topic, frame_id, force, torque, hold)
        self._advance(self._steps[-1])

    def _hold_earlier(self, given: Commands, steps: Integers) -> int:
        """Hold what came before the start, for what is left of its time; returns the index of the first after it."""
        first = int(np.searchsorted(steps, 0))
        for topic in range(len(given.topics)):
            mine = np.flatnonzero(given.topic[:first] == topic)
            if not len(mine):
                continue
            hold = self._hold
            if hold is not None and self._scenario.start is not None:
                rate = self._scene["rate"]
                hold = (steps_held(hold, rate) + int(steps[mine[-1]])) / rate
            if hold is None or hold > 0.0:
                ((name, frame_id, force, torque),) = zip(*_columns(given.part(mine[-1:])), strict=True)
                self._accept(name, frame_id, force, torque, hold)
        return first

    def _answer_commands(self, given: Commands) -> None:
        simulation, n = self._simulation, self._scene["steps_per_command"]
        self._advance(0)
        for block in _blocks(0, len(given.values)):
            self._progress(simulation.time)
            rows = zip(given.time_ns[block].tolist(), *_columns(given.part(block)), strict=True)
            for receive_ns, topic, frame_id, force, torque in rows:
                if self._accept(topic, frame_id, force, torque, self._hold) and topic == given.topics[0]:
                    self._led_ns.append(receive_ns)
                    self._advance(simulation.steps + n)
        if self._taken < len(self._steps):
            raise BagError(
                f"the commands lead to step {simulation.steps}, but the poses go on to step {self._steps[-1]}: some "
                f"commands, or steps that were asked for by a service, are not in the bag; {TO_MISS_NONE}"
            )

    def _doubt(self) -> str:
        """Whether commands and poses were received as they are in lockstep: each command before the pose it led to."""
        wanted = np.array(self._steps) // self._scene["steps_per_command"]
        ahead = np.searchsorted(self._led_ns, self._scenario.receive_ns, side="right") - wanted
        if (ahead[-_LAST:] < 0).all():
            what = "The last poses were received before the commands that lead to them: the bag may lack some"
            return f"{what}; {TO_MISS_NONE}."
        if (ahead > 0).all():
            what = f"At every pose more commands had been received than lead to it, by {ahead.min()} or more"
            return f"{what}: the node may have missed them; {TO_MISS_NONE}."
        return ""

    def _accept(
        self, topic: str, frame_id: str, force: commands.Vector, torque: commands.Vector, hold: float | None
    ) -> bool:
        """Hold a command, or leave it out as the node does; whether it is held."""
        try:
            meaning = self._meanings.get(frame_id)
            if meaning is None:
                meaning = self._meanings[frame_id] = commands.meaning(frame_id, self._scene, "wrench")
            wrench = commands.make_wrench(meaning, force, torque, "wrench", self._limit)
            self._simulation.set_wrench(wrench, hold, topic)
        except (commands.RefusedError, ValueError) as reason:
            self._refused += 1
            self._reason = self._reason or str(reason)
            return False
        return True

    def _advance(self, step: int) -> None:
        """Go to a step, keeping the motion at the samples on the way and there."""
        simulation, steps, taken = self._simulation, self._steps, self._taken
        while taken < len(steps) and steps[taken] <= step:
            if steps[taken] > simulation.steps:
                simulation.step(steps[taken] - simulation.steps)
            self._motion[taken] = simulation.motion
            taken += 1
        self._taken, self._next = taken, steps[taken] if taken < len(steps) else math.inf
        if step > simulation.steps:
            simulation.step(step - simulation.steps)


def _blocks(first: int, last: int) -> Iterator[slice]:
    """The range in pieces: as Python objects all at once, 600 000 commands take seconds of garbage collection."""
    for begin in range(first, last, _AT_ONCE):
        yield slice(begin, min(begin + _AT_ONCE, last))


def _columns(given: Commands) -> tuple[list[Any], ...]:
    """Topic, frame, force and torque of each command."""
    names = [given.topics[i] for i in given.topic.tolist()]
    return names, given.frame_ids.tolist(), given.values[:, :3].tolist(), given.values[:, 3:].tolist()


def _limit(scene: Scene) -> commands.Limit:
    most_force, most_torque = (scene[f"wrench.max_{what}"] or math.inf for what in ("force", "torque"))
    if most_force == most_torque == math.inf:
        return commands.unlimited
    return lambda f, t: (commands.scaled_down(f, most_force), commands.scaled_down(t, most_torque))


def _hash(simulation: Simulation) -> str:
    state = simulation.save().state
    return hashlib.sha256(struct.pack(f"<{len(state)}d", *state)).hexdigest()[:16]
