"""What the node tells of itself: its health once a second on /diagnostics, and in the log what is new."""

import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.publisher import Publisher

from ..bags.recorder import Recorder
from . import diagnostics, messages
from .inputs import Inputs
from .loop import WAITING, Loop
from .neighbours import Neighbours
from .pacing import NANOSECONDS


class Reporter:
    """Reports on ``publisher`` and in the log of ``node``; at each report ``neighbours`` look around.

    A report is due at ``due_ns`` of the monotonic clock, and tells what was counted since the one before.
    """

    def __init__(
        self,
        node: Node,
        publisher: Publisher,
        loop: Loop,
        inputs: Inputs,
        neighbours: Neighbours,
        recorder: Recorder | None,
    ):
        self._node, self._publisher, self._log = node, publisher, node.get_logger()
        self._loop, self._simulation, self._inputs = loop, loop.simulation, inputs
        self._neighbours, self._recorder = neighbours, recorder
        self._told_of_recording: set[str] = set()
        self._plans_told: set[str] = set()
        self.due_ns = time.monotonic_ns() + NANOSECONDS
        self.count_afresh()

    def count_afresh(self) -> None:
        """The next report tells what is counted from here on."""
        self._before = self._reading()

    def tell_ready(self) -> None:
        """Before time is counted: the first log of rclpy's takes 70 ms, of which some would slip."""
        manner = f"{', lockstep' if self._loop.lockstep else ''}{', paused' if self._loop.paused else ''}"
        self._log.info(f"ready: {self._simulation.describe()}{manner}")
        if self._loop.waiting:
            self._log.info(f"{WAITING}, on any of {', '.join(self._inputs.starters)}: until then the body stays")
        self._plans_told.add(self._simulation.integrator.name)

    def tell_new_plan(self) -> None:
        """After the terms have changed: log the plan, though it may be one that was told before."""
        self._plans_told.clear()
        self._tell_plan()

    def _tell_plan(self) -> None:
        """Log the plan when it is one that was not told yet."""
        if self._simulation.integrator.name not in self._plans_told:
            self._plans_told.add(self._simulation.integrator.name)
            self._log.info(f"plan: {self._simulation.plan}")

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
        """Publish the health of the last second, and log what is new; the next one is due a second from now."""
        reading = self._reading()
        status = diagnostics.status(
            f"{self._node.get_fully_qualified_name()}: simulation",
            self._simulation,
            self._before,
            reading,
            mode=self._loop.mode,
            failure=self._loop.failure,
            ages=self._inputs.ages,
        )
        message = DiagnosticArray(status=[status])
        messages.stamp(message.header, self._node.get_clock().now().nanoseconds)
        self._publisher.publish(message)
        self._tell_plan()
        self.tell_of_recording()
        self._neighbours.look()
        self._before = reading
        self.due_ns = now_ns + NANOSECONDS

    def _reading(self) -> diagnostics.Reading:
        pacer, inputs = self._loop.pacer, self._inputs
        return diagnostics.Reading(
            time.monotonic_ns(),
            self._simulation.steps,
            pacer.slipped_ns,
            pacer.take_latest_ns(),
            pacer.lateness.take_p99_ns(),
            inputs.refused.copy(),
            inputs.limited,
            self._recording(),
        )

    def _recording(self) -> diagnostics.RecorderReading:
        if (recorder := self._recorder) is None:
            return diagnostics.RecorderReading()
        return diagnostics.RecorderReading(recorder.recorded, recorder.dropped, recorder.failure)
