"""What the node listens to: wrench commands of one or several sources, impulses, states set from outside, the flow."""

import dataclasses
import math
import time
from collections import Counter
from collections.abc import Callable, Set
from typing import Protocol

from geometry_msgs.msg import PoseStamped, TwistStamped, Vector3Stamped, WrenchStamped
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from .. import commands
from ..commands import NOT_FINITE, RefusedError
from ..kernels.arrays import Vector
from ..scene.loader import Scene
from ..simulation import Simulation
from ..stepping import IntegratorError
from ..values import rotation
from ..values.parameter import shown
from ..values.state import State
from ..values.wrench import three_finite
from . import actuator_inputs, messages
from .frame_turns import FrameTurns
from .messages import inside, overridable
from .wrench_reader import WrenchReader

QUEUE = 10
_OF_NO_COMMAND = PoseStamped, TwistStamped, Vector3Stamped  # which set a state, or how the fluid flows
WARN_EVERY = 5.0  # s between two warnings of the same kind


class Input:
    """One subscription, ``end``, that gives the bytes of each message to ``callback``; in the namespace ``space``."""

    def __init__(self, node: Node, kind: type, topic: str, callback: Callable[[bytes], None], space: str = ""):
        topic = inside(space, topic)
        overriding = overridable(node, space, topic)
        self._callback = callback
        self.end = node.create_subscription(
            kind, topic, lambda data: self._callback(data), QUEUE, qos_overriding_options=overriding, raw=True
        )

    def record(self, record: Callable[[bytes], None]) -> None:
        """From now on give the bytes to ``record`` first."""
        callback = self._callback

        def record_and_call(data: bytes) -> None:
            record(data)
            callback(data)

        self._callback = record_and_call


class Commanded(Protocol):
    """What inputs ask of the loop, or of what stands between it and one of several bodies."""

    @property
    def simulation(self) -> Simulation:
        """That of the body."""

    @property
    def failure(self) -> str:
        """Why the body has stopped, or nothing."""

    @property
    def waiting(self) -> bool:
        """Whether the body stays until its first command."""

    @property
    def mode(self) -> str:
        """What it does now, in a word or some."""

    @property
    def stamp_ns(self) -> int:
        """Time [ns] in the stamps of its present step."""

    def set_going(self) -> None:
        """After a command was accepted, or an impulse."""

    def on_command(self) -> None:
        """After a command that leads in lockstep."""

    def on_changed_state(self) -> None:
        """After the state was set from outside."""


class Inputs:
    """The node's subscriptions. What cannot be accepted is counted, warned about, and changes nothing.

    ``ages`` gives the simulated time since each source's latest command; ``limited`` counts wrenches scaled down.
    ``space`` is a namespace for their topics, and ``taken`` are full names of topics that the node has already.
    """

    def __init__(self, node: Node, scene: Scene, loop: Commanded, taken: Set[str], space: str = ""):
        self._scene, self._loop, self._simulation = scene, loop, loop.simulation
        self._space = space
        self._log = node.get_logger()
        self._warned: dict[str, float] = {}
        self.refused = Counter(dict.fromkeys(messages.REFUSALS, 0))
        self.limited = 0
        self._hold = scene["wrench.timeout"] or None
        actuated = actuator_inputs.topics(scene)
        self._topics = (*scene["wrench.topics"], *actuated)
        self._leads = actuator_inputs.leading(scene)
        self._steps: dict[str, int] = {}
        self._wrench_reader = WrenchReader(scene, limit=self._limit)
        self._impulse_reader = WrenchReader(scene, "impulse")
        self.set_limits(scene)
        self._ends: dict[str, Input] = {}
        self._subscribe(node, WrenchStamped, "impulse", self._on_impulse)
        self._subscribe(node, PoseStamped, "set_pose", self._on_set_pose)
        self._subscribe(node, TwistStamped, "set_twist", self._on_set_twist)
        if scene.has_given("fluid"):
            self._subscribe(node, Vector3Stamped, "fluid_velocity", self._on_fluid_velocity)
        if actuated:
            self.refused[messages.WRONG_LENGTH] = 0
        for topic, (kind, read) in actuated.items():
            self._subscribe(node, kind, topic, self._actuators_callback(topic, read))
        for topic in scene["wrench.topics"]:
            self._check_topic(node, topic, taken)
            self._subscribe(node, WrenchStamped, topic, self._wrench_callback(topic))

    def set_limits(self, scene: Scene) -> None:
        """Take ``wrench.max_force`` and ``wrench.max_torque`` from here on."""
        self._most_force, self._most_torque = (scene[f"wrench.max_{what}"] or math.inf for what in ("force", "torque"))

    @property
    def is_commanded(self) -> bool:
        """Whether there is anybody who may send the commands that lead in lockstep."""
        return any(each.end.get_publisher_count() for each in self.leading)

    @property
    def inputs(self) -> list[Input]:
        """The subscriptions themselves."""
        return list(self._ends.values())

    @property
    def leading(self) -> list[Input]:
        """Those whose commands advance the simulation in lockstep."""
        return [self._ends[topic] for topic in self._leads]

    @property
    def starters(self) -> list[str]:
        """Full names of the topics on which a message may set a body going that waits for its first command."""
        return [each.end.topic_name for each in self.inputs if each.end.msg_type not in _OF_NO_COMMAND]

    @property
    def ages(self) -> dict[str, float | None]:
        """Topic, and simulated time [s] since its latest accepted command; None when there was none."""
        now, rate = self._simulation.steps, self._simulation.rate
        return {t: (now - self._steps[t]) / rate if t in self._steps else None for t in self._topics}

    def forget(self) -> None:
        """After a reset there was no command yet."""
        self._steps.clear()

    def on_time_moved(self, steps: int) -> None:
        """After the count of steps was changed by so many."""
        self._steps = {topic: step + steps for topic, step in self._steps.items()}

    def _subscribe(self, node: Node, kind: type, topic: str, callback: Callable[[bytes], None]) -> None:
        self._ends[topic] = Input(node, kind, topic, self._guarded(callback), self._space)

    def _check_topic(self, node: Node, topic: str, taken: Set[str]) -> None:
        """Raise ValueError for one of ``wrench.topics`` that cannot be a name, or is a topic of the node already."""
        try:
            name = node.resolve_topic_name(inside(self._space, topic))
        except RuntimeError:  # RCLError, whose text names lines of C
            raise ValueError(
                f"parameter wrench.topics: {shown(topic)} cannot be the name of a topic; "
                "give letters, digits and '_', no digit first, with '/' between namespaces"
            ) from None
        own = {node.resolve_topic_name(inside(self._space, each)) for each in self._ends}
        if name in taken or name in own:
            raise ValueError(
                f"parameter wrench.topics: {shown(topic)} is {name}, which this node uses already; give each source "
                "a topic of its own"
            )

    def _wrench_callback(self, topic: str) -> Callable[[bytes], None]:
        """What to do with a wrench on ``topic``."""
        reader = self._wrench_reader
        turns = FrameTurns(self._scene, topic, self._log.warning)

        def on_wrench(data: bytes) -> None:
            wrench = reader.read(data)
            try:
                self._simulation.set_wrench(wrench, self._hold, topic)
            except IntegratorError as reason:
                raise RefusedError(messages.NOT_FOR_INTEGRATOR, str(reason)) from None
            except ValueError as reason:  # its sum with what other sources hold
                raise RefusedError(NOT_FINITE, str(reason)) from None
            turns.note(reader.frame, self._simulation.steps - self._steps.get(topic, -math.inf))
            self._on_held(topic)

        return on_wrench

    def _actuators_callback(self, topic: str, read: actuator_inputs.Reader) -> Callable[[bytes], None]:
        """What to do with a command to actuators on ``topic``."""

        def on_actuators(data: bytes) -> None:
            numbers = read(data)
            try:
                self._simulation.set_actuators(numbers, self._hold)
            except ValueError as reason:
                is_whole = len(numbers) == len(self._simulation.actuators)
                raise RefusedError(NOT_FINITE if is_whole else messages.WRONG_LENGTH, str(reason)) from None
            self._on_held(topic)

        return on_actuators

    def _on_held(self, topic: str) -> None:
        """After a command on ``topic`` was accepted, of any kind."""
        self._steps[topic] = self._simulation.steps
        self._loop.set_going()
        if topic in self._leads:
            self._loop.on_command()

    def _limit(self, force: commands.Vector, torque: commands.Vector) -> tuple[commands.Vector, commands.Vector]:
        """Both as sent, or scaled down to the limits."""
        if math.hypot(*force) <= self._most_force and math.hypot(*torque) <= self._most_torque:
            return force, torque
        self.limited += 1
        return commands.scaled_down(force, self._most_force), commands.scaled_down(torque, self._most_torque)

    def _on_impulse(self, data: bytes) -> None:
        self._need_a_running_simulation("impulse")
        impulse = self._impulse_reader.read(data)
        try:
            self._simulation.apply_impulse(impulse)
        except ValueError as reason:
            raise RefusedError(NOT_FINITE, str(reason)) from None
        self._loop.set_going()
        self._loop.on_changed_state()

    def _on_set_pose(self, data: bytes) -> None:
        """The body is put there; its velocities, in world axes, stay."""
        self._need_a_running_simulation("set_pose")
        message = messages.deserialised(data, PoseStamped, "set_pose")
        messages.check_frame("set_pose", message.header.frame_id, {self._scene["world_frame_id"]})
        p, q, now = message.pose.position, message.pose.orientation, self._simulation.state
        w_world = rotation.rotate(now.orientation, now.angular_velocity)
        with messages.refusing("set_pose", messages.NOT_A_ROTATION):
            orientation = rotation.normalize((q.w, q.x, q.y, q.z))
        with messages.refusing("set_pose"):
            state = State((p.x, p.y, p.z), orientation, now.velocity, rotation.rotate_back(orientation, w_world))
            self._simulation.set_state(state)
        self._loop.on_changed_state()

    def _on_set_twist(self, data: bytes) -> None:
        """The body's origin gets that velocity, in the axes that the header names; its pose stays."""
        self._need_a_running_simulation("set_twist")
        message = messages.deserialised(data, TwistStamped, "set_twist")
        body, world = self._scene["body.frame_id"], self._scene["world_frame_id"]
        usual = body if self._scene["twist_frame"] == "body" else world
        frame = messages.check_frame("set_twist", message.header.frame_id, {body, world}) or usual
        v, w, now = message.twist.linear, message.twist.angular, self._simulation.state
        velocity: Vector = (v.x, v.y, v.z)
        w_body: Vector = (w.x, w.y, w.z)
        with messages.refusing("set_twist"):
            if frame == body:
                velocity = rotation.rotate(now.orientation, velocity)
            else:
                w_body = rotation.rotate_back(now.orientation, w_body)
            self._simulation.set_state(State(now.position, now.orientation, velocity, w_body))
        self._loop.on_changed_state()

    def _on_fluid_velocity(self, data: bytes) -> None:
        """The fluid flows so from the next step on, until it is said again."""
        message = messages.deserialised(data, Vector3Stamped, "fluid_velocity")
        messages.check_frame("fluid_velocity", message.header.frame_id, {self._scene["world_frame_id"]})
        with messages.refusing("fluid_velocity"):
            velocity = three_finite((message.vector.x, message.vector.y, message.vector.z), "velocity")
        with messages.refusing("fluid_velocity", messages.NO_FLOW):  # where there are gusts
            self._simulation.change(fluid=dataclasses.replace(self._simulation.fluid, velocity=velocity))

    def _need_a_running_simulation(self, what: str) -> None:
        if self._loop.failure:
            raise RefusedError(messages.STOPPED, f"{what} refused: the simulation has stopped; ~/reset starts afresh")

    def _guarded(self, callback: Callable[[bytes], None]) -> Callable[[bytes], None]:
        """``callback``, with refusals counted, and logged each reason at most once in WARN_EVERY seconds."""

        def guarded(data: bytes) -> None:
            try:
                callback(data)
            except RefusedError as refusal:
                self.refused[refusal.reason] += 1
                now = time.monotonic()
                if now - self._warned.get(refusal.reason, -WARN_EVERY) >= WARN_EVERY:
                    self._warned[refusal.reason] = now
                    self._log.warning(str(refusal))

        return guarded


def topics_of(node: Node) -> set[str]:
    """Full names of the topics that a node has."""
    ends: list[Publisher | Subscription] = [*node.publishers, *node.subscriptions]
    return {end.topic_name for end in ends}
