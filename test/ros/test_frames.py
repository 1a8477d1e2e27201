"""What a wrench means in each frame, and in which axes twist comes out, on a turned body whose CoM is off its origin.

Two nodes at 300 Hz publish every step: one with the defaults, one with world for twist and for commands that name no
frame.
"""

import math

import numpy as np
import pytest

from .analysis import angle_about_z, derivative, matrices, planar_motion, spin_of, turn

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

MASS, IZZ, RATE = 2.0, 0.4, 300
COM = np.array([0.1, -0.05])
START = np.array([0.3, -0.2])
ANGLE = 0.7
THRUSTER = np.array([-0.3, 0.2])
THRUSTER_ANGLE = 0.5
HOOK = np.array([0.25, 0.15])
STEPS = 60

SCENE = {
    "rate": RATE,
    "publish_rate": 0,
    "wrench.timeout": 0,
    "body.mass": 2,  # an integer is taken for a float
    "body.inertia": [0.2, 0.3, IZZ, 0.0, 0.0, 0.0],
    "body.center_of_mass": [*COM.tolist(), 0.0],
    "initial.position": [*START.tolist(), 0.0],
    # To be normalised.
    "initial.orientation": {"w": 2 * math.cos(ANGLE / 2), "x": 0.0, "y": 0.0, "z": 2 * math.sin(ANGLE / 2)},
    "frames.thruster.position": [*THRUSTER.tolist(), 0.0],
    "frames.thruster.rpy": [0.0, 0.0, THRUSTER_ANGLE],
    "frames.hook.position": [*HOOK.tolist(), 0.0],
    "frames.hook.axes": "world",
}


@pytest.fixture(scope="module")
def nodes(connect_shared):
    started = {
        "body": connect_shared(SCENE),
        "world": connect_shared({**SCENE, "twist_frame": "world", "wrench.frame": "world"}),
    }
    return {name: remote.ready() for name, remote in started.items()}


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def in_body(force, torque):
    """Held in body axes, at the body frame's origin."""
    return lambda angle: (turn(angle) @ force, torque - cross(COM, force))


def in_thruster(force, torque):
    force = turn(THRUSTER_ANGLE) @ force
    return lambda angle: (turn(angle) @ force, torque + cross(THRUSTER - COM, force))


def in_world(force, torque):
    """Held in world axes, at the centre of mass."""
    return lambda angle: (force, torque)


def at_hook(force, torque):
    """Held in world axes, at a point of the body: the arm turns."""
    return lambda angle: (force, torque + cross(turn(angle) @ (HOOK - COM), force))


CASES = [
    ("body", "base_link", in_body),
    ("body", "/base_link", in_body),
    ("body", "", in_body),
    ("body", "world", in_world),
    ("body", "/world", in_world),
    ("body", "thruster", in_thruster),
    ("body", "hook", at_hook),
    ("world", "", in_world),
    ("world", "base_link", in_body),
    ("world", "/hook", at_hook),
]
FORCE, TORQUE = np.array([3.0, 4.0]), 0.6


def assert_planar(node, track, wrench):
    """The track is the motion from rest under ``wrench``; row 0 is the last at rest. Accuracy is the ODE solver's."""
    times = np.arange(len(track.stamp_ns)) / RATE
    angle, spin, position, velocity = planar_motion(times, ANGLE, START, COM, MASS, IZZ, wrench)
    assert angle_about_z(track.orientation) == pytest.approx(angle, rel=0.0, abs=2e-12)  # measured 1.5e-13
    assert track.angular[:, 2] == pytest.approx(spin, rel=0.0, abs=2e-12)  # measured 5e-14
    assert track.position[:, :2] == pytest.approx(position, rel=0.0, abs=2e-12)  # measured 1e-13
    if node.twists[0].header.frame_id == "base_link":
        velocity = np.array([turn(-a) @ v for a, v in zip(angle, velocity, strict=True)])
    assert track.linear[:, :2] == pytest.approx(velocity, rel=0.0, abs=2e-12)  # measured 7.8e-13


def assert_every_step(stamps):
    """Stamps are round(k · 10⁹ / 300) from some step on: thirds of 10 ms, the middle one 1 ns longer."""
    gaps = np.diff(stamps).tolist()
    pattern = [3_333_333, 3_333_334, 3_333_333]
    assert any(gaps == [pattern[(i + shift) % 3] for i in range(len(gaps))] for shift in range(3))


@pytest.mark.parametrize(("name", "frame_id", "meaning"), CASES, ids=lambda value: getattr(value, "__name__", value))
def test_wrench_in_frame(nodes, name, frame_id, meaning):
    node = nodes[name]
    node.fresh()
    node.send(frame_id, force=(*FORCE, 0.0), torque=(0.0, 0.0, TORQUE))
    track = node.collect_motion(STEPS)
    assert_every_step(track.stamp_ns)
    assert_planar(node, track, meaning(FORCE, TORQUE))


def test_body_force_through_centre_of_mass_does_not_turn(nodes):
    """Closed form: a straight line along the body's own direction, x = F t²/2m."""
    node = nodes["body"]
    node.fresh()
    node.send("base_link", force=(*(40 * COM), 0.0))
    track = node.collect_motion(STEPS)
    along = turn(ANGLE) @ COM * 40
    t = np.arange(STEPS) / RATE
    assert track.position[:, :2] - START == pytest.approx(np.outer(t * t / 2, along) / MASS, rel=1e-12, abs=1e-15)
    assert not track.angular.any()


def test_held_for_ever_and_every_step_for_a_second(nodes):
    """Timeout 0 holds; publish_rate 0 sends every step, none missing and none twice."""
    node = nodes["world"]
    node.fresh()
    node.send("world", force=(3.0, 0.0, 0.0))
    track = node.collect_motion(2 * RATE)
    assert_every_step(track.stamp_ns)
    t = np.arange(2 * RATE) / RATE
    assert track.linear[:, 0] == pytest.approx(3.0 * t / MASS, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("name", ["body", "world"])
def test_twist_is_the_derivative_of_pose(nodes, name):
    """For a body that turns about all axes; twist is that of the body frame's origin, in the axes its header names."""
    node = nodes[name]
    node.fresh()
    node.send("base_link", force=(3.0, -2.0, 5.0), torque=(1.5, -2.0, 2.5))
    track = node.collect_motion(100)
    h = 1.0 / RATE
    velocity, spin = derivative(track.position, h), spin_of(track.orientation, h)
    frame_id = "base_link" if name == "body" else "world"
    if name == "body":
        back = np.swapaxes(matrices(track.orientation), 1, 2)[4:-4]
        velocity, spin = (np.einsum("nij,nj->ni", back, vector) for vector in (velocity, spin))
    assert node.twists[0].header.frame_id == frame_id
    assert np.linalg.norm(track.angular, axis=1)[-1] > 1.0
    assert track.linear[4:-4] == pytest.approx(velocity, rel=0.0, abs=1e-12)  # measured 2.7e-14
    assert track.angular[4:-4] == pytest.approx(spin, rel=0.0, abs=1e-12)  # measured 4.9e-14


def counts(values):
    """Refused commands by reason, from the values of a report."""
    return {key.removeprefix("refused: "): int(values[key]) for key in values if key.startswith("refused: ")}


BAD = [
    ("unknown frame", "base_lnik", (9.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ("unknown frame", "//world", (9.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ("not finite", "base_link", (math.nan, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ("not finite", "world", (0.0, 0.0, 0.0), (0.0, -math.inf, 0.0)),
    ("not finite", "hook", (0.0, math.inf, 0.0), (0.0, 0.0, 0.0)),
    ("not finite", "thruster", (1.7e308, 1.7e308, 0.0), (0.0, 0.0, 0.0)),  # finite as sent, but not in body axes
]
# One too short, one of another encoding: bytes that no typed publisher sends.
MALFORMED = [b"\x00\x01\x00\x00" + bytes(40), b"\xff\xff\xff\xff" + bytes(80)]


def test_refused_commands_are_counted_and_change_nothing(nodes):
    """The wrench held before goes on acting as if nothing had been sent."""
    node = nodes["body"]
    node.fresh()
    before = counts(node.report()[1])
    assert set(before) >= {"unknown frame", "not finite", "malformed"}
    node.send("hook", force=(0.3, 0.4, 0.0))
    node.wait(lambda: len(node.poses) > 10, "some motion")
    for _, frame_id, force, torque in BAD:
        node.send(frame_id, force, torque)
    for data in MALFORMED:
        node.send_bytes(data)
    total = sum(before.values()) + len(BAD) + len(MALFORMED)
    status, values = node.wait_report(lambda _, values: sum(counts(values).values()) >= total, "all the refusals")
    after = counts(values)
    counted = {reason: after[reason] - before[reason] for reason in after if after[reason] > before[reason]}
    assert counted == {"unknown frame": 2, "not finite": 4, "malformed": 2}
    assert status.level == b"\x01" and ("refused" in status.message or "slower" in status.message)
    track = node.collect_motion(RATE)
    assert_every_step(track.stamp_ns)
    assert_planar(node, track, at_hook(np.array([0.3, 0.4]), 0.0))
    assert (
        "wrench in frame 'base_lnik' refused: send it in one of base_link, world, hook, thruster" in node.process.stderr
    )
    assert "wrench of 44 bytes refused: they are not a serialised geometry_msgs/WrenchStamped" in node.process.stderr
