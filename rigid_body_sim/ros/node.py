"""The node: wrench commands in, pose and twist out, at a fixed rate of simulated time."""

import gc
import time
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions

from .. import first_start
from ..bags.recorder import Recorder
from ..scene.fleet import FleetScene, by_name
from ..scene.loader import Scene
from . import messages, parameters, plant, realtime, recording, services, standard_services
from .executor import IdleTime, executor_for
from .neighbours import Neighbours
from .pacing import NANOSECONDS
from .program import StopRequest
from .reporter import Reporter

QUEUE = 10


class RigidBodyNode(Node):
    """ROS 2 interface of one Simulation, or of a Fleet of several; see docs/reference/interface.md.

    ``given`` are parameters by dotted name, beside those that rclpy gets by its own ways. Raises ValueError for
    parameters that are unknown or bad. One thread does everything: ``run`` takes the steps that
    are due and gives the time left to the executor, so commands arrive between two steps and need no lock.
    """

    _recorder: Recorder | None = None  # also of a node whose start fails: rclpy 9 destroys that, too, at shutdown

    def __init__(self, given: Mapping[str, Any] = MappingProxyType({}), **node_arguments: Any):
        super().__init__("rigid_body_node", **node_arguments)
        self._is_default = not parameters.all_given(self, given)
        self.scene = parameters.declare(self, given)
        self._check_clock()
        for note in self.scene.notes:
            self.get_logger().warning(note)
        self._plant = plant.create(self, self.scene)
        self.loop = self._plant.loop
        self.simulation = self.loop.simulation
        health = self.create_publisher(
            DiagnosticArray, "/diagnostics", QUEUE, qos_overriding_options=QoSOverridingOptions.with_default_policies()
        )
        services.create(self, self.loop, self.reset)
        standard_services.create(self, self._plant, self.reset, self._quit)
        parameters.refuse_undeclared(self)
        self._changes = parameters.Changes(self, self.scene, self._take)
        neighbours = Neighbours(self, self._plant)
        # After all that may refuse to start, so that no bag is left behind.
        ends: list[recording.Recordable] = [*self._plant.outputs.channels, *self._plant.inputs]
        self._recorder = recording.start(self, self.scene, self.loop, ends)
        self._reporter = Reporter(self, health, self._plant, neighbours, self._recorder)
        self._stop: StopRequest | None = None

    def destroy_node(self) -> None:
        """Close the bag, and leave the network."""
        if self._recorder is not None:
            self._recorder.close()
            self._reporter.tell_of_recording()
        super().destroy_node()

    def _epoch_ns(self) -> int:
        """Stamp of simulated time zero: zero where this node makes the time or repeats to the bit, else now."""
        return 0 if self.scene["lockstep"] or "clock" in self.scene["outputs"] else self.get_clock().now().nanoseconds

    def _check_clock(self) -> None:
        """Raise ValueError for a clock that no stamp can tell."""
        if (now_ns := self._epoch_ns()) > messages.LATEST_STAMP_NS:
            raise ValueError(
                f"the clock says {now_ns / NANOSECONDS:.0f} s since 1970, and stamps of ROS end at 2^31 s, in 2038; "
                "set the clock, or begin at zero with lockstep or outputs: [clock]"
            )

    def run(self, stop: StopRequest) -> None:
        """Simulate until ``stop`` is requested."""
        self._stop = stop
        idle_time = IdleTime(executor_for(self))
        self._be_prompt()
        gc.collect()
        gc.freeze()  # what exists now stays; the collector need not look at it again while the loop runs
        self._plant.outputs.count_listeners()
        if self._is_default:
            self.get_logger().info("no parameters were given: simulating the default body")
        self._reporter.tell_ready()
        self._reporter.count_afresh()
        loop, reporter, monotonic_ns = self.loop, self._reporter, time.monotonic_ns
        loop.start(self._epoch_ns)  # last: all that is done from here on makes the first steps late
        if self._recorder is not None:
            recording.begin(self._recorder, self.scene, loop)
        loop.publish()
        while not stop.requested:
            loop.turn()
            now_ns = monotonic_ns()
            if now_ns >= reporter.due_ns:
                reporter.report(now_ns)
            try:
                idle_time.spend(now_ns, loop.idle_ns(now_ns))
            except ValueError as reason:  # from a service of rclpy's own: a parameter of a type that does not exist
                self.get_logger().error(f"request ignored: {reason}")

    def _be_prompt(self) -> None:
        realtime.set_timer_slack()
        if (priority := self.scene["realtime_priority"]) and (refusal := realtime.set_priority(priority)):
            self.get_logger().warning(f"parameter realtime_priority = {priority} has no effect: {refusal}")

    def reset(self, *, state: bool = True, time_too: bool | None = None) -> str:
        """Back to the initial state, to time zero, or both, as Loop.reset; returns what became of the time."""
        before = self.simulation.steps
        text = self.loop.reset(state=state, time_too=time_too)
        for part in self._plant.parts:
            if state:
                part.inputs.forget()
            else:
                part.inputs.on_time_moved(self.simulation.steps - before)
        self._reporter.count_afresh()
        return text

    def _quit(self) -> None:
        """End as on SIGTERM."""
        if self._stop is not None:  # services are served in ``run`` alone, which sets it
            self._stop.requested = True

    def _take(self, scene: Scene | FleetScene) -> None:
        """Go on with the dynamic parameters of ``scene``. Raises ValueError, and changes nothing, when it cannot be."""
        factor, old, new = scene["real_time_factor"], by_name(self.scene), by_name(scene)
        parts = [part for part in self._plant.parts if new[part.name] is not old[part.name]]
        changes = [_terms_changed(old[part.name], new[part.name]) for part in parts]
        for part, changed in zip(parts, changes, strict=True):
            if changed:
                self._compile(new[part.name])
                part.simulation.check_change(**changed)
        for part, changed in zip(parts, changes, strict=True):
            if changed:
                part.simulation.change(**changed)
                self._reporter.tell_new_plan(part.name)
            part.inputs.set_limits(new[part.name])
        if factor != self.scene["real_time_factor"]:
            self.loop.set_factor(factor)
        self.scene = scene

    def _compile(self, scene: Scene) -> None:
        """What a scene needs that was not compiled yet, which the loop has to wait for."""
        if first_start.missing(first_start.of_scene(scene.terms(), scene.values)):
            self.get_logger().warning("compiling kernels for what was set: the simulation waits for some seconds")
            first_start.wait()


def _terms_changed(old: Scene, new: Scene) -> dict[str, Any]:
    """Those in which a scene differs from another; the fluid may have another velocity meanwhile, by its topic."""
    before = old.terms().dynamic()
    return {name: one for name, one in new.terms().dynamic().items() if one != before[name]}
