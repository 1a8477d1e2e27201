"""A flow that is told by a topic: it carries the body along, is recorded, and repeats to the bit."""

import math

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("rosbags")

from geometry_msgs.msg import Vector3Stamped

from rigid_body_sim.tools import resim

from . import bag

pytestmark = pytest.mark.ros

RATE, MASS, DRAG, ADDED = 100.0, 2.0, 4.0, 3.0
FLOW = np.array((0.5, -1.0, 0.25))
SCENE = {
    "rate": RATE,
    "publish_rate": 0.0,
    "body.mass": MASS,
    "body.added_mass": [ADDED, ADDED, ADDED, 0.0, 0.0, 0.0],
    "drag.linear": [DRAG, DRAG, DRAG],
    "fluid.velocity": [0.0, 0.0, 0.0],
    "integrator.rtol": 1e-12,
}


def flow(velocity, frame_id="world"):
    message = Vector3Stamped()
    message.header.frame_id = frame_id
    message.vector.x, message.vector.y, message.vector.z = map(float, velocity)
    return message


@pytest.fixture(scope="module")
def node(connect_shared):
    return connect_shared(SCENE).ready()


@pytest.fixture(scope="module")
def told(node):
    return node.publisher("fluid_velocity", Vector3Stamped)


def still(node, told):
    """At rest, in a fluid at rest."""
    told.publish(flow((0.0, 0.0, 0.0)))
    node.wait(lambda: stays(node), "a body that stays at rest")


def stays(node):
    """After a reset, which may come before the message."""
    node.fresh()
    node.wait(lambda: len(node.twists) > 5, "twists")
    return velocity(node) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("frame_id", ["world", ""])
def test_body_is_carried_along(node, told, frame_id):
    """v = u (1 − e^(−c t / (m + A))), from the step on that follows the message; measured 4e-16."""
    still(node, told)
    told.publish(flow(FLOW, frame_id))
    track = node.collect_motion(100)
    times = np.arange(100) / RATE
    expected = -np.expm1(-DRAG / (MASS + ADDED) * times)[:, None] * FLOW
    assert track.linear == pytest.approx(expected, rel=0, abs=1e-13)


def test_it_stays_while_other_parameters_are_set(node, told):
    """The parameter fluid.velocity is zero all the while."""
    still(node, told)
    told.publish(flow(FLOW))
    assert node.set_parameter("gravity", [0.0, 0.0, 0.0]).successful
    node.collect_motion(2)
    assert node.set_parameter("drag.linear", [400.0] * 3).successful
    node.wait(lambda: math.dist(velocity(node), FLOW) < 1e-6, "a body as fast as the fluid")
    assert node.set_parameter("drag.linear", [DRAG] * 3).successful


def velocity(node):
    linear = node.twists[-1].twist.linear
    return linear.x, linear.y, linear.z


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (flow((math.nan, 0.0, 0.0)), "not finite"),
        (flow((0.0, math.inf, 0.0)), "not finite"),
        (flow(FLOW, "base_link"), "unknown frame"),
    ],
)
def test_what_cannot_be_is_refused_and_counted(node, told, message, reason):
    still(node, told)
    key = f"refused: {reason}"
    before = int(node.report()[1][key])
    told.publish(message)
    node.wait_report(lambda _, values: int(values[key]) == before + 1, "the refusal")
    assert velocity(node) == (0.0, 0.0, 0.0)


def test_no_topic_where_nothing_is_said_of_a_fluid(connect):
    remote = connect({"rate": RATE}).ready()
    assert remote.subscriptions_to("set_pose") and not remote.subscriptions_to("fluid_velocity")


def test_run_in_a_flow_repeats_to_the_bit(connect, tmp_path, capfd):
    """By the journal, and by rigid_body_resim, which reads it."""
    folder = tmp_path / "bag"
    remote = connect({**SCENE, "initial.angular_velocity": [0.3, 1.0, 0.2], "record.path": str(folder)}).ready()
    told = remote.publisher("fluid_velocity", Vector3Stamped)
    for i in range(20):
        told.publish(flow((math.sin(i), 0.1 * i, -0.3)))
        remote.clear()
        remote.collect(3)
    told.publish(flow((math.nan, 0.0, 0.0)))
    assert remote.set_parameter("fluid.velocity", [0.1, 0.2, 0.3]).successful
    remote.clear()
    remote.collect(20)
    remote.process.assert_stopped_cleanly()
    recorded = bag.read(folder, remote.name.removesuffix("/rigid_body_node"))
    assert len(recorded.messages["/fluid_velocity"]) == 21
    assert recorded.calls().count("change") == 21
    assert recorded.assert_repeats() > 100
    assert resim.main([str(folder), "--compare"]) == resim.SAME
    assert "Equal to the bit" in capfd.readouterr().out


def test_run_in_gusts_repeats_to_the_bit(connect, tmp_path, capfd):
    """A flow that comes to rest would carry none past: that is refused. Another velocity keeps the gusts going."""
    folder = tmp_path / "bag"
    scene = {**SCENE, "fluid.velocity": [5.0, 0.0, 0.0], "fluid.gust.intensity": 1.0, "fluid.gust.seed": 3}
    remote = connect({**scene, "record.path": str(folder)}).ready()
    told = remote.publisher("fluid_velocity", Vector3Stamped)
    told.publish(flow((0.0, 0.0, 0.0)))
    remote.wait_report(lambda _, values: values["refused: no flow"] == "1", "the refusal")
    told.publish(flow((4.0, 1.0, 0.0)))
    remote.call("reset")
    remote.clear()
    remote.collect(30)
    remote.process.assert_stopped_cleanly()
    recorded = bag.read(folder, remote.name.removesuffix("/rigid_body_node"))
    assert recorded.calls().count("change") == 1
    assert recorded.assert_repeats() > 60
    assert resim.main([str(folder), "--compare"]) == resim.SAME
    assert "Equal to the bit" in capfd.readouterr().out
