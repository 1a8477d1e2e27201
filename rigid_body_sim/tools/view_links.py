"""ROS side of rigid_body_view: the topics and services of one body, read when a picture is due and never in between.

A node that publishes a thousand poses a second must not cost the one who looks at twenty of them. So no executor
serves the subscriptions: each keeps its latest message, and ``take`` fetches that.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from geometry_msgs.msg import PoseStamped, Vector3, WrenchStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from ..bags import codec
from ..bags.reading import POSE
from ..effects.actuators import Actuator
from ..messages import cdr
from ..values import rotation
from ..values.wrench import Wrench
from ..view.look import UNKNOWN, Look, of_values
from ..view.moment import Moment, level

LATEST = 1
Values = Mapping[str, Any]


class Link:
    """What is heard of one body whose topics begin with ``prefix``, and what is sent to it.

    ``values`` are the parameters of its node, by the names that a scene of this body alone has; empty where they are
    not known.
    """

    def __init__(self, node: Node, prefix: str, values: Values):
        self._node, self._prefix, self._values = node, prefix, values
        self.look: Look = of_values(values) if values else UNKNOWN
        self._poses = self._subscribe(PoseStamped, "pose")
        self._wrenches = [self._subscribe(WrenchStamped, name) for name in self._of_wrenches()]
        self._actuators = self._of_actuators()
        self._moment = self._initial()
        self._sent_at = -1.0  # time of the latest command, as far as is known
        self._wrench_publisher: Any = None
        self._actuator_publisher: Any = None

    def _is_published(self, name: str) -> bool:
        return self._node.count_publishers(self._prefix + name) > 0

    def _subscribe(self, kind: type, name: str) -> Subscription:
        """The latest message, kept for whoever comes late where the publisher keeps it, as in lockstep."""
        ends = self._node.get_publishers_info_by_topic(self._prefix + name)
        kept = {end.qos_profile.durability for end in ends} == {DurabilityPolicy.TRANSIENT_LOCAL}
        profile = QoSProfile(
            depth=LATEST,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if kept else DurabilityPolicy.VOLATILE,
            reliability=ReliabilityPolicy.RELIABLE if kept else ReliabilityPolicy.BEST_EFFORT,
        )
        return self._node.create_subscription(kind, self._prefix + name, _nobody, profile)

    def _of_wrenches(self) -> list[str]:
        """Topics with wrenches: what is applied where the node says so, else the commands."""
        if self._is_published("wrench_applied"):
            return ["wrench_applied"]
        names = self._values.get("wrench.topics") or ("wrench",)
        return [name for name in names if not name.startswith("/")]

    def _of_actuators(self) -> Subscription | None:
        if not self.look.actuators:
            return None
        if self._is_published("actuator_states"):
            return self._subscribe(JointState, "actuator_states")
        return self._subscribe(Float64MultiArray, "actuator_commands")

    def _initial(self) -> Moment | None:
        """Where the body is before anything is heard: a paused node publishes nothing."""
        if not self._values:
            return None
        q = [self._values[f"initial.orientation.{part}"] for part in "wxyz"]
        return Moment(0.0, self._values["initial.position"], rotation.normalize(q).tolist())

    def moment(self) -> Moment | None:
        """What is known now; None before anything is."""
        if (data := take(self._poses, raw=True)) is not None:
            before = self._moment or Moment(0.0, (), ())
            self._moment = Moment(*_placed(data), before.force, before.torque, before.levels)
        if self._moment is not None:
            self._note_wrench()
            self._note_levels()
        return self._moment

    def _note_wrench(self) -> None:
        assert self._moment is not None
        new = [one for one in map(take, self._wrenches) if one is not None]
        if new:
            force, torque = self._in_body_axes(new[0])
            self._moment, self._sent_at = self._moment._replace(force=force, torque=torque), self._moment.time
        elif 0.0 < (self._values.get("wrench.timeout") or 0.0) < self._moment.time - self._sent_at:
            self._moment = self._moment._replace(force=(0.0,) * 3, torque=(0.0,) * 3)

    def _in_body_axes(self, message: WrenchStamped) -> tuple[tuple[float, ...], tuple[float, ...]]:
        assert self._moment is not None
        force, torque = _three(message.wrench.force), _three(message.wrench.torque)
        frame = message.header.frame_id.removeprefix("/")
        if frame in self.look.frames:
            place, q = self.look.frames[frame]
            force, torque = (tuple(rotation.rotate(q, part).tolist()) for part in (force, torque))
            wrench = Wrench(torque_body=torque, points=[(place, force)])
        elif frame == self._values.get("world_frame_id", "world"):
            wrench = Wrench(force_world=force, torque_world=torque)
        else:
            return force, torque
        center = self._values.get("body.center_of_mass", (0.0, 0.0, 0.0))
        numbers = wrench.about_origin(tuple(self._moment.orientation), list(center))
        return numbers[:3], numbers[3:]

    def _note_levels(self) -> None:
        assert self._moment is not None
        if self._actuators is None or (message := take(self._actuators)) is None:
            return
        if isinstance(message, JointState):
            shares = [
                _share(*each) for each in zip(self.look.actuators, message.velocity, message.effort, strict=False)
            ]
        else:
            shares = [level(one, value) for one, value in zip(self.look.actuators, message.data, strict=False)]
        self._moment = self._moment._replace(levels=shares)

    def send_wrench(self, force: tuple[float, ...], torque: tuple[float, ...]) -> None:
        """Publish a command in body axes."""
        if self._wrench_publisher is None:
            topics = [name for name in self._values.get("wrench.topics", ("wrench",)) if not name.startswith("/")]
            self._wrench_publisher = self._node.create_publisher(WrenchStamped, self._prefix + topics[0], LATEST)
        message = WrenchStamped()
        message.header.frame_id = self._values.get("body.frame_id", "")
        for part, values in ((message.wrench.force, force), (message.wrench.torque, torque)):
            part.x, part.y, part.z = values
        self._wrench_publisher.publish(message)

    def send_actuators(self, values: tuple[float, ...]) -> None:
        """Publish commands to the actuators, in their order."""
        if self._actuator_publisher is None:
            self._actuator_publisher = self._node.create_publisher(
                Float64MultiArray, f"{self._prefix}actuator_commands", LATEST
            )
        self._actuator_publisher.publish(Float64MultiArray(data=values))


class Found(NamedTuple):
    """A body whose poses are published: its name, what its topics begin with, and the full name of its node."""

    name: str
    prefix: str
    node: str


def bodies(node: Node, wanted: tuple[str, ...] = ()) -> list[Found]:
    """Bodies in the namespace of ``node``: whatever publishes ``pose`` beside ``twist``; those ``wanted`` alone."""
    topics = dict(node.get_topic_names_and_types())
    root = f"{node.get_namespace().rstrip('/')}/"
    found = []
    for topic, kinds in sorted(topics.items()):
        prefix, last = topic[: topic.rfind("/") + 1], topic.rpartition("/")[2]
        if last != "pose" or not prefix.startswith(root) or "geometry_msgs/msg/PoseStamped" not in kinds:
            continue
        name = prefix.removeprefix(root).strip("/")
        if f"{prefix}twist" not in topics or (wanted and name not in wanted):
            continue
        ends = node.get_publishers_info_by_topic(topic)
        if ends:
            full = f"{ends[0].node_namespace.rstrip('/')}/{ends[0].node_name}"
            found.append(Found(name or ends[0].node_name, prefix, full))
    return found


def take(subscription: Subscription, raw: bool = False) -> Any:
    """The latest message since the last time, or None; with ``raw`` its bytes."""
    with subscription.handle:
        taken = subscription.handle.take_message(subscription.msg_type, raw)
    return None if taken is None else taken[0]


def _nobody(_: Any) -> None:
    """No executor serves these subscriptions."""


def _placed(data: bytes) -> tuple[float, tuple[float, ...], tuple[float, ...]]:
    """Time [s], position and quaternion w, x, y, z of a serialised PoseStamped."""
    if (parts := cdr.split_pose(data)) is None:  # another encoding
        one = codec.decode_one(data, cdr.LAYOUTS[POSE])
        parts = one.stamp_ns, tuple(one.values)
    stamp_ns, (x, y, z, qx, qy, qz, qw) = parts
    return stamp_ns / cdr.NANOSECONDS, (x, y, z), (qw, qx, qy, qz)


def _three(vector: Vector3) -> tuple[float, ...]:
    return vector.x, vector.y, vector.z


def _share(one: Actuator, speed: float, effort: float) -> float:
    if one.type == "wheel" and one.max_speed > 0.0:
        return min(max(speed / one.max_speed, -1.0), 1.0)
    return level(one, speed if one.type == "rotor" else effort)
