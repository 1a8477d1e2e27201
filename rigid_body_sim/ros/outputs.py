"""What the node publishes of a step: an entry for each kind of output, and the channels that carry those asked for.

A quaternion is w, x, y, z inside and x, y, z, w in messages: the order changes here.
"""

from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from geometry_msgs.msg import AccelStamped, PoseStamped, TransformStamped, TwistStamped, WrenchStamped
from rclpy.event_handler import PublisherEventCallbacks, QoSPublisherMatchedInfo, UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message

from ..kernels.vectors import qmultiply, qrotate, qrotate_back
from ..scene import file_path
from ..scene.loader import Scene
from ..scene.solid import BOX, CYLINDER, ELLIPSOID, MESH, solid
from ..sensors.instrument import Instrument
from ..simulation import Simulation
from . import sensor_outputs, templates
from .messages import inside, overridable

QUEUE = 10
ALWAYS = ("pose", "twist")
Numbers = tuple[float, ...]


class Motion:
    """A simulation's present motion in the order of messages; each part is worked out when first asked for."""

    def __init__(self, simulation: Simulation):
        self.simulation = simulation
        self._values = simulation.motion

    @property
    def position(self) -> Numbers:
        """Of the body frame's origin, world axes."""
        return self._values[0:3]

    @property
    def q_world_body(self) -> Numbers:
        """Quaternion w, x, y, z, body → world."""
        return self._values[3:7]

    @property
    def pose(self) -> Numbers:
        """Of the body frame in the world: position and quaternion x, y, z, w, 7 numbers."""
        x, y, z, qw, qx, qy, qz = self._values[0:7]
        return x, y, z, qx, qy, qz, qw

    @property
    def twist_world(self) -> Numbers:
        """Velocity of the body frame's origin and angular velocity, world axes, 6 numbers."""
        return self._values[7:13]

    @property
    def twist_body(self) -> Numbers:
        """The same in body axes."""
        return self._values[13:19]

    @cached_property
    def acceleration(self) -> Numbers:
        """Of the body frame's origin in world axes and dω/dt in body axes, 6 numbers."""
        return self.simulation.acceleration

    @property
    def acceleration_body(self) -> Numbers:
        """Acceleration of the body frame's origin relative to the world and dω/dt, body axes, 6 numbers."""
        return *qrotate_back(*self.q_world_body, *self.acceleration[0:3]), *self.acceleration[3:6]

    @property
    def acceleration_world(self) -> Numbers:
        """The same in world axes."""
        return *self.acceleration[0:3], *qrotate(*self.q_world_body, *self.acceleration[3:6])

    @property
    def inertial(self) -> Numbers:
        """Orientation, angular velocity and specific force at the body frame's origin, body axes, 10 numbers.

        Specific force is acceleration less that of free fall: what an accelerometer shows, REP-145.
        """
        specific = np.subtract(self.acceleration[0:3], self.simulation.gravity).tolist()
        return *self.pose[3:7], *self.twist_body[3:6], *qrotate_back(*self.q_world_body, *specific)

    @property
    def wrench(self) -> Numbers:
        """The held wrench as force and torque about the body frame's origin, body axes, 6 numbers."""
        return self.simulation.wrench.about_origin(self.q_world_body, self.simulation.body.center_of_mass.tolist())

    def placed(self, point_body: Sequence[float], q_body_thing: Sequence[float]) -> Numbers:
        """Pose in the world of a thing fixed to the body, whose pose in the body frame is that, 7 numbers."""
        position = map(sum, zip(self.position, qrotate(*self.q_world_body, *point_body), strict=True))
        w, x, y, z = qmultiply(*self.q_world_body, *q_body_thing)
        return *position, x, y, z, w


@dataclass(frozen=True)
class Output:
    """One kind of output: its ``message`` holds all that stays the same, ``fields`` take the ``values`` of a motion.

    Of a sensor they are those of what it has measured.
    """

    topic: str
    message: Any
    fields: tuple[str, ...]
    values: Callable[[Any], Numbers]
    stamp: str = templates.HEADER_STAMP
    depth: int = QUEUE
    kept: int = 1  # messages, where some are kept for those who join late


def _vector(path: str) -> tuple[str, ...]:
    return tuple(f"{path}.{axis}" for axis in "xyz")


def _quaternion(path: str) -> tuple[str, ...]:
    return tuple(f"{path}.{axis}" for axis in "xyzw")


def _pose_of(path: str) -> tuple[str, ...]:
    return _vector(f"{path}.position") + _quaternion(f"{path}.orientation")


def _twist_of(path: str) -> tuple[str, ...]:
    return _vector(f"{path}.linear") + _vector(f"{path}.angular")


def _pose(scene: Scene, _: Simulation) -> Output:
    message = PoseStamped()
    message.header.frame_id = scene["world_frame_id"]
    return Output("pose", message, _pose_of("pose"), lambda motion: motion.pose)


def _twist(scene: Scene, _: Simulation) -> Output:
    message = TwistStamped()
    if scene["twist_frame"] == "body":
        message.header.frame_id = scene["body.frame_id"]
        return Output("twist", message, _twist_of("twist"), lambda motion: motion.twist_body)
    message.header.frame_id = scene["world_frame_id"]
    return Output("twist", message, _twist_of("twist"), lambda motion: motion.twist_world)


def _odom(scene: Scene, _: Simulation) -> Output:
    from nav_msgs.msg import Odometry

    message = Odometry(child_frame_id=scene["body.frame_id"])
    message.header.frame_id = scene["world_frame_id"]
    fields = _pose_of("pose.pose") + _twist_of("twist.twist")
    return Output("odom", message, fields, lambda motion: motion.pose + motion.twist_body)


def _accel(scene: Scene, _: Simulation) -> Output:
    message = AccelStamped()
    if scene["twist_frame"] == "body":
        message.header.frame_id = scene["body.frame_id"]
        return Output("accel", message, _twist_of("accel"), lambda motion: motion.acceleration_body)
    message.header.frame_id = scene["world_frame_id"]
    return Output("accel", message, _twist_of("accel"), lambda motion: motion.acceleration_world)


def _imu(scene: Scene, _: Simulation) -> Output:
    from sensor_msgs.msg import Imu

    message = Imu()
    message.header.frame_id = scene["body.frame_id"]
    fields = _quaternion("orientation") + _vector("angular_velocity") + _vector("linear_acceleration")
    return Output("imu", message, fields, lambda motion: motion.inertial)


def _wrench_applied(scene: Scene, _: Simulation) -> Output:
    message = WrenchStamped()
    message.header.frame_id = scene["body.frame_id"]
    fields = _vector("wrench.force") + _vector("wrench.torque")
    return Output("wrench_applied", message, fields, lambda motion: motion.wrench)


def _actuator_states(_: Scene, simulation: Simulation) -> Output:
    from sensor_msgs.msg import JointState

    names = [one.name for one in simulation.actuators]
    message = JointState(name=names, velocity=[0.0] * len(names), effort=[0.0] * len(names))
    fields = tuple(f"{what}.{i}" for what in ("velocity", "effort") for i in range(len(names)))

    def values(motion: Motion) -> Numbers:
        states = motion.simulation.actuator_states
        return *(one.speed for one in states), *(one.effort for one in states)

    return Output("actuator_states", message, fields, values)


def _marker(scene: Scene, simulation: Simulation) -> Output:
    from visualization_msgs.msg import Marker

    message = Marker(ns=scene["body.frame_id"], action=Marker.ADD)
    message.header.frame_id = scene["world_frame_id"]
    # Exact as float32, in which colours are sent.
    message.color.r, message.color.g, message.color.b, message.color.a = 0.375, 0.625, 0.875, 1.0
    shown = simulation.body
    kind, size, point, q = solid(scene.values, shown)
    message.type = getattr(Marker, _MARKERS[kind])
    if kind == MESH:
        message.mesh_resource = file_path.url(scene["body.mesh_file"])

    def values(motion: Motion) -> Numbers:
        nonlocal shown, size, point, q
        if motion.simulation.body is not shown:
            shown = motion.simulation.body
            _, size, point, q = solid(scene.values, shown)
        return *motion.placed(point, q), *size

    return Output("marker", message, _pose_of("pose") + _vector("scale"), values)


_MARKERS = {ELLIPSOID: "SPHERE", BOX: "CUBE", CYLINDER: "CYLINDER", MESH: "MESH_RESOURCE"}


def _tf(scene: Scene, _: Simulation) -> Output:
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError as reason:
        raise ValueError(
            f"parameter outputs: 'tf' needs the package tf2_msgs, which cannot be imported ({reason}); "
            "install it (ros-jazzy-tf2-msgs, which PyPI does not have) or leave 'tf' out"
        ) from None
    transform = TransformStamped(child_frame_id=scene["body.frame_id"])
    transform.header.frame_id = scene["world_frame_id"]
    fields = _vector("transforms.0.transform.translation") + _quaternion("transforms.0.transform.rotation")
    message = TFMessage(transforms=[transform])
    return Output("/tf", message, fields, lambda motion: motion.pose, stamp="transforms.0.header.stamp", depth=100)


def _clock(_: Scene, __: Simulation) -> Output:
    from rosgraph_msgs.msg import Clock

    return Output("/clock", Clock(), (), lambda _: (), stamp="clock", depth=1)


# In the order of publishing: whoever is woken by the clock has the step's other messages already.
KINDS: dict[str, Callable[[Scene, Simulation], Output]] = {
    "pose": _pose,
    "twist": _twist,
    "odom": _odom,
    "accel": _accel,
    "imu": _imu,
    "wrench_applied": _wrench_applied,
    "actuator_states": _actuator_states,
    "marker": _marker,
    "tf": _tf,
    "clock": _clock,
}


def _within(space: str, output: Output) -> Output:
    return replace(output, topic=inside(space, output.topic))


class Channel:
    """The publisher of one output, ``end``. ``listeners`` is how many subscriptions there are, as far as is known.

    With ``keep``, the latest messages are kept for subscriptions yet to come, so there is always taken to be one. It is
    ``wanted`` when somebody listens, or when it is recorded; ``changed()`` is called when that may be otherwise.
    """

    def __init__(self, node: Node, output: Output, keep: bool, changed: Callable[[], None], space: str = ""):
        self.output, self._space = output, space
        self._keep, self._changed = keep, changed
        self.listeners = int(keep)
        self._record: Callable[[bytes], None] | None = None
        self._told = True
        self.end = self._create(node)
        self._writer, reason = templates.writer(output.message, output.fields, output.stamp)
        # ``Publisher.publish`` looks at the type of what it is given, which costs as much as sending the bytes.
        self._send = self.end.publish if reason else self.end.handle.publish_raw
        self._as_bytes = serialize_message if reason else bytes
        if reason:
            node.get_logger().info(f"topic {output.topic} is published field by field: {reason}")

    def _create(self, node: Node) -> Publisher:
        overriding = overridable(node, self._space, self.output.topic)
        durability = DurabilityPolicy.TRANSIENT_LOCAL if self._keep else DurabilityPolicy.VOLATILE
        profile = QoSProfile(depth=self.output.kept if self._keep else self.output.depth, durability=durability)
        kind, topic = type(self.output.message), self.output.topic
        create = partial(node.create_publisher, kind, topic, profile, qos_overriding_options=overriding)
        try:
            return create(event_callbacks=PublisherEventCallbacks(matched=self._on_matched))
        except UnsupportedEventTypeError:
            self._told = False
            return create()

    def _on_matched(self, event: QoSPublisherMatchedInfo) -> None:
        self._note(event.current_count)

    def _note(self, listeners: int) -> None:
        self.listeners = max(listeners, self._keep)
        self._changed()

    def count_listeners(self) -> None:
        """Ask, where no event has told yet. Where none ever will there is always taken to be one."""
        self._note(self.end.get_subscription_count() if self._told else 1)

    def record(self, record: Callable[[bytes], None]) -> None:
        """From now on also give the bytes of each message to ``record``."""
        self._record = record
        self._changed()

    @property
    def wanted(self) -> bool:
        """Whether there is anybody for whom to make a message."""
        return self.listeners > 0 or self._record is not None

    def publish(self, stamp_ns: int, motion: Any) -> None:
        """Send the output for this motion, stamped with this time [ns]."""
        message = self._writer.write(stamp_ns, self.output.values(motion))
        if self.listeners:
            self._send(message)
        if self._record is not None:
            self._record(self._as_bytes(message))


def _as_they_are(values: Numbers) -> Numbers:
    return values


class SensorChannel(Channel):
    """The publisher of a sensor: it measures at each of its instants, once, and sends that when its delay is over.

    A measurement waits with its stamp; where time has begun anew meanwhile, it is gone.
    """

    def __init__(
        self,
        node: Node,
        scene: Scene,
        simulation: Simulation,
        one: Instrument,
        changed: Callable[[], None],
        space: str = "",
    ):
        message, fields = sensor_outputs.message_of(one, scene, space)
        values = sensor_outputs.ORDERS.get(one.type.name, _as_they_are)
        depth = max(QUEUE, scene["steps_per_command"] // one.every + 1)  # of one command there may be as many
        output = Output(one.sensor.name, message, fields, values, depth=depth, kept=depth)
        super().__init__(node, _within(space, output), scene["lockstep"], changed, space)
        self._simulation, self._one, self._measured = simulation, one, -1
        self._waiting: deque[tuple[int, int, Numbers]] = deque()  # step at which it is sent, stamp, and what

    def look_again(self) -> None:
        """Where the state is another one: the present step counts as not measured."""
        self._measured = -1

    def left(self) -> int:
        """Steps from the present one to the next at which there is something to do."""
        steps = self._simulation.steps
        left = self._one.every - steps % self._one.every
        return min(left, self._waiting[0][0] - steps) if self._waiting else left

    def publish(self, stamp_ns: int, motion: Any) -> None:
        """Measure, and send, what is due at the present step, which has this stamp [ns]."""
        self.measure(stamp_ns)

    def measure(self, stamp_ns: int) -> None:
        """The same, without a motion."""
        simulation, one = self._simulation, self._one
        steps = simulation.steps
        if self._waiting and steps < self._waiting[-1][0] - one.late:
            self._waiting.clear()
        if steps < self._measured:
            self.look_again()
        if steps % one.every == 0 and steps != self._measured:
            self._measured = steps
            if not one.late:
                super().publish(stamp_ns, simulation.measured(one))
                return
            self._waiting.append((steps + one.late, stamp_ns, simulation.measured(one)))
        while self._waiting and self._waiting[0][0] <= steps:
            due, then_ns, values = self._waiting.popleft()
            if due == steps:  # else nobody listened then
                super().publish(then_ns, values)


class FramesChannel(Channel):
    """The publisher of frames that do not move, once and for all."""

    def __init__(
        self, node: Node, scene: Scene, made: Sequence[Instrument], changed: Callable[[], None], space: str = ""
    ):
        from tf2_msgs.msg import TFMessage  # there, or the output tf has been refused

        message = TFMessage(transforms=sensor_outputs.frames(made, scene, space))
        output = Output("/tf_static", message, (), lambda _: (), stamp="transforms.0.header.stamp")
        super().__init__(node, output, True, changed, space)
        self._is_sent = False

    def publish(self, stamp_ns: int, motion: Any) -> None:
        """Send them, the first time."""
        if not self._is_sent:
            super().publish(stamp_ns, motion)
        self._is_sent = True


def _pass_by(
    heard: Callable[[], Sequence[SensorChannel]],
    advance: Callable[[int], None],
    stamp_ns: Callable[[], int],
    n: int,
) -> None:
    """n steps by way of those at which sensors that are ``heard`` have something to do."""
    while n > 0 and (channels := heard()):
        part = n
        for channel in channels:
            part = min(part, channel.left())
        advance(part)
        n -= part
        now_ns = stamp_ns()
        for channel in channels:
            channel.measure(now_ns)
    if n > 0:
        advance(n)


class Outputs:
    """All the outputs of a simulation that its scene asks for; what nobody listens to is neither built nor sent.

    ``heard``: whether anybody listens to anything, or records it. ``space`` is a namespace for their topics.

    Raises ValueError for an output that cannot be made here.
    """

    def __init__(self, node: Node, scene: Scene, simulation: Simulation, space: str = ""):
        self._simulation = simulation
        asked = {*ALWAYS, *scene["outputs"]}
        entries = [_within(space, make(scene, simulation)) for kind, make in KINDS.items() if kind in asked]
        now = Motion(simulation)
        for entry in entries:
            entry.values(now)  # compiles what it needs now, not at the first listener
        self._wanted: list[Channel] = []
        made, changed = list(simulation.instruments.values()), self._look_who_is_wanted
        self.channels = [Channel(node, entry, scene["lockstep"], changed, space) for entry in entries]
        sensing = [SensorChannel(node, scene, simulation, one, changed, space) for one in made]
        self.channels[:0] = sensing  # before the clock
        if made and "tf" in asked:
            self.channels.append(FramesChannel(node, scene, made, changed, space))
        for one in made:
            simulation.measured(one)  # compiles what it needs now
        self._look_who_is_wanted()

    def count_listeners(self) -> None:
        """Look who listens. Later the executor tells, by events."""
        for channel in self.channels:
            channel.count_listeners()

    def _look_who_is_wanted(self) -> None:
        self._wanted = [channel for channel in self.channels if channel.wanted]
        self.sensors = [channel for channel in self._wanted if isinstance(channel, SensorChannel)]
        self.heard = bool(self._wanted)

    def passing(self, advance: Callable[[int], None], stamp_ns: Callable[[], int]) -> Callable[[int], None]:
        """``advance``, which takes so many steps; where there are sensors one that publishes them on the way, too.

        ``stamp_ns`` says the time [ns] in stamps of the present step. It is asked for anew after each reset.
        """
        if not self._simulation.instruments:
            return advance
        self.look_again()
        return partial(_pass_by, lambda: self.sensors, advance, stamp_ns)

    def look_again(self) -> None:
        """The present step is measured again where it is published next."""
        for channel in self.channels:
            if isinstance(channel, SensorChannel):
                channel.look_again()

    def tick(self, stamp_ns: int) -> None:
        """Send the clock alone."""
        for channel in self._wanted:
            if not channel.output.fields:
                channel.publish(stamp_ns, Motion(self._simulation))

    def publish(self, stamp_ns: int) -> None:
        """Send the present motion to everybody who listens, all with the same stamp [ns]."""
        if self._wanted:
            motion = Motion(self._simulation)
            for channel in self._wanted:
                channel.publish(stamp_ns, motion)


class FleetOutputs:
    """The outputs of several bodies, by their names; as Outputs. A body that has ``stopped`` sends nothing more."""

    def __init__(self, outputs: Mapping[str, Outputs], stopped: Collection[str]):
        self._outputs, self._stopped = outputs, stopped

    @property
    def channels(self) -> list[Channel]:
        """Those of all bodies."""
        return [channel for one in self._outputs.values() for channel in one.channels]

    @property
    def heard(self) -> bool:
        """Whether anybody listens to anything of any body, or records it."""
        return any(one.heard for one in self._outputs.values())

    def passing(self, advance: Callable[[int], None], stamp_ns: Callable[[], int]) -> Callable[[int], None]:
        """As of Outputs, for the sensors of all bodies."""
        if all(one.passing(advance, stamp_ns) is advance for one in self._outputs.values()):
            return advance
        return partial(_pass_by, self._heard_sensors, advance, stamp_ns)

    def _heard_sensors(self) -> list[SensorChannel]:
        going = (one for name, one in self._outputs.items() if name not in self._stopped)
        return [channel for one in going for channel in one.sensors]

    def count_listeners(self) -> None:
        """Look who listens."""
        for one in self._outputs.values():
            one.count_listeners()

    def tick(self, stamp_ns: int) -> None:
        """Send the clock alone."""
        for one in self._outputs.values():
            one.tick(stamp_ns)

    def publish(self, stamp_ns: int) -> None:
        """Send the present motions to everybody who listens, all with the same stamp [ns]."""
        for name, one in self._outputs.items():
            if name not in self._stopped:
                one.publish(stamp_ns)
