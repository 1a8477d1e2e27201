"""What the node tells of itself: its health once a second on /diagnostics, and in the log what is new."""

import time
from collections.abc import Iterator, Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from rclpy.publisher import Publisher

from ..bags.recorder import Recorder
from . import diagnostics, messages
from .loop import WAITING
from .neighbours import Neighbours
from .pacing import NANOSECONDS
from .plant import Part, Plant

AT_ONCE = 5  # bodies in one report, of which each takes 0.2 to 0.9 ms
MOST_NAMED = 8  # bodies in a line of the log


class Reporter:
    """Reports on ``publisher`` and in the log of ``node``; at each report ``neighbours`` look around.

    A report is due at ``due_ns`` of the monotonic clock, and tells what was counted since the one before.
    """

    def __init__(
        self, node: Node, publisher: Publisher, plant: Plant, neighbours: Neighbours, recorder: Recorder | None
    ):
        self._node, self._publisher, self._log = node, publisher, node.get_logger()
        self._loop, self._parts = plant.loop, plant.parts
        self._neighbours, self._recorder = neighbours, recorder
        self._told_of_recording: set[str] = set()
        self._plans_told: dict[str, set[str]] = {part.name: set() for part in self._parts}
        self._pause_ns = NANOSECONDS // -(-len(self._parts) // AT_ONCE)
        self._coming = list[Part]()
        self.due_ns = time.monotonic_ns() + NANOSECONDS
        self.count_afresh()

    def count_afresh(self) -> None:
        """The next reports tell what is counted from here on."""
        self._counted = self._count()
        self._before = {part.name: self._reading(part) for part in self._parts}

    def tell_ready(self) -> None:
        """Before time is counted: the first log of rclpy's takes 70 ms, of which some would slip."""
        manner = f"{', lockstep' if self._loop.lockstep else ''}{', paused' if self._loop.paused else ''}"
        for text in _together({part.name: part.simulation.describe() for part in self._parts}):
            self._log.info(f"ready: {text}{manner}")
        for part in self._parts:
            self._plans_told[part.name].add(part.simulation.integrator.name)
        waiting = {part.name: ", ".join(part.inputs.starters) for part in self._parts if part.seen.waiting}
        for text in _together({name: f"{WAITING}, on any of {topics}" for name, topics in waiting.items()}):
            self._log.info(f"{text}: until then the body stays")

    def tell_new_plan(self, name: str) -> None:
        """After the terms of a body have changed: log the plan, though it may be one that was told before."""
        self._plans_told[name].clear()
        self._tell_plans()

    def _tell_plans(self) -> None:
        """Log the plans that were not told yet."""
        new = {}
        for part in self._parts:
            told, simulation = self._plans_told[part.name], part.simulation
            if simulation.integrator.name not in told:
                told.add(simulation.integrator.name)
                new[part.name] = str(simulation.plan)
        for text in _together(new):
            self._log.info(f"plan: {text}")

    def tell_of_recording(self) -> None:
        """Log, each sentence once, that the recorder has stopped, or that a message was too large for it."""
        if (recorder := self._recorder) is None:
            return
        new = {recorder.too_large, recorder.failure} - self._told_of_recording - {""}
        self._told_of_recording |= new
        if recorder.too_large in new:
            self._log.warning(recorder.too_large)
        if recorder.failure in new:
            self._log.error(recorder.failure)

    def report(self, now_ns: int) -> None:
        """Publish the health of the last second, and log what is new.

        The next report is due a second from now; of many bodies each tells of some of them, for all in a second.
        """
        if not self._coming:
            self._coming, self._counted = list(self._parts), self._count()
        parts, self._coming = self._coming[:AT_ONCE], self._coming[AT_ONCE:]
        message = DiagnosticArray(status=[self._status(part) for part in parts])
        messages.stamp(message.header, self._node.get_clock().now().nanoseconds)
        self._publisher.publish(message)
        if not self._coming:
            self._tell_plans()
            self.tell_of_recording()
            self._neighbours.look()
        self.due_ns = now_ns + self._pause_ns

    def _status(self, part: Part) -> DiagnosticStatus:
        reading, before = self._reading(part), self._before[part.name]
        self._before[part.name] = reading
        return diagnostics.status(
            f"{self._node.get_fully_qualified_name()}: {part.name or 'simulation'}",
            part.simulation,
            before,
            reading,
            mode=part.seen.mode,
            failure=part.seen.failure,
            ages=part.inputs.ages,
        )

    def _reading(self, part: Part) -> diagnostics.Reading:
        inputs = part.inputs
        own = time.monotonic_ns(), part.simulation.steps
        return diagnostics.Reading(*own, *self._counted, inputs.refused.copy(), inputs.limited, self._recording())

    def _count(self) -> tuple[int, int, int]:
        """Of the loop since this was last asked: time that slipped, largest lateness, and that of 99 of 100 [ns]."""
        pacer = self._loop.pacer
        return pacer.slipped_ns, pacer.take_latest_ns(), pacer.lateness.take_p99_ns()

    def _recording(self) -> diagnostics.RecorderReading:
        if (recorder := self._recorder) is None:
            return diagnostics.RecorderReading()
        return diagnostics.RecorderReading(recorder.recorded, recorder.dropped, recorder.failure)


def _together(texts: Mapping[str, str]) -> Iterator[str]:
    """What is to be told of bodies, by name: each text once, with the names in front; without, of an only one."""
    names_of: dict[str, list[str]] = {}
    for name, text in texts.items():
        names_of.setdefault(text, []).append(name)
    for text, names in names_of.items():
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        yield f"{', '.join(names[:MOST_NAMED])}{more}: {text}" if names != [""] else text
