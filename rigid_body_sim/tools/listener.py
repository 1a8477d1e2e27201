"""ROS side of the demo: a node that listens, and what it heard."""

import time
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger

from ..kernels.arrays import Floats
from ..scene.loader import Scene
from ..values import rotation
from .heard import NANOSECONDS, Heard

ANSWER_WITHIN = 1.0  # s
PAUSE = 0.1  # s between two calls
QUEUE = 1000  # ten seconds of poses: a slow terminal must not cost one


class Listener(Node):
    """Keeps every pose, twist, wrench and diagnostic message of a node that runs ``scene``."""

    def __init__(self, scene: Scene, **node_arguments: Any):
        super().__init__("rigid_body_demo", **node_arguments)
        self._twist_in_body_axes = scene["twist_frame"] == "body"
        self.orientations: dict[int, tuple[float, ...]] = {}  # by stamp [ns]
        self.diagnostics: list[dict[str, str]] = []
        self._rates: dict[int, tuple[float, ...]] = {}
        self._arrivals_ns: dict[int, int] = {}
        self._commands: list[tuple[int, tuple[float, ...]]] = []
        self.create_subscription(PoseStamped, "pose", self._on_pose, QUEUE)
        self.create_subscription(TwistStamped, "twist", self._on_twist, QUEUE)
        self.create_subscription(WrenchStamped, "wrench", self._on_wrench, QUEUE)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, QUEUE)
        self._reset = self.create_client(Trigger, "rigid_body_node/reset")
        self._pause = self.create_client(SetBool, "rigid_body_node/pause")
        self._asked: tuple[Client | None, Future | None] = (None, None)
        self._asked_at = 0.0

    def let_go(self) -> bool:
        """One turn of bringing a paused node to life; True once it runs.

        It is reset, which publishes its initial state, until pose, twist and a command answering them have come
        through; only then is it let go, so nothing acts on the body unrecorded.
        """
        if not (self.orientations and self._rates and self._commands):
            self._answered(self._reset, Trigger.Request())
            return False
        self.diagnostics.clear()
        return self._answered(self._pause, SetBool.Request(data=False))

    def _answered(self, client: Client, request: object) -> bool:
        """Call, and again when no answer comes: one gets lost until the service has discovered its client."""
        asked, call = self._asked
        if asked is client and call is not None and call.done():
            self._asked = (client, None)
            return True
        waited = time.monotonic() - self._asked_at
        overdue = asked is not client or waited > (PAUSE if call is None else ANSWER_WITHIN)
        if overdue and client.service_is_ready():
            self._asked, self._asked_at = (client, client.call_async(request)), time.monotonic()
        return False

    @property
    def seconds(self) -> float:
        """Simulated time between the first pose heard and the last."""
        if not self.orientations:
            return 0.0
        return (next(reversed(self.orientations)) - next(iter(self.orientations))) / NANOSECONDS

    def latest(self) -> tuple[float, ...]:
        """Orientation (w, x, y, z), body → world, of the last pose heard."""
        return next(reversed(self.orientations.values()))

    def heard(self) -> Heard:
        """All steps of which both pose and twist were heard, and all commands."""
        stamps = sorted(self.orientations.keys() & self._rates.keys())
        orientation = np.array([self.orientations[stamp] for stamp in stamps])
        rates = np.array([self._rates[stamp] for stamp in stamps])
        if not self._twist_in_body_axes:
            rates = np.array([rotation.rotate_back(q, w) for q, w in zip(orientation, rates, strict=True)])
        return Heard(np.array(stamps, np.int64), orientation, rates, *self._applied())

    def _applied(self) -> tuple[Floats, Floats]:
        applied_ns = np.array([applied for applied, _ in self._commands], np.int64)
        torque = np.array([torque for _, torque in self._commands]).reshape(-1, 3)
        return np.maximum.accumulate(applied_ns), torque

    def _on_pose(self, message: PoseStamped) -> None:
        stamp_ns, q = _nanoseconds(message.header), message.pose.orientation
        self._arrivals_ns[stamp_ns] = time.monotonic_ns()
        self.orientations[stamp_ns] = (q.w, q.x, q.y, q.z)

    def _on_twist(self, message: TwistStamped) -> None:
        w = message.twist.angular
        self._rates[_nanoseconds(message.header)] = (w.x, w.y, w.z)

    def _on_wrench(self, message: WrenchStamped) -> None:
        """Note when the command began to act: it reaches the node as long after the pose as it reaches us."""
        now_ns, stamp_ns, t = time.monotonic_ns(), _nanoseconds(message.header), message.wrench.torque
        delay_ns = now_ns - self._arrivals_ns.get(stamp_ns, now_ns)
        self._commands.append((stamp_ns + delay_ns, (t.x, t.y, t.z)))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.diagnostics.append({item.key: item.value for item in status.values})


def _nanoseconds(header: Header) -> int:
    return header.stamp.sec * NANOSECONDS + header.stamp.nanosec
