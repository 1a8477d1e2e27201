"""The commands of a scenario, given one after the other as the node takes them: frames, limits, timeouts, lockstep."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

import numpy as np

from .. import commands
from ..bags.rosbags_support import BagError
from ..held import steps_held
from ..kernels.arrays import Integers
from ..scene.loader import Scene
from ..values.wrench import Wrench
from . import timing
from .scenario import Commands, Scenario

AT_ONCE = 4096  # commands or messages between two reports of progress
TO_MISS_NONE = (
    "start the first command when node and recorder hear it (ros2 topic pub -w 2), or let the node record (record.path)"
)

Progress = Callable[[float], None]  # is told the simulated time [s] since the start


class Holder(Protocol):
    """What takes commands: a simulation, or whoever only notes what is held."""

    steps: int

    def set_wrench(self, wrench: Wrench, hold: float | None, source: str) -> None:
        """As Simulation.set_wrench; a ValueError leaves the command out."""

    def set_actuators(self, commands: Sequence[float], hold: float | None) -> None:
        """As Simulation.set_actuators."""


class CommandFeed:
    """Gives ``holder`` the commands of a scenario without a journal, and has it ``advance(step)`` in between.

    ``refused`` counts those left out, as the node leaves them out; ``reason`` says why, of the first. ``begun`` is
    whether any was taken. In lockstep, ``led_ns`` are the times of receipt of those that advanced it.
    """

    def __init__(
        self, scenario: Scenario, scene: Scene, holder: Holder, advance: Callable[[int], None], progress: Progress
    ):
        self._scenario, self._scene, self._holder, self._progress = scenario, scene, holder, progress
        self._advance = advance
        self._last_step = scenario.last_step(scene["rate"])
        self._hold = scene["wrench.timeout"] or None
        self._actuators = len(scene["actuators.names"])
        self._to_actuators = scenario.commands.actuators if scenario.commands else ()
        self._limit = _limit(scene)
        self._meanings: dict[str, commands.Meaning] = {}
        self.refused, self.reason, self.begun = 0, "", False
        self.led_ns: list[int] = []

    def give_all(self) -> None:
        """Up to the last pose. Raises BagError when none can be used, or when they do not lead where the poses are."""
        given = self._scenario.commands
        assert given is not None  # a Scenario has them where it has no journal
        if self._scene["lockstep"]:
            self._answer_commands(given)
        else:
            self._follow_times(given)
        if self.refused and self.refused == len(given.values):
            raise BagError(f"none of the {self.refused} commands can be used: {self.reason}")

    def _follow_times(self, given: Commands) -> None:
        advance, accept, hold = self._advance, self._accept, self._hold
        steps = timing.steps_at(given.time_ns, self._scene["rate"])
        first, last = self._hold_earlier(given, steps), int(np.searchsorted(steps, self._last_step, side="right"))
        for block in _blocks(first, last):
            self._report()
            rows = zip(steps[block].tolist(), *_columns(given.part(block)), strict=True)
            for step, topic, frame_id, numbers in rows:
                advance(step)
                accept(topic, frame_id, numbers, hold)
        advance(self._last_step)

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
                ((name, frame_id, numbers),) = zip(*_columns(given.part(mine[-1:])), strict=True)
                self._accept(name, frame_id, numbers, hold)
        return first

    def _answer_commands(self, given: Commands) -> None:
        holder, n = self._holder, self._scene["steps_per_command"]
        self._advance(0)
        for block in _blocks(0, len(given.values)):
            self._report()
            rows = zip(given.time_ns[block].tolist(), *_columns(given.part(block)), strict=True)
            for receive_ns, topic, frame_id, numbers in rows:
                if self._accept(topic, frame_id, numbers, self._hold) and topic == given.topics[0]:
                    self.led_ns.append(receive_ns)
                    self._advance(holder.steps + n)
        if holder.steps < self._last_step:
            raise BagError(
                f"the commands lead to step {holder.steps}, but the poses go on to step {self._last_step}: some "
                f"commands, or steps that were asked for by a service, are not in the bag; {TO_MISS_NONE}"
            )

    def _report(self) -> None:
        self._progress(self._holder.steps / self._scene["rate"])

    def _accept(self, topic: str, frame_id: str, numbers: Sequence[float], hold: float | None) -> bool:
        """Hold a command, or leave it out as the node does; whether it is held."""
        try:
            if topic in self._to_actuators:
                self._holder.set_actuators(numbers[: self._actuators], hold)
            else:
                self._holder.set_wrench(self._wrench(frame_id, numbers), hold, topic)
        except (commands.RefusedError, ValueError) as reason:
            self.refused += 1
            self.reason = self.reason or str(reason)
            return False
        self.begun = True
        return True

    def _wrench(self, frame_id: str, numbers: Sequence[float]) -> Wrench:
        meaning = self._meanings.get(frame_id)
        if meaning is None:
            meaning = self._meanings[frame_id] = commands.meaning(frame_id, self._scene, "wrench")
        return commands.make_wrench(meaning, numbers[:3], numbers[3:6], "wrench", self._limit)


def _blocks(first: int, last: int) -> Iterator[slice]:
    """The range in pieces: as Python objects all at once, 600 000 commands take seconds of garbage collection."""
    for begin in range(first, last, AT_ONCE):
        yield slice(begin, min(begin + AT_ONCE, last))


def _columns(given: Commands) -> tuple[list[Any], ...]:
    """Topic, frame and numbers of each command."""
    return [given.topics[i] for i in given.topic.tolist()], given.frame_ids.tolist(), given.values.tolist()


def _limit(scene: Scene) -> commands.Limit:
    most_force, most_torque = (scene[f"wrench.max_{what}"] or math.inf for what in ("force", "torque"))
    if most_force == most_torque == math.inf:
        return commands.unlimited
    return lambda f, t: (commands.scaled_down(f, most_force), commands.scaled_down(t, most_torque))
