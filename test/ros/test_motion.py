"""A node at 300 Hz that publishes every third step and lets a command act for 0.2 s: motion in closed form, stamps."""

import numpy as np
import pytest

from .analysis import angle_about_z

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

MASS, IZZ, RATE, TIMEOUT = 2.5, 0.4, 300, 0.2
HELD = 60  # steps in TIMEOUT


@pytest.fixture(scope="module")
def node(connect_shared):
    return connect_shared(
        {
            "rate": RATE,
            "publish_rate": 100,
            "body.mass": MASS,
            "body.inertia": [0.2, 0.3, IZZ, 0.0, 0.0, 0.0],
            "wrench.timeout": TIMEOUT,
        }
    ).ready()


def steps_held(values, one_step):
    """Steps during which a wrench acted, from the velocity that each gives; they must be whole."""
    steps = values / one_step
    assert steps == pytest.approx(np.round(steps), abs=1e-9)  # measured 1.4e-14
    return np.round(steps).astype(int)


def assert_held_then_free(steps):
    """Counts three steps a message up to the timeout, then no more."""
    first = steps[1]
    assert steps[0] == 0 and 1 <= first <= 3
    assert steps.tolist() == [0, *(min(first + 3 * i, HELD) for i in range(len(steps) - 1))]
    assert steps[-1] == steps[-5] == HELD


def test_force_gives_parabola_then_straight_line(node):
    """x = F t²/2m while the command acts, constant velocity F·timeout/m after the timeout."""
    node.fresh()
    force = np.array([3.0, -1.0, 2.0])
    node.send("world", force=force)
    track = node.collect_motion(32)
    steps = steps_held(track.linear[:, 0], force[0] / (MASS * RATE))
    assert_held_then_free(steps)
    held = steps / RATE
    free = steps[1] / RATE + 0.01 * np.arange(-1, len(steps) - 1) - held
    free[0] = 0.0
    expected = np.outer(held**2 / 2 + held * free, force) / MASS
    assert track.position == pytest.approx(expected, rel=1e-12, abs=0.0)  # measured 3.6e-16
    assert track.linear == pytest.approx(np.outer(held, force) / MASS, rel=1e-12, abs=0.0)  # measured 2.5e-16
    after = track.linear[steps == HELD]
    assert np.ptp(after, axis=0).tolist() == [0.0, 0.0, 0.0]
    assert after[0] == pytest.approx(force * TIMEOUT / MASS, rel=1e-12, abs=0.0)  # measured 2.3e-16
    assert not track.angular.any() and (track.orientation == [1.0, 0.0, 0.0, 0.0]).all()


def test_torque_about_principal_axis_gives_quadratic_angle(node):
    """θ = τ t²/2I while the command acts, then constant spin."""
    node.fresh()
    torque = 20.0
    node.send("base_link", torque=(0.0, 0.0, torque))
    track = node.collect_motion(32)
    steps = steps_held(track.angular[:, 2], torque / (IZZ * RATE))
    assert_held_then_free(steps)
    held = steps / RATE
    free = np.append(0.0, steps[1] / RATE + 0.01 * np.arange(len(steps) - 1) - held[1:])
    expected = (held**2 / 2 + held * free) * torque / IZZ
    assert angle_about_z(track.orientation) == pytest.approx(expected, rel=1e-12, abs=0.0)
    assert track.angular[:, 2] == pytest.approx(held * torque / IZZ, rel=1e-12, abs=0.0)
    assert not track.position.any() and not track.linear.any()


def test_stamps_follow_the_rate_exactly(node):
    """Every third step of 300 Hz: 10 ms, no gap, no repeat, over more than a second; pose and twist alike."""
    node.clear()
    track = node.collect(130)
    assert np.diff(track.stamp_ns).tolist() == [10_000_000] * 129


def test_headers_name_frames(node):
    node.clear()
    node.collect(1)
    assert node.poses[0].header.frame_id == "world"
    assert node.twists[0].header.frame_id == "base_link"


def test_clear_wrench_stops_the_push(node):
    node.fresh()
    node.send("world", force=(3.0, 0.0, 0.0))
    node.wait(lambda: node.twists and node.twists[-1].twist.linear.x > 0.0, "motion")
    answer = node.call("clear_wrench")
    assert answer.success and answer.message == "no wrench held"
    node.drain()
    node.clear()
    track = node.collect(5)
    assert np.ptp(track.linear, axis=0).tolist() == [0.0, 0.0, 0.0]
    assert 0.0 < track.linear[0, 0] < 3.0 * TIMEOUT / MASS


def test_new_command_begins_the_timeout_anew(node):
    """Commands that follow each other within the timeout act without a gap, up to the timeout of the last."""
    node.fresh()
    count = 6
    for _ in range(count):
        node.send("world", force=(3.0, 0.0, 0.0))
        arrived = len(node.poses)
        node.wait(lambda arrived=arrived: len(node.poses) >= arrived + 5, "50 ms of messages")
    track = node.collect_motion(30)
    steps = steps_held(track.linear[:, 0], 3.0 / (MASS * RATE))
    assert np.diff(steps)[1:25].tolist() == [3] * 24  # 0.25 s: longer than one timeout
