"""ROS side of the pointing controller: ``pose`` and ``twist`` in, ``wrench`` out. It knows nothing but topics."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped

from ..ros import parameters
from ..scene import attitude
from .answering_node import AnsweringNode, in_body_axes
from .control import PARAMETERS, PointingLaw, pointing_law

TABLE = {parameter.name: parameter for parameter in PARAMETERS}


class PointingController(AnsweringNode):
    """ROS side of PointingLaw, with ``given`` parameters beside those that rclpy gets by its own ways.

    Raises ValueError, with a sentence, for parameters of no use.
    """

    def __init__(self, given: Mapping[str, Any] = MappingProxyType({}), **node_arguments: Any):
        super().__init__("pointing_controller", **node_arguments)
        values = attitude.read(parameters.all_given(self, given), TABLE)
        self._frame_id = values["frame_id"]
        law = {name: values[name] for name in ("inertia", "natural_frequency", "damping_ratio", "max_torque")}
        self.law: PointingLaw = pointing_law(attitude.quaternion(values, "target"), **law)
        parameters.declare_values(self, values, TABLE.__getitem__)
        self.law.torque(self.law.target, np.zeros(3))  # compiles what it calls: the first answer must not come late
        parameters.refuse_undeclared(self)
        self._refusals = parameters.Refusals(self, TABLE)
        purpose = f"target {self.law.target.tolist()}, at most {self.law.max_torque:g} N m"
        self.begin(WrenchStamped, "wrench", self.answer, purpose)

    def answer(self, pose: PoseStamped, twist: TwistStamped) -> WrenchStamped:
        """The command for a pose and a twist of one stamp. Raises ValueError when they allow none."""
        q = pose.pose.orientation
        if twist.header.frame_id == pose.header.frame_id and not self._frame_id:
            raise ValueError("twist is in world axes, which does not tell the body's frame; set frame_id")
        _, omega = in_body_axes(pose, twist)
        command = WrenchStamped()
        command.header.stamp = pose.header.stamp
        command.header.frame_id = self._frame_id or twist.header.frame_id
        torque = command.wrench.torque
        torque.x, torque.y, torque.z = self.law.torque((q.w, q.x, q.y, q.z), omega).tolist()
        return command
