"""Who else is on the node's topics: what keeps commands from arriving, and what mixes messages, told in the log, once.

The network is asked in the report, once a second, and never in the loop.
"""

import itertools
from collections import deque
from collections.abc import Iterable, Iterator
from functools import partial

from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import QoSCompatibility, qos_check_compatible
from rclpy.subscription import Subscription
from rclpy.task import Future
from rclpy.topic_endpoint_info import TopicEndpointInfo

from .messages import type_name
from .plant import Plant

PATIENCE = 5  # looks without a command in lockstep, one a second
UNKNOWN = "_NODE_NAME_UNKNOWN_"  # what the middleware says until it has heard whose a publisher is
MOST_TOPICS = 40  # at one look, each of which costs up to 0.1 ms
SHARED = ("tf", "tf_static", "marker")  # outputs to which others may add without mixing them


class Neighbours:
    """Of a node that simulates ``plant``. Of many topics some are looked at each time, all of few."""

    def __init__(self, node: Node, plant: Plant):
        self._node, self._plant, self._loop = node, plant, plant.loop
        self._warn = node.get_logger().warning
        outputs = plant.outputs.channels
        self._inputs = {each.end.topic_name: each.end for each in plant.inputs}
        self._mixed = {each.end.topic_name for each in outputs if each.output.topic.rpartition("/")[2] not in SHARED}
        self._tf = next((each.end.topic_name for each in outputs if each.output.topic == "/tf"), None)
        self._leads = [each.end.topic_name for part in plant.parts for each in part.inputs.leading]
        self._outputs = {each.end.topic_name: each.end for each in outputs}
        self._topics = deque([*self._inputs, *self._outputs])
        self._told: set[tuple[str, ...]] = set()
        self._asked: dict[str, Client] = {}  # clients, by the names of nodes that publish on /tf
        self._namesakes = 0
        self._waited, self._still = 0, (-1, False)
        self._refused_before = 0

    def look(self) -> None:
        """Ask the network, and tell what is new."""
        self._tell_namesakes()
        for topic in itertools.islice(self._topics, MOST_TOPICS):
            self._look_at(topic)
        self._topics.rotate(-MOST_TOPICS)
        if self._tf is not None:
            self._ask_frames(self._tf)
        self._tell_wait()

    def _look_at(self, topic: str) -> None:
        if topic in self._inputs:
            end = self._inputs[topic]
            self._tell_lost(topic, end, type_name(end.msg_type))
        if topic in self._outputs:
            self._tell_deaf(topic, type_name(self._outputs[topic].msg_type))
        if topic in self._mixed:
            self._tell_who_mixes(topic)

    def _refused(self) -> int:
        return sum(part.inputs.refused.total() for part in self._plant.parts)

    def _once(self, key: tuple[str, ...], text: str) -> None:
        if key not in self._told:
            self._told.add(key)
            self._warn(text)

    def _others(self, ends: Iterable[TopicEndpointInfo]) -> Iterator[tuple[str, TopicEndpointInfo]]:
        """Those of ``ends`` that are other nodes', and their full names; those not known yet at a later look."""
        own = self._node.get_fully_qualified_name()
        for end in ends:
            name = f"{end.node_namespace.rstrip('/')}/{end.node_name}"
            if name != own and end.node_name != UNKNOWN:
                yield name, end

    def _publishers(self, topic: str) -> Iterator[tuple[str, TopicEndpointInfo]]:
        return self._others(self._node.get_publishers_info_by_topic(topic))

    def _tell_namesakes(self) -> None:
        """A node of the same name gets the same commands, and mixes what both publish."""
        own = self._node.get_name(), self._node.get_namespace()
        others = self._node.get_node_names_and_namespaces().count(own) - 1
        if others > self._namesakes:
            self._warn(
                f"another node has the name {self._node.get_fully_qualified_name()}: it takes the same commands and "
                "publishes on the same topics; give each a name or a namespace of its own (-r __ns:=/second)"
            )
        self._namesakes = others

    def _tell_lost(self, topic: str, own: Subscription, kind: str) -> None:
        """A message of another type, or with a QoS that does not fit, reaches nobody.

        Fast DDS has no two types on one topic, so that it cannot be taken.
        """
        for name, end in self._publishers(topic):
            fits, why = qos_check_compatible(end.qos_profile, own.qos_profile)
            if end.topic_type == kind and fits == QoSCompatibility.ERROR:
                reason = why.removeprefix("ERROR: ").strip("; ").lower()
                self._once(
                    (topic, name, reason),
                    f"{name} publishes on {topic} with a QoS that does not fit ({reason}): nothing of it arrives; "
                    f"change it there, or here by qos_overrides.{topic}.subscription.*",
                )
            if end.topic_type != kind:
                self._once(
                    (topic, name, end.topic_type),
                    f"{name} publishes {end.topic_type} on {topic}, where this node takes {kind}: nothing of it "
                    f"arrives; publish {kind} there{_plain_wrench(end.topic_type)}",
                )

    def _tell_deaf(self, topic: str, kind: str) -> None:
        """Who listens for messages of another type hears nothing, and is told nothing."""
        for name, end in self._others(self._node.get_subscriptions_info_by_topic(topic)):
            if end.topic_type != kind:
                self._once(
                    (topic, name, end.topic_type),
                    f"{name} subscribes to {topic} as {end.topic_type}, where this node publishes {kind}: nothing of "
                    f"it arrives; subscribe to {kind} there",
                )

    def _tell_who_mixes(self, topic: str) -> None:
        what = "whoever listens there gets both mixed; give each node a namespace of its own (-r __ns:=/second)"
        if topic == "/clock":
            what = (
                "time goes back and forth for whoever follows it; leave clock out of the outputs of all nodes but one"
            )
        for name, _ in self._publishers(topic):
            self._once((topic, name), f"{name} publishes on {topic}, too: {what}")

    def _ask_frames(self, topic: str) -> None:
        """Two bodies of one name in the tree of frames jump back and forth; the messages do not tell who sent them."""
        for name, _ in self._publishers(topic):
            client = self._asked.get(name)
            if client is None:
                client = self._asked[name] = self._node.create_client(GetParameters, f"{name}/get_parameters")
            if client.service_is_ready() and (name, "asked") not in self._told:
                self._told.add((name, "asked"))
                answer = client.call_async(GetParameters.Request(names=["body.frame_id"]))
                answer.add_done_callback(partial(self._compare_frame, name))

    def _compare_frame(self, name: str, answer: Future) -> None:
        mine = {part.scene["body.frame_id"] for part in self._plant.parts}
        for own in mine.intersection(value.string_value for value in answer.result().values):
            self._once(
                (name, "/tf"),
                f"{name} sends the frame {own} on /tf, too: it jumps between two bodies; give each a "
                "body.frame_id of its own",
            )

    def _tell_wait(self) -> None:
        """In lockstep, both sides may wait for each other, each without a word."""
        is_asked = self._loop.mode == "lockstep" and any(e.get_subscription_count() for e in self._outputs.values())
        senders = sum(map(self._node.count_publishers, self._leads)) if is_asked else 0
        still = self._loop.simulation.steps, senders > 0
        self._waited, self._still = self._waited + 1 if is_asked and still == self._still else 0, still
        if not self._waited:
            self._refused_before = self._refused()
        if self._waited != PATIENCE:
            return
        where = " or ".join(self._leads)
        begin = f"waiting for a command: in lockstep each message on {where} advances the time, and"
        if senders and not any(self._inputs[lead].get_publisher_count() for lead in self._leads):
            self._warn(f"{begin} no message of its {senders} publishers can arrive: see the warnings about them")
        elif senders and self._refused() > self._refused_before:
            self._warn(f"{begin} what came in the last {PATIENCE} s was refused: see the warnings about that")
        elif senders:
            self._warn(
                f"{begin} none of its {senders} publishers has sent one for {PATIENCE} s; the state to answer is kept "
                "for subscriptions with the durability TRANSIENT_LOCAL, all others begin with a command"
            )
        else:
            self._once(("nobody", where), f"{begin} nobody publishes there{self._elsewhere(self._leads[0])}")

    def _elsewhere(self, lead: str) -> str:
        """Where there are commands under the same name in other namespaces, and what would be right."""
        last, kind = lead.rpartition("/")[2], type_name(self._inputs[lead].msg_type)
        for topic, kinds in self._node.get_topic_names_and_types():
            like = topic != lead and topic.rpartition("/")[2] == last and kind in kinds
            if like and self._node.count_publishers(topic):
                return f", but on {topic}; give the publisher this node's namespace, or -r {last}:={lead}"
        return ""


def _plain_wrench(kind: str) -> str:
    """What it means without a header."""
    if kind != "geometry_msgs/msg/Wrench":
        return ""
    return ", whose empty frame_id means what the parameter wrench.frame says"
