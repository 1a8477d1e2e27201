"""The node: wrench commands in, pose and twist out, at a fixed rate of simulated time."""

import gc
import time
from collections import Counter

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_srvs.srv import SetBool, Trigger

from ..simulation import Simulation, SimulationError
from . import diagnostics, messages, parameters
from .executor import executor_for
from .outputs import QUEUE, Outputs
from .pacing import Pacer
from .program import StopRequest
from .wrench_reader import WrenchReader

NANOSECONDS = 1_000_000_000
LONGEST_SLEEP_NS = NANOSECONDS // 10  # so that a request to stop is soon seen
WARN_EVERY = 5.0  # s between two warnings of the same kind


class RigidBodyNode(Node):
    """ROS 2 interface of one Simulation; see docs/interface.md.

    Raises ValueError for parameters that are unknown or bad. One thread does everything: ``run`` takes the steps that
    are due and gives the time left to the executor, so commands arrive between two steps and need no lock.
    """

    def __init__(self, **node_arguments):
        super().__init__("rigid_body_node", **node_arguments)
        self.scene = parameters.declare(self)
        self.simulation = Simulation.from_scene(self.scene)
        self.paused = self.scene["start_paused"]
        self.failure = ""
        self.refused = Counter(dict.fromkeys(messages.REFUSALS, 0))
        self._warned: dict[str, float] = {}
        self._wrench_step: int | None = None
        self._hold = self.scene["wrench.timeout"] or None
        self._epoch_ns = self.get_clock().now().nanoseconds
        self._pacer = Pacer(self.simulation.rate, time.monotonic_ns())
        self._report_due_ns = time.monotonic_ns() + NANOSECONDS
        self._last_reading = self._reading()
        self._outputs = Outputs(self, self.scene, self.simulation)
        self._diagnostics_publisher = self.create_publisher(DiagnosticArray, "/diagnostics", QUEUE)
        self._wrench_reader, self._impulse_reader = (WrenchReader(self.scene, what) for what in ("wrench", "impulse"))
        self._create_inputs()
        parameters.refuse_undeclared(self)

    def _create_inputs(self) -> None:
        for topic, callback in (("wrench", self._on_wrench), ("impulse", self._on_impulse)):
            self.create_subscription(
                WrenchStamped,
                topic,
                callback,
                QUEUE,
                raw=True,
                qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            )
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/step", self._on_step)
        self.create_service(Trigger, "~/clear_wrench", self._on_clear_wrench)

    # The loop ---------------------------------------------------------------------------------------------------------

    def run(self, stop: StopRequest) -> None:
        """Simulate until ``stop`` is requested."""
        executor = executor_for(self)
        gc.collect()
        gc.freeze()  # what exists now stays; the collector need not look at it again while the loop runs
        self._pacer.start(time.monotonic_ns())
        self._last_reading = self._reading()
        self._outputs.count_listeners()
        self.publish_state()
        self.get_logger().info(f"ready: {self.simulation.describe()}{', paused' if self.paused else ''}")
        while not stop.requested:
            self.turn()
            executor.spin_once(timeout_sec=self._idle_seconds())

    def turn(self) -> None:
        """Take the steps and send the report that are due now."""
        now_ns = time.monotonic_ns()
        if self._running():
            self._advance(self._pacer.due(now_ns))
        if now_ns >= self._report_due_ns:
            self._report(now_ns)

    def _running(self) -> bool:
        return not self.paused and not self.failure

    def _idle_seconds(self) -> float:
        now_ns = time.monotonic_ns()
        wake_ns = min(now_ns + LONGEST_SLEEP_NS, self._report_due_ns)
        if self._running():
            wake_ns = min(wake_ns, self._pacer.deadline_ns())
        return max(0, wake_ns - now_ns) / NANOSECONDS

    def _advance(self, due: int) -> None:
        """Take ``due`` steps, publishing at each step that is a multiple of steps_per_publish."""
        every = self.scene.steps_per_publish
        while due > 0 and self._try_steps(chunk := min(due, every - self.simulation.steps % every)):
            due -= chunk
            if self.simulation.steps % every == 0:
                self.publish_state()

    def _try_steps(self, n: int) -> bool:
        try:
            self.simulation.step(n)
        except SimulationError as failure:
            self.failure = str(failure)
            self.get_logger().error(f"stopped; ~/reset starts afresh: {failure}")
            self.publish_state()
            return False
        return True

    def publish_state(self) -> None:
        """Publish what is asked for of the present step, all with its stamp."""
        self._outputs.publish(self._epoch_ns + self.simulation.time_ns)

    def _reading(self) -> diagnostics.Reading:
        pacer = self._pacer
        return diagnostics.Reading(
            time.monotonic_ns(), self.simulation.steps, pacer.slipped_ns, pacer.take_latest_ns(), self.refused.copy()
        )

    def _report(self, now_ns: int) -> None:
        simulation, reading = self.simulation, self._reading()
        age = None if self._wrench_step is None else (simulation.steps - self._wrench_step) / simulation.rate
        status = diagnostics.status(
            f"{self.get_fully_qualified_name()}: simulation",
            simulation,
            self._last_reading,
            reading,
            mode="stopped" if self.failure else "paused" if self.paused else "running",
            failure=self.failure,
            wrench_age=age,
        )
        report = DiagnosticArray(status=[status])
        messages.stamp(report.header, self.get_clock().now().nanoseconds)
        self._diagnostics_publisher.publish(report)
        self._last_reading = reading
        self._report_due_ns = now_ns + NANOSECONDS

    # Commands ---------------------------------------------------------------------------------------------------------

    def _on_wrench(self, data: bytes) -> None:
        try:
            self.simulation.set_wrench(self._wrench_reader.read(data), self._hold)
            self._wrench_step = self.simulation.steps
        except messages.RefusedError as refusal:
            self._refuse(refusal)
        except ValueError as reason:
            self._refuse(messages.RefusedError(messages.NOT_FOR_INTEGRATOR, str(reason)))

    def _on_impulse(self, data: bytes) -> None:
        try:
            self.simulation.apply_impulse(self._impulse_reader.read(data))
        except messages.RefusedError as refusal:
            self._refuse(refusal)
        except ValueError as reason:
            self._refuse(messages.RefusedError(messages.NOT_FINITE, str(reason)))

    def _refuse(self, refusal: messages.RefusedError) -> None:
        """Count a refusal and log it, each reason at most once in WARN_EVERY seconds."""
        self.refused[refusal.reason] += 1
        now = time.monotonic()
        if now - self._warned.get(refusal.reason, -WARN_EVERY) >= WARN_EVERY:
            self._warned[refusal.reason] = now
            self.get_logger().warning(str(refusal))

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        keep_time = not self.scene["reset_time"]
        self.simulation.reset(keep_time=keep_time)
        self.failure = ""
        self._wrench_step = None
        self._pacer.start(time.monotonic_ns())
        self._last_reading = self._reading()
        if self.paused:
            self.publish_state()
        response.success = True
        response.message = f"initial state, no wrench, simulated time {'goes on' if keep_time else 'from zero'}"
        return response

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        word = "paused" if request.data else "running"
        response.success = request.data or not self.failure
        response.message = f"already {word}" if self.paused == request.data else word
        if not response.success:
            response.message = f"stopped; ~/reset starts afresh: {self.failure}"
        if self.paused and not request.data:
            self._pacer.start(time.monotonic_ns())
        self.paused = request.data
        return response

    def _on_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self.failure or not self.paused:
            response.success = False
            response.message = self.failure or "not paused; call ~/pause with true first"
        elif self._try_steps(1):
            self.publish_state()
            response.success = True
            response.message = f"step {self.simulation.steps}, simulated time {self.simulation.time:.9g} s"
        else:
            response.success = False
            response.message = self.failure
        return response

    def _on_clear_wrench(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.simulation.clear_wrench()
        response.success = True
        response.message = "no wrench held"
        return response
