"""The other side of the topics: commands a node and collects what it publishes."""

import time
from dataclasses import dataclass

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import SetBool, Trigger

from rigid_body_sim.ros.executor import executor_for

from .node_process import DEEP_QUEUE

SERVICES = {"reset": Trigger, "pause": SetBool, "step": Trigger, "clear_wrench": Trigger}
LAST_CLIENT = "get_parameters"
PARAMETER_SERVICES = {
    "set_parameters": SetParameters,
    "describe_parameters": DescribeParameters,
    "set_parameters_atomically": SetParametersAtomically,
    LAST_CLIENT: GetParameters,
}
SECONDS = 60.0  # longest wait for anything that takes milliseconds on an idle machine


@dataclass
class Track:
    """What was published, as arrays with one row a step: quaternions are w, x, y, z."""

    stamp_ns: np.ndarray
    position: np.ndarray
    orientation: np.ndarray
    linear: np.ndarray
    angular: np.ndarray


class Remote:
    """Commander and observer of one node, which takes wrenches on ``topics``.

    It has a context, so a DDS participant, of its own: one for all tests did, after some twenty nodes and one that was
    killed, not get through to the next for 20 s and more.
    """

    def __init__(self, process, namespace, topics=("wrench",)):
        self.process = process
        self.name = f"{namespace}/rigid_body_node"
        self.poses, self.twists, self.reports = [], [], []
        self._context = Context()
        rclpy.init(context=self._context)
        self._node = Node("observer", namespace=namespace, context=self._context, enable_rosout=False)
        self._executor = executor_for(self._node)
        self._node.create_subscription(PoseStamped, "pose", self.poses.append, DEEP_QUEUE)
        self._node.create_subscription(TwistStamped, "twist", self.twists.append, DEEP_QUEUE)
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)
        kinds = {
            **dict.fromkeys((*topics, "impulse"), WrenchStamped),
            "set_pose": PoseStamped,
            "set_twist": TwistStamped,
        }
        self._commands = {topic: self._node.create_publisher(kind, topic, 100) for topic, kind in kinds.items()}
        self._clients = {
            name: self._node.create_client(service, f"rigid_body_node/{name}")
            for name, service in {**SERVICES, **PARAMETER_SERVICES}.items()
        }

    def ready(self):
        """Wait until the node runs and every connection is made in both directions; returns the remote itself."""
        self.process.wait_ready()
        self.wait(lambda: all(c.service_is_ready() for c in self._clients.values()), "the services")
        for topic, publisher in self._commands.items():
            self.wait(lambda p=publisher: p.get_subscription_count() > 0, f"the subscription to {topic}")
        self._repeat(self._answers, "an answer")
        self.reset_until_heard(self.poses, self.twists)
        self._pair_up()
        return self

    def _repeat(self, attempt, what):
        deadline = time.monotonic() + SECONDS
        while not attempt():
            assert time.monotonic() < deadline, f"no {what} within {SECONDS} s: {self.process.stderr}"

    def _answers(self):
        """Answers are lost until the node knows this client. It learns of clients in order: the last stands for all."""
        future = self._clients[LAST_CLIENT].call_async(GetParameters.Request(names=["rate"]))
        self._serve_until(future.done, 1.0)
        return future.done()

    def reset_until_heard(self, *lists):
        """A node that stands still publishes at a reset only, to those whom it knows by then."""

        def attempt():
            self.call("reset")
            self._serve_until(lambda: all(lists), 0.5)
            return all(lists)

        self._repeat(attempt, "message of each kind")

    def close(self):
        self._executor.remove_node(self._node)
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def listen(self, kind, topic):
        """List that every further message on a topic is added to."""
        messages = []
        self._node.create_subscription(kind, topic, messages.append, DEEP_QUEUE)
        return messages

    def listen_late(self, kind, topic):
        """The same, and what the publisher keeps for those who join late."""
        messages = []
        profile = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._node.create_subscription(kind, topic, messages.append, profile)
        return messages

    def publisher(self, topic, kind=WrenchStamped):
        """One more publisher of commands, connected to the node."""
        publisher = self._node.create_publisher(kind, topic, 100)
        self.wait(lambda: publisher.get_subscription_count() > 0, f"the subscription to {topic}")
        return publisher

    def subscriptions_to(self, topic):
        """What the network knows of the subscriptions to a topic."""
        return self._node.get_subscriptions_info_by_topic(topic)

    # Waiting ----------------------------------------------------------------------------------------------------------

    def turn(self, seconds=0.05):
        self._executor.spin_once(timeout_sec=seconds)

    def wait(self, condition, what, seconds=SECONDS):
        """Serve callbacks until ``condition()``; the deadline is for a node that never gets there."""
        deadline = time.monotonic() + seconds
        while not condition():
            assert self.process.popen.poll() is None, f"the node ended: {self.process.stderr}"
            assert time.monotonic() < deadline, f"{what}: not within {seconds} s; {self.process.stderr}"
            self.turn()

    def _serve_until(self, condition, seconds):
        deadline = time.monotonic() + seconds
        while not condition() and time.monotonic() < deadline:
            self.turn()

    def drain(self):
        """Serve what has arrived already: ten idle turns in a row mean that there is no more.

        Of a node that runs there may always be more, on a busy machine: then it is a second's worth.
        """
        idle, deadline = 0, time.monotonic() + 1.0
        while idle < 10 and time.monotonic() < deadline:
            idle = 0 if self._hears(0.0) else idle + 1

    def settle(self, seconds=0.05):
        """Of a node that stands still: serve until no pose or twist has come for so long."""
        quiet_since = time.monotonic()
        while time.monotonic() - quiet_since < seconds:
            if self._hears(0.01):
                quiet_since = time.monotonic()

    def _hears(self, seconds):
        before = len(self.poses), len(self.twists)
        self.turn(seconds)
        return before != (len(self.poses), len(self.twists))

    # Commands ---------------------------------------------------------------------------------------------------------

    def send(self, frame_id, force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), topic="wrench", through=None):
        message = WrenchStamped()
        message.header.frame_id = frame_id
        for vector, values in ((message.wrench.force, force), (message.wrench.torque, torque)):
            vector.x, vector.y, vector.z = map(float, values)
        (through or self._commands[topic]).publish(message)

    def send_bytes(self, data, topic="wrench"):
        """Publish bytes as they are."""
        self._commands[topic].publish(data)

    def send_pose(self, frame_id, position, orientation):
        self._commands["set_pose"].publish(pose_message(frame_id, position, orientation))

    def send_twist(self, frame_id, linear, angular):
        self._commands["set_twist"].publish(twist_message(frame_id, linear, angular))

    def call(self, name, request=None):
        """Answer of a service; ``request`` defaults to an empty one."""
        client = self._clients[name]
        future = client.call_async(client.srv_type.Request() if request is None else request)
        self.wait(future.done, f"the answer of {name}")
        return future.result()

    def pause(self, paused):
        return self.call("pause", SetBool.Request(data=paused))

    def set_parameter(self, name, value):
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        (result,) = self.call("set_parameters", request).results
        return result

    def set_together(self, values):
        """Result of setting all of ``values``, by name, or none."""
        parameters = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
        return self.call("set_parameters_atomically", SetParametersAtomically.Request(parameters=parameters)).result

    def set_value_of_type(self, name, kind):
        """Send a value of type number ``kind``, and wait for no answer."""
        parameter = ParameterMessage(name=name, value=ParameterValue(type=kind))
        self._clients["set_parameters"].call_async(SetParameters.Request(parameters=[parameter]))

    def describe(self, *names):
        return self.call("describe_parameters", DescribeParameters.Request(names=list(names))).descriptors

    def get_parameters(self, *names):
        values = self.call("get_parameters", GetParameters.Request(names=list(names))).values
        return [Parameter.from_parameter_msg(_named(n, v)).value for n, v in zip(names, values, strict=True)]

    def fresh(self):
        """Reset, and forget everything published before the body was at rest at its initial pose."""
        self.clear()
        self.call("reset")
        self.wait(lambda: self.poses and self.twists and not _moves(self.twists[-1]), "a body at rest")
        self.drain()
        self._forget(min(len(self.poses), len(self.twists)) - 1)

    def clear(self):
        """Forget what was published, in pairs: a pose may be here before its twist."""
        self._pair_up()
        self._forget(min(len(self.poses), len(self.twists)))

    def _pair_up(self):
        """Drop first messages without a partner: the two subscriptions are connected at different moments."""
        while self.poses and self.twists and stamp_ns(self.poses[0]) != stamp_ns(self.twists[0]):
            del min(self.poses, self.twists, key=lambda messages: stamp_ns(messages[0]))[0]

    def _forget(self, count):
        del self.poses[:count], self.twists[:count]

    # Observations -----------------------------------------------------------------------------------------------------

    def collect(self, count):
        """Track of the next ``count`` poses and twists, whose stamps and frames must agree."""
        self.wait(lambda: min(len(self.poses), len(self.twists)) >= count, f"{count} messages")
        return self.track(count)

    def track(self, count=None):
        poses, twists = self.poses[:count], self.twists[:count]
        stamps = [stamp_ns(message) for message in poses]
        assert stamps == [stamp_ns(message) for message in twists], "pose and twist of a step differ in stamp"
        p, q = [m.pose.position for m in poses], [m.pose.orientation for m in poses]
        v, w = [m.twist.linear for m in twists], [m.twist.angular for m in twists]
        return Track(np.array(stamps), _xyz(p), np.array([(a.w, a.x, a.y, a.z) for a in q]), _xyz(v), _xyz(w))

    def collect_motion(self, count):
        """Track from the last message at rest on: row 0 is the step before a wrench took effect."""
        self.wait(lambda: any(map(_moves, self.twists)), "motion")
        first = next(i for i, message in enumerate(self.twists) if _moves(message))
        assert first > 0, "the first message was in motion already: nothing tells when it began"
        self.wait(lambda: min(len(self.poses), len(self.twists)) >= first - 1 + count, f"{count} messages in motion")
        self._forget(first - 1)
        return self.track(count)

    def report(self):
        """The next diagnostic status of the node, and its values by key."""
        self.reports.clear()
        self.wait(lambda: self.reports, "a report")
        return self.reports[0], {pair.key: pair.value for pair in self.reports[0].values}

    def wait_report(self, condition, what):
        """The first report for whose (status, values) ``condition`` holds."""
        deadline = time.monotonic() + SECONDS
        while True:
            status, values = self.report()
            if condition(status, values):
                return status, values
            assert time.monotonic() < deadline, f"{what}: last report {status}"

    def wait_arrived(self, *topics):
        """While no step is taken: until a command on each of the topics has arrived; returns the report's values."""
        ages = [f"{topic} age [s]" for topic in topics]
        return self.wait_report(lambda _, values: all(values[age] == "0.000000" for age in ages), f"{topics}")[1]

    def _on_diagnostics(self, message):
        self.reports += [status for status in message.status if status.name.startswith(f"{self.name}: ")]


def pose_message(frame_id, position, orientation):
    """``orientation`` is w, x, y, z."""
    message = PoseStamped()
    message.header.frame_id = frame_id
    p, q = message.pose.position, message.pose.orientation
    p.x, p.y, p.z = map(float, position)
    q.w, q.x, q.y, q.z = map(float, orientation)
    return message


def twist_message(frame_id, linear, angular):
    message = TwistStamped()
    message.header.frame_id = frame_id
    for vector, values in ((message.twist.linear, linear), (message.twist.angular, angular)):
        vector.x, vector.y, vector.z = map(float, values)
    return message


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def _moves(twist):
    v, w = twist.twist.linear, twist.twist.angular
    return any((v.x, v.y, v.z, w.x, w.y, w.z))


def _xyz(vectors):
    return np.array([(v.x, v.y, v.z) for v in vectors])


def _named(name, value):
    return ParameterMessage(name=name, value=value)
