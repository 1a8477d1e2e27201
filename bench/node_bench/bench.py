"""One node under test: started as a process, listened to, and looked at through /proc."""

import contextlib
import os
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from rclpy.node import Node

from rigid_body_sim.ros.executor import executor_for
from rigid_body_sim.tools.processes import Child, Children, children

OUR_NODE = "rigid_body_sim.ros.main"
CONNECTED_WITHIN = 180.0  # s: kernels may have to be compiled first
WARM_UP = 2.0  # s after the first pose, of which nothing is counted
DEEP_QUEUE = 5000  # what the listener leaves lying for a while must not look like something lost
TICKS = os.sysconf("SC_CLK_TCK")
SPINNING = {"body.inertia": "[0.1, 0.2, 0.25, 0.0, 0.0, 0.0]", "initial.angular_velocity": "[0.1, 1.0, 0.2]"}

_stamp = struct.Struct("<iI").unpack_from  # at byte 4 of a message that begins with a header
Parameters = Mapping[str, object]


class Ear(Node):
    """The one listener: counts poses and the steps that are missing between them, and keeps the diagnostics.

    When it is not ``attentive`` it hears the diagnostics alone.
    """

    def __init__(self, namespace: str, attentive: bool):
        super().__init__("listener", namespace=namespace)
        self.poses = self.missing = 0
        self.period_ns = 0
        self.on_pose: Callable[[bytes], object] = lambda _: None
        self.diagnostics: list[dict[str, str]] = []
        self._last_ns = 0
        self._prefix = f"{namespace}/"
        if attentive:
            self.create_subscription(PoseStamped, "pose", self._on_pose, DEEP_QUEUE, raw=True)
            self.create_subscription(TwistStamped, "twist", lambda _: None, DEEP_QUEUE, raw=True)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)

    def _on_pose(self, data: bytes) -> None:
        seconds, nanoseconds = _stamp(data, 4)
        stamp_ns = seconds * 1_000_000_000 + nanoseconds
        if self.period_ns and self._last_ns:
            self.missing += round((stamp_ns - self._last_ns) / self.period_ns) - 1
        self._last_ns = stamp_ns
        self.poses += 1
        self.on_pose(data)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name.startswith(self._prefix):
                self.diagnostics.append({item.key: item.value for item in status.values})


class UnderTest:
    """A node that runs, with its listener. ``serve`` lets the listener hear; all waiting is done there."""

    def __init__(self, running: Children, module: str, arguments: list[str], ear: Ear, environment=None):
        self.ear = ear
        self._running = running
        self._executor = executor_for(ear)
        self.began = time.monotonic()
        self.process: Child = running.start(module, arguments, environment)

    def serve(self, seconds: float) -> None:
        """Listen for so long. Raises ChildError when the node ends."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=min(left, 0.1))
        self._running.check()

    def serve_until(self, happened: Callable[[], object], within: float, what: str) -> None:
        """Listen until ``happened()``. Raises TimeoutError, saying ``what`` did not come, and ChildError."""
        end = time.monotonic() + within
        while not happened():
            self._executor.spin_once(timeout_sec=0.05)
            self._running.check()
            if time.monotonic() > end:
                raise TimeoutError(f"no {what} within {within:g} s")

    def cpu_seconds(self) -> float:
        """CPU time of all threads since the process began, user and system."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / TICKS

    def loop_seconds(self) -> float:
        """CPU time of the first thread, which is the loop's, to the nanosecond."""
        return int(Path(f"/proc/{self.process.pid}/schedstat").read_text().split()[0]) / 1e9

    def resident_kb(self) -> int:
        """Memory that the process has in RAM."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") // 1024

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self.ear.destroy_node()


_numbers = iter(range(1, 1_000_000))


@contextlib.contextmanager
def node_under_test(
    parameters: Parameters,
    module: str = OUR_NODE,
    *,
    leading: tuple[str, ...] = (),
    attentive: bool = True,
    scene: Path | None = None,
    environment: Mapping[str, str] | None = None,
) -> Iterator[UnderTest]:
    """Start ``module`` in a namespace of its own; on leaving it is ended. ``attentive``: listen to pose and twist."""
    namespace = f"/bench{next(_numbers)}"
    settings = [part for name, value in parameters.items() for part in ("-p", f"{name}:={value}")]
    file = ["--params-file", str(scene)] if scene else []
    arguments = [*leading, "--ros-args", "-r", f"__ns:={namespace}", *file, *settings]
    with children() as running:
        ear = Ear(namespace, attentive)
        under_test = UnderTest(running, module, arguments, ear, environment)
        try:
            yield under_test
        finally:
            under_test.close()


def wait_warm(node: UnderTest) -> None:
    """Until WARM_UP seconds after the node was first heard."""
    node.serve_until(lambda: node.ear.poses or node.ear.diagnostics, CONNECTED_WITHIN, "message of the node")
    node.serve(WARM_UP)


@contextlib.contextmanager
def subscriber(node: UnderTest) -> Iterator[None]:
    """Somebody to whom pose and twist are sent and who reads none of them: at full speed Python cannot keep up."""
    bystander = Node("subscriber", namespace=node.ear.get_namespace())
    for kind, topic in ((PoseStamped, "pose"), (TwistStamped, "twist")):
        bystander.create_subscription(kind, topic, lambda _: None, 10, raw=True)
    try:
        node.serve_until(lambda: bystander.count_publishers("pose"), CONNECTED_WITHIN, "publisher of pose")
        yield
    finally:
        bystander.destroy_node()


def commands(node: UnderTest) -> Callable[[WrenchStamped], None]:
    """What publishes wrenches to the node; it has discovered it when this returns."""
    publisher = node.ear.create_publisher(WrenchStamped, "wrench", 10)
    node.serve_until(publisher.get_subscription_count, CONNECTED_WITHIN, "subscription to wrench")
    return publisher.publish
