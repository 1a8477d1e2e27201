"""ROS side of the pointing controller: ``pose`` and ``twist`` in, ``wrench`` out. It knows nothing but topics."""

import time
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription

from ..ros import parameters
from ..ros.executor import executor_for
from ..ros.program import StopRequest
from ..scene import attitude
from ..values import rotation
from .control import PARAMETERS, PointingLaw, pointing_law

QUEUE = 10
LOOK_EVERY_NS = 500_000_000  # between two looks at who publishes the state
WARN_EVERY = 5.0  # s between two warnings of the same kind

TABLE = {parameter.name: parameter for parameter in PARAMETERS}


class PointingController(Node):
    """ROS side of PointingLaw, with ``given`` parameters beside those that rclpy gets by its own ways.

    Raises ValueError, with a sentence, for parameters of no use.
    """

    def __init__(self, given: Mapping[str, Any] = MappingProxyType({}), **node_arguments: Any):
        super().__init__("pointing_controller", **node_arguments)
        values = attitude.read(parameters.all_given(self, given), TABLE)
        self._frame_id = values["frame_id"]
        law = {name: values[name] for name in ("inertia", "natural_frequency", "damping_ratio", "max_torque")}
        self.law: PointingLaw = pointing_law(attitude.quaternion(values, "target"), **law)
        parameters.declare_values(self, values, TABLE)
        self.law.torque(self.law.target, np.zeros(3))  # compiles what it calls: the first answer must not come late
        self._steady_clock = Clock(clock_type=ClockType.STEADY_TIME)
        parameters.refuse_undeclared(self)
        self._refusals = parameters.Refusals(self, TABLE)
        self._waiting: dict[tuple[type, tuple[int, int]], PoseStamped | TwistStamped] = {}
        self._unheard: tuple[PoseStamped, TwistStamped] | None = None
        self._publisher = self.create_publisher(WrenchStamped, "wrench", QUEUE)
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
            self._publisher.publish(self.answer(pose, twist))
        except ValueError as reason:
            self.get_logger().error(
                f"no torque: {reason}", throttle_duration_sec=WARN_EVERY, throttle_time_source_type=self._steady_clock
            )

    def answer(self, pose: PoseStamped, twist: TwistStamped) -> WrenchStamped:
        """The command for a pose and a twist of one stamp. Raises ValueError when they allow none."""
        q, w = pose.pose.orientation, twist.twist.angular
        orientation, omega = (q.w, q.x, q.y, q.z), np.array((w.x, w.y, w.z))
        in_world_axes = twist.header.frame_id == pose.header.frame_id
        if in_world_axes and not self._frame_id:
            raise ValueError("twist is in world axes, which does not tell the body's frame; set frame_id")
        if in_world_axes:
            omega = rotation.rotate_back(orientation, omega)
        command = WrenchStamped()
        command.header.stamp = pose.header.stamp
        command.header.frame_id = self._frame_id or twist.header.frame_id
        torque = command.wrench.torque
        torque.x, torque.y, torque.z = self.law.torque(orientation, omega).tolist()
        return command

    def run(self, stop: StopRequest) -> None:
        """Answer until ``stop.requested``."""
        executor = executor_for(self)
        self.get_logger().info(f"ready: target {self.law.target.tolist()}, at most {self.law.max_torque:g} N m")
        look_ns = 0
        while not stop.requested:
            executor.spin_once(timeout_sec=0.1)
            if (now_ns := time.monotonic_ns()) >= look_ns:
                look_ns = now_ns + LOOK_EVERY_NS
                self._follow_publishers()
            if self._unheard is not None:
                self._reply(*self._unheard)
