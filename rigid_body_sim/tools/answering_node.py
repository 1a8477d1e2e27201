"""What the controllers share: a node that answers every pair of ``pose`` and ``twist`` of one stamp with a command."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription

from ..kernels.arrays import Floats
from ..ros.executor import executor_for
from ..ros.program import StopRequest
from ..values import rotation

QUEUE = 10
LOOK_EVERY_NS = 500_000_000  # between two looks at who publishes the state
WARN_EVERY = 5.0  # s between two warnings of the same kind


class AnsweringNode(Node):
    """A controller that knows nothing but topics. Whoever makes one from it calls ``begin`` when all is ready."""

    def begin(self, kind: type, topic: str, answer: Callable[[PoseStamped, TwistStamped], Any], purpose: str) -> None:
        """Answer from now on, with messages of that kind on that topic; ``purpose``, what that does, is for the log.

        ``answer`` makes one of a pose and a twist of one stamp. Raises ValueError when they allow none.
        """
        self._answer, self._purpose = answer, purpose
        self._steady_clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._waiting: dict[tuple[type, tuple[int, int]], PoseStamped | TwistStamped] = {}
        self._unheard: tuple[PoseStamped, TwistStamped] | None = None
        self._publisher = self.create_publisher(kind, topic, QUEUE)
        self._subscriptions_of_state: list[Subscription] = []
        self._knows_publishers = False
        self._subscribe(DurabilityPolicy.VOLATILE)

    def _subscribe(self, durability: DurabilityPolicy) -> None:
        for old in self._subscriptions_of_state:
            self.destroy_subscription(old)
        self._durability = durability
        kept = durability == DurabilityPolicy.TRANSIENT_LOCAL
        profile = QoSProfile(depth=1 if kept else QUEUE, durability=durability)
        self._subscriptions_of_state = [
            self.create_subscription(kind, topic, self._on_message, profile)
            for kind, topic in ((PoseStamped, "pose"), (TwistStamped, "twist"))
        ]

    def _follow_publishers(self) -> bool:
        """Ask for the state that is kept, where it is: in lockstep time stands still until somebody has answered it.

        Returns whether it is asked for anew, so that what came before comes once more.
        """
        ends = self.get_publishers_info_by_topic("pose")
        kept = {end.qos_profile.durability for end in ends} == {DurabilityPolicy.TRANSIENT_LOCAL}
        wanted = DurabilityPolicy.TRANSIENT_LOCAL if kept else DurabilityPolicy.VOLATILE
        self._knows_publishers = bool(ends)
        if not ends or wanted == self._durability:
            return False
        self._waiting.clear()
        self._subscribe(wanted)
        return True

    def _on_message(self, message: PoseStamped | TwistStamped) -> None:
        """Wait for the other half: pose and twist of a step come one after the other, in either order."""
        if not self._knows_publishers and self._follow_publishers():
            return  # answered now, it would be answered twice
        stamp = (message.header.stamp.sec, message.header.stamp.nanosec)
        other = TwistStamped if isinstance(message, PoseStamped) else PoseStamped
        if (partner := self._waiting.pop((other, stamp), None)) is None:
            self._waiting[type(message), stamp] = message
            if len(self._waiting) > QUEUE:  # a partner that got lost; dicts remember their order
                del self._waiting[next(iter(self._waiting))]
            return
        self._reply(*((message, partner) if other is TwistStamped else (partner, message)))

    def _reply(self, pose: PoseStamped, twist: TwistStamped) -> None:
        """Publish the answer; where nobody would hear it yet, keep the question until somebody does."""
        if not self._publisher.get_subscription_count():
            self._unheard = pose, twist
            return
        self._unheard = None
        try:
            self._publisher.publish(self._answer(pose, twist))
        except ValueError as reason:
            self.get_logger().error(
                f"no command: {reason}", throttle_duration_sec=WARN_EVERY, throttle_time_source_type=self._steady_clock
            )

    def run(self, stop: StopRequest) -> None:
        """Answer until ``stop.requested``."""
        executor = executor_for(self)
        self.get_logger().info(f"ready: {self._purpose}")
        look_ns = 0
        while not stop.requested:
            executor.spin_once(timeout_sec=0.1)
            if (now_ns := time.monotonic_ns()) >= look_ns:
                look_ns = now_ns + LOOK_EVERY_NS
                self._follow_publishers()
            if self._unheard is not None:
                self._reply(*self._unheard)


def in_body_axes(pose: PoseStamped, twist: TwistStamped) -> tuple[Floats, Floats]:
    """Linear [m/s] and angular velocity [rad/s] of a twist in the body's axes, whichever the frame of the twist is."""
    v, w = (np.array((part.x, part.y, part.z)) for part in (twist.twist.linear, twist.twist.angular))
    if twist.header.frame_id != pose.header.frame_id:
        return v, w
    q = pose.pose.orientation
    orientation = (q.w, q.x, q.y, q.z)
    return rotation.rotate_back(orientation, v), rotation.rotate_back(orientation, w)
