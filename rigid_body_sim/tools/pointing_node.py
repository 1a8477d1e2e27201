"""ROS side of the pointing controller: ``pose`` and ``twist`` in, ``wrench`` out. It knows nothing but topics."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from ..physics import rotation
from ..ros import parameters
from ..ros.executor import executor_for
from ..ros.program import StopRequest
from ..scene import attitude, schema
from ..scene.schema import Parameter
from .control import PointingLaw, pointing_law

QUEUE = 10
WARN_EVERY = 5.0  # s between two warnings of the same kind

# The inertia is that of config/satellite.yaml.
PARAMETERS = (
    *schema.attitude("target", "the attitude to hold, body to world"),
    Parameter(
        "inertia",
        tuple,
        (0.143956, 0.185168, 0.061212, 0.0, 0.0, 0.0),
        "ixx, iyy, izz, ixy, ixz, iyz, body axes.",
        "kg m²",
    ),
    Parameter("natural_frequency", float, 1.5, "Of the closed loop for small angles.", "rad/s", above=0.0),
    Parameter("damping_ratio", float, 1.0, "Of the closed loop for small angles; 1 = no overshoot.", above=0.0),
    Parameter(
        "max_torque",
        float,
        0.05,
        "Longest torque vector commanded; a longer one is shortened and keeps its direction.",
        "N m",
        above=0.0,
    ),
    Parameter(
        "frame_id",
        str,
        "",
        "Body frame for the commands' headers; empty = the one that twist is expressed in.",
        optional=True,
    ),
)
TABLE = {parameter.name: parameter for parameter in PARAMETERS}


class PointingController(Node):
    """ROS side of PointingLaw, with ``given`` parameters beside those that rclpy gets by its own ways.

    Raises ValueError, with a sentence, for parameters of no use.
    """

    def __init__(self, given: Mapping[str, Any] = MappingProxyType({}), **node_arguments):
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
        self._waiting: dict[tuple[type, int], PoseStamped | TwistStamped] = {}
        self._publisher = self.create_publisher(WrenchStamped, "wrench", QUEUE)
        self.create_subscription(PoseStamped, "pose", self._on_message, QUEUE)
        self.create_subscription(TwistStamped, "twist", self._on_message, QUEUE)

    def _on_message(self, message: PoseStamped | TwistStamped) -> None:
        """Wait for the other half: pose and twist of a step come one after the other, in either order."""
        stamp = (message.header.stamp.sec, message.header.stamp.nanosec)
        other = TwistStamped if isinstance(message, PoseStamped) else PoseStamped
        if (partner := self._waiting.pop((other, stamp), None)) is None:
            self._waiting[type(message), stamp] = message
            if len(self._waiting) > QUEUE:  # a partner that got lost; dicts remember their order
                del self._waiting[next(iter(self._waiting))]
            return
        pose, twist = (message, partner) if other is TwistStamped else (partner, message)
        try:
            self._publisher.publish(self.answer(pose, twist))
        except ValueError as reason:
            self.get_logger().error(
                f"no torque: {reason}", throttle_duration_sec=WARN_EVERY, throttle_time_source_type=self._steady_clock
            )

    def answer(self, pose: PoseStamped, twist: TwistStamped) -> WrenchStamped:
        """The command for a pose and a twist of one stamp. Raises ValueError when they allow none."""
        q, w = pose.pose.orientation, twist.twist.angular
        orientation, omega = (q.w, q.x, q.y, q.z), (w.x, w.y, w.z)
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
        while not stop.requested:
            executor.spin_once(timeout_sec=0.1)
