"""What is told of other nodes: commands that cannot arrive, and outputs that two nodes mix."""

import time
from types import SimpleNamespace

import pytest

from rigid_body_sim import Scene

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros


@pytest.fixture
def node_of_others(context):
    """A function: a node in this process, in a participant of its own."""
    from rclpy.node import Node

    made = []

    def make(name, namespace, **parameters):
        made.append(Node(name, namespace=namespace, context=context, enable_rosout=False))
        for key, value in parameters.items():
            made[-1].declare_parameter(key.replace("__", "."), value)
        return made[-1]

    yield make
    for node in made:
        node.destroy_node()


def test_who_keeps_commands_from_arriving_or_mixes_outputs_is_told_once(connect, node_of_others):
    from geometry_msgs.msg import PoseStamped, Twist, Wrench, WrenchStamped
    from rclpy.qos import qos_profile_sensor_data
    from rosgraph_msgs.msg import Clock

    remote = connect({"outputs": ["clock"], "start_paused": True}).ready()
    namespace = remote.name.removesuffix("/rigid_body_node")
    other = node_of_others("tool", namespace)
    ends = [
        (Wrench, "wrench"),
        (Twist, "set_twist"),
        (PoseStamped, "pose"),
        (Clock, "/clock"),
        (PoseStamped, "set_pose"),
    ]
    publishers = [other.create_publisher(kind, topic, 1) for kind, topic in ends]
    publishers.append(other.create_publisher(WrenchStamped, "impulse", qos_profile_sensor_data))
    deaf = other.create_subscription(Twist, "twist", print, 1)
    texts = [
        f"{namespace}/tool publishes geometry_msgs/msg/Wrench on {namespace}/wrench, where this node takes "
        "geometry_msgs/msg/WrenchStamped: nothing of it arrives; publish geometry_msgs/msg/WrenchStamped there, whose",
        f"{namespace}/tool publishes geometry_msgs/msg/Twist on {namespace}/set_twist, where this node takes geometry",
        f"{namespace}/tool publishes on {namespace}/pose, too: whoever listens there gets both mixed",
        f"{namespace}/tool publishes on /clock, too: time goes back and forth",
        f"{namespace}/tool publishes on {namespace}/impulse with a QoS that does not fit (best effort publisher and "
        f"reliable subscription): nothing of it arrives; change it there, or here by qos_overrides.{namespace}/impulse",
        f"{namespace}/tool subscribes to {namespace}/twist as geometry_msgs/msg/Twist, where this node publishes geo",
    ]

    def said():
        log = remote.process.stdout + remote.process.stderr
        return [log.count(text) for text in texts], log.count("/tool publishes") + log.count("/tool subscribes")

    remote.wait(lambda: all(said()[0]), "all warnings")
    for _ in range(2):
        remote.report()
    assert said() == ([1] * 6, 6)
    assert len(publishers) == 6 and deaf.topic_name == f"{namespace}/twist"


def plant(loop, inputs=(), outputs=(), refused=lambda: 0):
    """What a node simulates, as far as its neighbours matter to it."""
    own = SimpleNamespace(leading=inputs, refused=SimpleNamespace(total=refused))
    part = SimpleNamespace(scene=Scene(), inputs=own)
    channels = SimpleNamespace(channels=outputs)
    return SimpleNamespace(loop=loop, inputs=inputs, outputs=channels, parts=(part,))


@pytest.mark.parametrize(("frame", "expected"), [("base_link", 1), ("other_link", 0), (None, 0)])
def test_two_bodies_of_one_frame_on_tf_are_told(node_of_others, frame, expected):
    """With another type on /tf: tf2_msgs is not on PyPI, and who publishes there counts, not what."""
    from geometry_msgs.msg import TransformStamped
    from rclpy.executors import SingleThreadedExecutor

    from rigid_body_sim.ros.neighbours import Neighbours

    own, other = node_of_others("own", f"/tf_{frame}"), node_of_others("second", f"/tf_{frame}")
    if frame is not None:
        other.declare_parameter("body.frame_id", frame)
    publisher = other.create_publisher(TransformStamped, f"/tf_{frame}/tf", 1)
    end = SimpleNamespace(topic_name=publisher.topic_name, msg_type=TransformStamped, get_subscription_count=lambda: 0)
    loop = SimpleNamespace(mode="running", simulation=SimpleNamespace(steps=0))
    neighbours = Neighbours(own, plant(loop, outputs=[SimpleNamespace(end=end, output=SimpleNamespace(topic="/tf"))]))
    warned, asked = [], neighbours._told
    neighbours._warn = warned.append
    executor = SingleThreadedExecutor(context=own.context)
    for node in (own, other):
        executor.add_node(node)
    answered = []
    compare = neighbours._compare_frame
    neighbours._compare_frame = lambda name, answer: (compare(name, answer), answered.append(name))
    for _ in range(600):
        neighbours.look()
        executor.spin_once(timeout_sec=0.1)
        if answered:
            break
    executor.shutdown()
    assert answered == [f"/tf_{frame}/second"] and len(warned) == expected
    assert all(f"/tf_{frame}/second sends the frame base_link on /tf, too" in text for text in warned)
    assert (f"/tf_{frame}/second", "asked") in asked


def test_what_lockstep_waits_for_is_told_however_late_the_others_come(node_of_others):
    """Once a wait with somebody on both sides; that nobody publishes commands, once; while paused, nothing."""
    from geometry_msgs.msg import PoseStamped, WrenchStamped

    from rigid_body_sim.ros.neighbours import PATIENCE, Neighbours

    own, other = node_of_others("own", "/waits"), node_of_others("other", "/astray")
    loop = SimpleNamespace(mode="lockstep", simulation=SimpleNamespace(steps=0))
    listeners, topic = 0, "/waits/wrench"
    pose = SimpleNamespace(topic_name="/waits/pose", msg_type=PoseStamped, get_subscription_count=lambda: listeners)
    connected, refused = 1, 0
    lead = SimpleNamespace(topic_name=topic, msg_type=WrenchStamped, get_publisher_count=lambda: connected)
    wrench = SimpleNamespace(end=lead)
    outputs = [SimpleNamespace(end=pose, output=SimpleNamespace(topic="pose"))]
    neighbours = Neighbours(own, plant(loop, [wrench], outputs, lambda: refused))
    warned = []
    neighbours._warn = warned.append

    def said(looks=3 * PATIENCE):
        warned.clear()
        for _ in range(looks):
            neighbours._tell_wait()
        return [text.split(" advances the time, and ")[1].split(";")[0] for text in warned]

    def publish_on(name):
        end = other.create_publisher(WrenchStamped, name, 1)
        deadline = time.monotonic() + 60.0
        while not own.count_publishers(end.topic_name):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        return end

    astray = publish_on("wrench")
    assert said() == []
    listeners = 1
    assert (said(), said()) == (["nobody publishes there, but on /astray/wrench"], [])
    end = publish_on(topic)
    waits = f"none of its 1 publishers has sent one for {PATIENCE} s"
    assert (said(PATIENCE), said(1), said()) == ([], [waits], [])
    loop.simulation.steps += 1
    assert said() == [waits]
    loop.simulation.steps += 1
    assert said(2) == []
    refused = 3
    assert said() == [f"what came in the last {PATIENCE} s was refused: see the warnings about that"]
    loop.simulation.steps, connected = 9, 0
    assert said() == ["no message of its 1 publishers can arrive: see the warnings about them"]
    loop.mode = "paused"
    assert said() == []
    assert (astray.topic_name, end.topic_name) == ("/astray/wrench", topic)


def test_publisher_is_told_of_once_its_node_is_known(node_of_others):
    """Its topics may be heard of before its name is: then one warning would have no name, and a second would follow."""
    from geometry_msgs.msg import PoseStamped

    from rigid_body_sim.ros.neighbours import Neighbours

    own, kind = node_of_others("own", "/late"), "geometry_msgs/msg/PoseStamped"
    end = SimpleNamespace(topic_name="/late/pose", msg_type=PoseStamped, get_subscription_count=lambda: 0)
    loop = SimpleNamespace(mode="running", simulation=SimpleNamespace(steps=0))
    neighbours = Neighbours(own, plant(loop, outputs=[SimpleNamespace(end=end, output=SimpleNamespace(topic="pose"))]))
    warned = []
    neighbours._warn = warned.append
    heard = SimpleNamespace(node_namespace="_NODE_NAMESPACE_UNKNOWN_", node_name="_NODE_NAME_UNKNOWN_", topic_type=kind)
    own.get_publishers_info_by_topic = lambda _: [heard]
    neighbours.look()
    assert warned == []
    heard.node_namespace, heard.node_name = "/late", "second"
    for _ in range(2):
        neighbours.look()
    assert len(warned) == 1 and warned[0].startswith("/late/second publishes on /late/pose, too: ")
