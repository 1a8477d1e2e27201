"""Blows: one message on ``impulse`` changes the motion once, by J/m, and what is held goes on."""

import math

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

MASS, IZZ = 2.0, 0.4
COM = np.array([0.1, -0.05, 0.0])
HOOK = np.array([0.25, 0.15, 0.0])
ANGLE = 0.7
SCENE = {
    "rate": 200.0,
    "publish_rate": 0.0,
    "wrench.timeout": 0.5,
    "body.mass": MASS,
    "body.inertia": [0.2, 0.3, IZZ, 0.0, 0.0, 0.0],
    "body.center_of_mass": COM.tolist(),
    "initial.rpy": [0.0, 0.0, ANGLE],
    "frames.hook.position": HOOK.tolist(),
    "frames.hook.axes": "world",
}
TURN = np.array([[math.cos(ANGLE), -math.sin(ANGLE), 0], [math.sin(ANGLE), math.cos(ANGLE), 0], [0, 0, 1]])
J, MOMENT = np.array([3.0, 4.0, 0.0]), 0.6

CASES = {  # frame, and axes and point of the force: where from the centre of mass, world axes at the start
    "base_link": (TURN @ J, TURN @ -COM),
    "world": (J, np.zeros(3)),
    "hook": (J, TURN @ (HOOK - COM)),
}


@pytest.fixture(scope="module")
def node(connect_shared):
    return connect_shared(SCENE).ready()


@pytest.mark.parametrize(("frame_id", "blow"), CASES.items(), ids=CASES)
def test_twist_jumps_by_what_the_blow_gives_and_stays(node, frame_id, blow):
    """The momentum keeps its direction in the world while the body turns; its origin goes round the centre of mass."""
    node.fresh()
    node.send(frame_id, J, (0.0, 0.0, MOMENT), topic="impulse")
    track = node.collect_motion(40)
    impulse, arm = blow
    spin = (MOMENT + np.cross(arm, impulse)[2]) / IZZ
    assert not track.linear[0].any() and not track.angular[0].any()
    assert track.angular[1:] == pytest.approx(np.tile((0.0, 0.0, spin), (39, 1)), rel=0, abs=1e-13)  # measured 3.3e-16
    v_body = [_back(ANGLE + spin * (k + 1) / 200.0) @ impulse / MASS for k in range(39)]
    expected = np.array(v_body) - np.cross((0.0, 0.0, spin), COM)
    assert track.linear[1:] == pytest.approx(expected, rel=0, abs=1e-12)  # measured 8.9e-16


def _back(angle):
    """Components in axes turned about z by ``angle``."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def test_held_wrench_and_its_timeout_go_on(node):
    """A force held for 0.5 s gives all of its momentum, with a blow on the way."""
    node.fresh()
    node.send("world", (2.0, 0.0, 0.0))
    node.wait(lambda: len(node.twists) > 20, "some motion")
    node.send("world", (0.0, 3.0, 0.0), topic="impulse")
    track = node.collect_motion(150)  # the wrench ends after 100
    spin, velocity = track.angular[-1], track.linear[-1]
    assert not spin.any()
    assert TURN @ velocity == pytest.approx((2.0 * 0.5 / MASS, 3.0 / MASS, 0.0), rel=0, abs=1e-13)  # measured 1.1e-16


def test_bad_blows_are_counted_and_change_nothing(node):
    node.fresh()
    before = _refused(node.report()[1])
    for frame_id, force, torque in [
        ("base_lnik", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ("world", (math.nan, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ("hook", (0.0, math.inf, 0.0), (0.0, 0.0, 0.0)),
        ("hook", (0.0, 0.0, 0.0), (0.0, 0.0, 1.7e308)),  # finite, but not over the body's inertia
    ]:
        node.send(frame_id, force, torque, topic="impulse")
    _, values = node.wait_report(lambda _, v: sum(_refused(v).values()) >= sum(before.values()) + 4, "the refusals")
    new = {reason: n - before[reason] for reason, n in _refused(values).items()}
    assert {reason: n for reason, n in new.items() if n} == {"unknown frame": 1, "not finite": 3}
    assert not any((m.twist.linear.x, m.twist.angular.z) != (0.0, 0.0) for m in node.twists)
    assert "impulse in frame 'base_lnik' refused: send it in one of base_link, world, hook" in node.process.stderr


def _refused(values):
    return {key.removeprefix("refused: "): int(values[key]) for key in values if key.startswith("refused: ")}


def test_blow_while_paused_shows_at_the_next_step(node):
    node.fresh()
    node.pause(True)
    node.send("world", J, topic="impulse")
    node.wait_report(lambda _, values: values["momentum [kg m/s]"] == "[3.0, 4.0, 0.0]", "the blow")
    node.clear()
    node.call("step")
    track = node.collect(1)
    assert TURN @ track.linear[0] == pytest.approx(J / MASS, rel=0, abs=2e-15)  # measured 2.2e-16
    node.pause(False)
