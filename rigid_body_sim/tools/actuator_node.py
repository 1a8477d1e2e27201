"""ROS side of the actuator controller: ``pose`` and ``twist`` in, ``actuator_commands`` out; it knows but topics."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from std_msgs.msg import Float64MultiArray

from ..ros import parameters
from ..scene import attitude
from ..scene.loader import Scene, load_scene
from .actuator_laws import PLANT, Controller, Sensed, controller, kind_of
from .answering_node import AnsweringNode, in_body_axes


class ActuatorController(AnsweringNode):
    """ROS side of actuator_laws.Controller, with ``given`` parameters beside those that rclpy gets by its own ways.

    Raises ValueError, with a sentence, for parameters of no use.
    """

    def __init__(self, given: Mapping[str, Any] = MappingProxyType({}), **node_arguments: Any):
        super().__init__("actuator_controller", **node_arguments)
        found = parameters.all_given(self, given)
        scene = _plant(PLANT.read("plant", found.get("plant", PLANT.default)))
        table = {row.name: row for row in (PLANT, *kind_of(scene).parameters)}
        values = attitude.read(found, table)
        self.controller: Controller = controller(scene, values)
        parameters.declare_values(self, values, table.__getitem__)
        rest = scene.initial_state()
        # It compiles what it calls: the first answer must not come late.
        self.controller.commands(Sensed(rest.position, rest.orientation, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
        parameters.refuse_undeclared(self)
        self._refusals = parameters.Refusals(self, table)
        names = ", ".join(one.name for one in self.controller.allocation.actuators)
        purpose = f"{type(self.controller.law).__name__.lower()} by {names}"
        self.begin(Float64MultiArray, "actuator_commands", self.answer, purpose)

    def answer(self, pose: PoseStamped, twist: TwistStamped) -> Float64MultiArray:
        """The commands for a pose and a twist of one stamp. Raises ValueError when they allow none."""
        p, q = pose.pose.position, pose.pose.orientation
        sensed = Sensed((p.x, p.y, p.z), (q.w, q.x, q.y, q.z), *in_body_axes(pose, twist))
        return Float64MultiArray(data=self.controller.commands(sensed))


def _plant(path: str) -> Scene:
    """The scene of the plant. Raises ValueError for none, and for one that cannot be read."""
    if not path:
        raise ValueError("parameter plant is not given; give the scene of the plant, such as config/quadrotor.yaml")
    try:
        return load_scene(path)
    except OSError as reason:
        raise ValueError(f"parameter plant = {path}: cannot be read: {reason.strerror}; give a scene") from None
