"""Wrenches from several topics, and limits: sums and ends to the step, lengths of what is limited."""

import math

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

RATE, MASS = 100.0, 2.0
GUSTS = "/outside/gusts"  # absolute: the name of its QoS override is known before the node's namespace
SCENE = {
    "rate": RATE,
    "publish_rate": 0.0,
    "start_paused": True,
    "wrench.topics": ["rotors", GUSTS],
    "wrench.timeout": 0.05,
    "wrench.frame": "world",
    "outputs": ["wrench_applied"],
    "body.mass": MASS,
    "body.inertia": [0.2, 0.2, 0.2, 0.0, 0.0, 0.0],
    "frames.arm.position": [2.0, 0.0, 0.0],
    f"qos_overrides.{GUSTS}.subscription.reliability": "best_effort",
}


@pytest.fixture(scope="module")
def started(connect_shared):
    from geometry_msgs.msg import WrenchStamped

    remote = connect_shared(SCENE).ready()
    remote.applied = remote.listen(WrenchStamped, "wrench_applied")
    remote.reset_until_heard(remote.applied)
    return remote


@pytest.fixture
def node(started):
    assert started.set_together({"wrench.max_force": 0.0, "wrench.max_torque": 0.0}).successful
    started.fresh()
    return started


def steps(node, count):
    """Track of ``count`` steps."""
    node.clear()
    for _ in range(count):
        assert node.call("step").success
    return node.collect(count)


def applied(node):
    """Force and torque that the body feels after one more step: about its origin, body axes, as published."""
    node.settle()
    node.applied.clear()
    node.call("step")
    node.wait(lambda: node.applied, "wrench_applied")
    f, t = node.applied[-1].wrench.force, node.applied[-1].wrench.torque
    return np.array([f.x, f.y, f.z, t.x, t.y, t.z])


def send(node, topic="rotors", **wrench):
    node.send(wrench.pop("frame", "base_link"), topic=topic, **wrench)
    return node.wait_arrived(topic)


def test_sources_add_up_and_each_ends_at_its_own_step(node):
    """Five steps each, the second two steps later: velocities are sums of ramps."""
    send(node, force=(2.0, 0.0, 0.0))
    early = steps(node, 2)
    send(node, GUSTS, force=(0.0, 4.0, 0.0))
    late = steps(node, 8)
    velocity = np.concatenate([early.linear, late.linear])
    n = np.arange(1, 11)
    expected = np.stack([2.0 * np.clip(n, 0, 5), 4.0 * np.clip(n - 2, 0, 5), 0.0 * n], axis=1) / (RATE * MASS)
    assert velocity == pytest.approx(expected, rel=1e-15, abs=1e-17)  # measured 0


def test_command_replaces_that_of_its_own_source_only(node):
    send(node, force=(2.0, 0.0, 0.0))
    send(node, GUSTS, force=(0.0, 4.0, 0.0), torque=(0.0, 0.0, 0.0))
    assert applied(node).tolist() == [2.0, 4.0, 0.0, 0.0, 0.0, 0.0]
    send(node, force=(0.0, 0.0, 6.0))
    assert applied(node).tolist() == [0.0, 4.0, 6.0, 0.0, 0.0, 0.0]


def test_clear_wrench_clears_all(node):
    for topic in ("rotors", GUSTS):
        send(node, topic, force=(2.0, 0.0, 0.0))
    assert node.call("clear_wrench").success
    assert not applied(node).any()
    assert not steps(node, 3).linear.any()


def test_age_is_told_for_each(node):
    send(node, force=(2.0, 0.0, 0.0))
    steps(node, 3)
    _, values = node.report()
    assert (values["rotors age [s]"], values[f"{GUSTS} age [s]"]) == ("0.030000", "none yet")
    node.call("reset")
    assert node.report()[1]["rotors age [s]"] == "none yet"


def test_sum_that_no_float_holds_is_refused_and_what_is_held_stays(node):
    before = int(node.report()[1]["refused: not finite"])
    send(node, force=(1e308, 0.0, 0.0), frame="world")
    node.send("world", force=(1e308, 0.0, 0.0), topic=GUSTS)
    _, values = node.wait_report(lambda _, v: int(v["refused: not finite"]) == before + 1, "the refusal")
    assert values[f"{GUSTS} age [s]"] == "none yet" and values["refused: not for this integrator"] == "0"
    assert "add up to more than a float holds; give smaller ones" in node.process.stderr


def test_quality_of_service_of_each_can_be_overridden(node):
    from rclpy.qos import ReliabilityPolicy

    namespace = node.name.rpartition("/")[0]
    for topic, expected in ((f"{namespace}/rotors", "RELIABLE"), (GUSTS, "BEST_EFFORT")):
        (info,) = node.subscriptions_to(topic)
        assert info.qos_profile.reliability == ReliabilityPolicy[expected]


# Limits ---------------------------------------------------------------------------------------------------------------


def test_limits_keep_the_direction_of_force_and_torque_and_are_counted(node):
    node.set_together({"wrench.max_force": 10.0, "wrench.max_torque": 0.5})
    before = int(send(node, force=(3.0, 4.0, 0.0))["commands limited"])
    assert applied(node).tolist() == [3.0, 4.0, 0.0, 0.0, 0.0, 0.0]
    values = send(node, force=(30.0, 40.0, 0.0), torque=(0.0, 0.3, -0.4))
    assert int(values["commands limited"]) == before + 1
    assert applied(node) == pytest.approx([6.0, 8.0, 0.0, 0.0, 0.3, -0.4], rel=1e-15)  # measured 0
    values = send(node, force=(1e308, -1e308, 1e308), torque=(0.0, 3e307, 4e307))
    assert int(values["commands limited"]) == before + 2
    expected = [*np.array([10.0, -10.0, 10.0]) / math.sqrt(3.0), 0.0, 0.3, 0.4]
    assert applied(node) == pytest.approx(expected, rel=1e-15)  # measured 1.9e-16


def test_limit_set_while_running_acts_on_the_next_command_and_leaves_what_is_held(node):
    send(node, force=(8.0, 0.0, 0.0))
    assert node.set_parameter("wrench.max_force", 2.0).successful
    assert applied(node)[0] == 8.0
    send(node, force=(8.0, 0.0, 0.0))
    assert applied(node)[0] == 2.0
    node.set_parameter("wrench.max_force", 0.0)
    send(node, force=(8.0, 0.0, 0.0))
    assert applied(node)[0] == 8.0


def test_limits_are_of_what_was_sent_not_of_its_moment_nor_of_the_sum(node):
    """A force of 3 N at 2 m is 6 N m about the origin; two sources may each send the most."""
    node.set_together({"wrench.max_force": 3.0, "wrench.max_torque": 1.0})
    send(node, force=(0.0, 5.0, 0.0), torque=(0.0, 0.0, 9.0), frame="arm")
    assert applied(node).tolist() == [0.0, 3.0, 0.0, 0.0, 0.0, 7.0]
    send(node, GUSTS, force=(0.0, 5.0, 0.0))
    assert applied(node).tolist() == [0.0, 6.0, 0.0, 0.0, 0.0, 7.0]


def test_impulses_have_no_limit(node):
    node.set_parameter("wrench.max_force", 3.0)
    node.send("world", force=(8.0, 0.0, 0.0), topic="impulse")
    node.wait_report(lambda _, values: values["momentum [kg m/s]"] == "[8.0, 0.0, 0.0]", "the blow")


# A quadrotor ----------------------------------------------------------------------------------------------------------

ROTORS = ("rotor_front", "rotor_left", "rotor_back", "rotor_right")
HUBS = ((0.17, 0.0, 0.01), (0.0, 0.17, 0.01), (-0.17, 0.0, 0.01), (0.0, -0.17, 0.01))
QUADROTOR = {
    "rate": 1000.0,
    "publish_rate": 200.0,
    "wrench.topics": [*ROTORS, "wrench"],
    "wrench.timeout": 0.0,
    "start_paused": True,
    "body": {"mass": 0.716, "inertia": [0.0075, 0.0075, 0.013, 0.0, 0.0, 0.0]},
    "frames": {rotor: {"position": list(hub)} for rotor, hub in zip(ROTORS, HUBS, strict=True)},
    "gravity": [0.0, 0.0, -9.80665],
    "initial.position": [0.0, 0.0, 2.0],
}


def test_four_rotors_have_a_topic_each_and_on_one_topic_they_are_warned_about(connect):
    """Hover thrust on all four keeps it where it is. In turn on one topic each replaces the one before."""
    remote = connect(QUADROTOR).ready()
    thrust = (0.0, 0.0, 0.716 * 9.80665 / 4.0)
    for rotor in ROTORS:
        remote.send(rotor, force=thrust, topic=rotor)
    remote.wait_report(lambda _, values: all(values[f"{r} age [s]"] != "none yet" for r in ROTORS), "four commands")
    for _ in range(20):
        assert remote.call("step").success
    remote.wait(lambda: remote.poses[-1].header.stamp != remote.poses[0].header.stamp, "a step's pose")
    assert remote.poses[-1].pose.position.z == pytest.approx(2.0, abs=1e-14)  # measured 0
    assert remote.poses[-1].pose.orientation.w == 1.0
    for rotor in (*ROTORS, *ROTORS):
        remote.send(rotor, force=thrust, topic="wrench")
    text = "come in turn in the frames rotor_front, rotor_left, rotor_back, rotor_right: each replaces the one before"
    remote.wait(lambda: text in remote.process.stderr + remote.process.stdout, "the warning")
    remote.call("step")
    assert (remote.process.stderr + remote.process.stdout).count("come in turn in the frames") == 1
