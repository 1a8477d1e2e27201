"""Pose and twist set from outside: those of the body frame's origin, for a turned, spinning body with an offset."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from rigid_body_sim import Scene, Simulation

from . import remote
from .analysis import matrices

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
inputs = pytest.importorskip("rigid_body_sim.ros.inputs")

RATE, MASS = 100.0, 2.0
COM = np.array([0.3, -0.2, 0.1])
SPIN = np.array([0.4, -0.3, 1.2])
SCENE = {
    "rate": RATE,
    "publish_rate": 0.0,
    "start_paused": True,
    "wrench.timeout": 0.0,
    "wrench.frame": "world",
    "body.mass": MASS,
    "body.inertia": [0.2, 0.3, 0.4, 0.01, -0.02, 0.03],
    "body.center_of_mass": COM.tolist(),
    "initial.position": [1.0, 2.0, 3.0],
    "initial.orientation": {"w": 0.9, "x": 0.1, "y": -0.3, "z": 0.2},
    "initial.linear_velocity": [0.5, -1.0, 0.25],
    "initial.angular_velocity": SPIN.tolist(),
}
SCENE_IN_USE = Scene(SCENE)
PLACE = np.array([-4.0, 5.0, 0.5])
Q = np.array([0.5, -0.5, 0.1, 0.7])  # of length 1
LINEAR, ANGULAR = np.array([0.7, -0.1, 0.2]), np.array([-1.0, 0.5, 2.0])
TOO_MUCH = 1e10  # N m: 10⁶ rad in one step


@pytest.fixture(scope="module")
def nodes(connect_shared):
    started = {axes: connect_shared({**SCENE, "twist_frame": axes}) for axes in ("body", "world")}
    return {axes: node.ready() for axes, node in started.items()}


@pytest.fixture
def node(nodes):
    return at_start(nodes["body"])


def at_start(node):
    """Paused at the initial state, which is the one message that is kept."""
    node.pause(True)
    node.settle()
    node.clear()
    node.call("reset")
    node.collect(1)
    return node


def shown_next(node):
    """The one state that is published without a step being taken."""
    node.wait(lambda: len(node.poses) > 1 and len(node.twists) > 1, "the state that was set")
    node.settle()
    track = node.track()
    assert len(track.stamp_ns) == 2 and track.stamp_ns[0] == track.stamp_ns[1], "time went on"
    return track


def steps(node, count):
    node.clear()
    for _ in range(count):
        assert node.call("step").success
    return node.collect(count)


def in_world(track, vectors):
    """Rows in body axes, as ``twist`` has them here, in world axes."""
    return np.einsum("nij,nj->ni", matrices(track.orientation), vectors)


def middle(track):
    """Position and velocity of the centre of mass, world axes."""
    offset = np.tile(COM, (len(track.stamp_ns), 1))
    velocity = track.linear + np.cross(track.angular, offset)
    return track.position + in_world(track, offset), in_world(track, velocity)


@pytest.mark.parametrize("length", [1.0, 2.0, 1e-3])
@pytest.mark.parametrize("frame_id", ["world", "/world", ""])
def test_pose_is_that_of_the_origin_and_velocities_in_the_world_stay(node, frame_id, length):
    """Shown at once while paused, at the same time; a quaternion of any length is taken."""
    node.send_pose(frame_id, PLACE, length * Q)
    track = shown_next(node)
    assert track.position[1] == pytest.approx(PLACE, rel=0, abs=1e-15)  # measured 1.7e-16
    assert track.orientation[1] == pytest.approx(Q, rel=0, abs=1e-15)  # measured 2.2e-16
    for vectors in (track.linear, track.angular):
        before, after = in_world(track, vectors)
        assert after == pytest.approx(before, rel=0, abs=1e-14)  # measured 1.8e-15


TWISTS = {  # what is published in body axes, from the matrix body → world
    "base_link": lambda _: (LINEAR, ANGULAR),
    "world": lambda R: (R.T @ LINEAR, R.T @ ANGULAR),
}


@pytest.mark.parametrize("frame_id", TWISTS)
def test_twist_is_that_of_the_origin_in_the_axes_of_its_frame_and_the_pose_stays(node, frame_id):
    node.send_twist(frame_id, LINEAR, ANGULAR)
    track = shown_next(node)
    linear, angular = TWISTS[frame_id](matrices(track.orientation)[0])
    assert track.linear[1] == pytest.approx(linear, rel=0, abs=2e-15)  # measured 1.9e-16
    assert track.angular[1] == pytest.approx(angular, rel=0, abs=5e-15)  # measured 8.9e-16
    assert track.position[1] == pytest.approx(track.position[0], rel=0, abs=2e-15)  # measured 4.4e-16
    assert track.orientation[1] == pytest.approx(track.orientation[0], rel=0, abs=4e-16)  # measured 5.6e-17


@pytest.mark.parametrize("axes", ["body", "world"])
def test_twist_without_a_frame_is_in_the_axes_of_the_topic_twist(nodes, axes):
    """So what the node publishes can be sent back to it."""
    node = at_start(nodes[axes])
    node.send_twist("", LINEAR, ANGULAR)
    track = shown_next(node)
    assert track.linear[1] == pytest.approx(LINEAR, rel=0, abs=2e-15)  # measured 1.9e-16
    assert track.angular[1] == pytest.approx(ANGULAR, rel=0, abs=5e-15)  # measured 8.9e-16


def test_motion_goes_on_from_what_was_set_under_the_wrench_that_is_held(node):
    """The centre of mass goes along the parabola of F/m from where pose and twist put it; time does not jump."""
    force = np.array([0.0, 3.0, -1.0])
    node.send("world", force=force)
    node.wait_arrived("wrench")
    first = steps(node, 10).stamp_ns[-1]
    node.send_pose("world", PLACE, Q)
    node.collect(11)
    node.send_twist("world", LINEAR, ANGULAR)
    node.collect(12)
    node.settle()
    x, v = (rows[-1] for rows in middle(node.track()))
    R = matrices(Q[None])[0]
    assert x == pytest.approx(PLACE + R @ COM, rel=0, abs=2e-15)  # measured 1.1e-16
    assert v == pytest.approx(LINEAR + np.cross(ANGULAR, R @ COM), rel=0, abs=5e-15)  # measured 8.2e-16
    track = steps(node, 20)
    assert track.stamp_ns[0] == first + 10_000_000
    t = np.arange(1, 21)[:, None] / RATE
    position, velocity = middle(track)
    assert velocity == pytest.approx(v + t * force / MASS, rel=0, abs=1e-14)  # measured 1.0e-15
    assert position == pytest.approx(x + t * v + t * t * force / MASS / 2.0, rel=0, abs=1e-14)  # measured 8.9e-16


def test_state_is_set_between_two_steps_of_a_running_node(node):
    """Not a step is lost, and the body is there from one message to the next."""
    node.pause(False)
    node.collect(10)
    node.send_pose("world", PLACE + 100.0, Q)
    node.wait(lambda: node.poses[-1].pose.position.x > 50.0, "the pose")
    track = node.collect(len(node.poses) + 5)
    assert set(np.diff(track.stamp_ns[1:]).tolist()) == {10_000_000}
    jump = np.linalg.norm(np.diff(track.position, axis=0), axis=1) > 50.0
    assert jump.sum() == 1


# Refusals -------------------------------------------------------------------------------------------------------------

NAN, INF = math.nan, math.inf
ZERO = (0.0, 0.0, 0.0)
BAD_POSES = [  # frame, position, quaternion, reason and sentence
    ("base_link", ZERO, Q, "unknown frame", "set_pose in frame 'base_link' refused: send it in world, or leave frame"),
    ("map", ZERO, Q, "unknown frame", "set_pose in frame"),
    ("world", (0.0, NAN, 0.0), Q, "not finite", "set_pose refused: position"),
    ("world", (0.0, INF, 0.0), Q, "not finite", "set_pose refused: "),
    ("world", ZERO, (0.0,) * 4, "not a rotation", "set_pose refused: "),
    ("world", ZERO, (1.0, NAN, 0.0, 0.0), "not a rotation", "set_pose refused: "),
    ("world", ZERO, (INF, 0.0, 0.0, 0.0), "not a rotation", "set_pose refused: "),
]
BAD_TWISTS = [
    ("map", ZERO, ZERO, "unknown frame", "set_twist in frame 'map' refused: send it in base_link or world, or leave"),
    ("world", (NAN, 0.0, 0.0), ZERO, "not finite", "set_twist refused: "),
    ("base_link", (NAN, 0.0, 0.0), ZERO, "not finite", "set_twist refused: "),
    ("base_link", ZERO, (0.0, INF, 0.0), "not finite", "set_twist refused: "),
    ("base_link", (1.7e308, 1.7e308, 0.0), ZERO, "not finite", "set_twist refused: "),
    ("world", ZERO, (0.0, 1.7e308, 0.0), "not finite", "set_twist refused: "),
]


def refusals(values):
    return {key.removeprefix("refused: "): int(values[key]) for key in values if key.startswith("refused: ")}


def wait_refusals(node, before, expected):
    """Until exactly these have been counted, by reason."""
    count = sum(before.values()) + sum(expected.values())
    _, values = node.wait_report(lambda _, v: sum(refusals(v).values()) >= count, "the refusals")
    assert {reason: n - before[reason] for reason, n in refusals(values).items() if n > before[reason]} == expected


@pytest.mark.parametrize(
    ("send", "bad"), [("send_pose", BAD_POSES), ("send_twist", BAD_TWISTS)], ids=["set_pose", "set_twist"]
)
def test_bad_state_is_refused_counted_and_changes_nothing(node, send, bad):
    before = refusals(node.report()[1])
    for frame_id, *values, _, _ in bad:
        getattr(node, send)(frame_id, *values)
    reasons = [reason for *_, reason, _ in bad]
    wait_refusals(node, before, {reason: reasons.count(reason) for reason in reasons})
    assert len(node.poses) == len(node.twists) == 1, "a state was published"
    track = steps(node, 1)
    position, velocity = middle(track)
    start = np.array(SCENE["initial.position"]) + R_START @ COM
    speed = np.array(SCENE["initial.linear_velocity"]) + R_START @ np.cross(SPIN, COM)
    assert velocity[0] == pytest.approx(speed, rel=0, abs=2e-15)  # measured 1.1e-16
    assert position[0] == pytest.approx(start + speed / RATE, rel=0, abs=2e-15)  # measured 2.2e-16


Q_START = np.array([*SCENE["initial.orientation"].values()])
R_START = matrices(Q_START[None] / np.linalg.norm(Q_START))[0]


class Ears:
    """What of a node the inputs use: callbacks by topic, and the warnings."""

    subscriptions = publishers = ()

    def __init__(self):
        self.callbacks, self.warnings = {}, []

    def create_subscription(self, kind, topic, callback, queue, **_):
        self.callbacks[topic] = callback

    def get_logger(self):
        return SimpleNamespace(warning=self.warnings.append)

    def resolve_topic_name(self, topic):
        return topic


BAD = [("set_pose", *bad) for bad in BAD_POSES] + [("set_twist", *bad) for bad in BAD_TWISTS]


@pytest.mark.parametrize(("topic", "frame_id", "first", "second", "reason", "sentence"), BAD)
def test_refusal_is_a_sentence(topic, frame_id, first, second, reason, sentence):
    """Without another process: the node logs each reason at most once in five seconds."""
    from rclpy.serialization import serialize_message

    ears, simulation = Ears(), Simulation.from_scene(SCENE_IN_USE)
    heard = inputs.Inputs(ears, SCENE_IN_USE, SimpleNamespace(failure="", simulation=simulation), set())
    before = simulation.save()
    make = remote.pose_message if topic == "set_pose" else remote.twist_message
    ears.callbacks[topic](serialize_message(make(frame_id, first, second)))
    assert {name: n for name, n in heard.refused.items() if n} == {reason: 1}
    (warning,) = ears.warnings
    assert sentence in warning
    assert simulation.save() == before


@pytest.mark.parametrize("topic", ["set_pose", "set_twist"])
def test_bytes_that_are_no_state_are_refused(node, topic):
    before = refusals(node.report()[1])
    for data in (
        b"\x00\x01\x00\x00" + bytes(40),
        b"\xff" * 76,
        b"\x00\x01" + bytes(10) + b"\xff\xff\xff\x7f" + bytes(60),
    ):
        node.send_bytes(data, topic)
    wait_refusals(node, before, {"malformed": 3})
    assert len(node.poses) == len(node.twists) == 1, "a state was published"


def test_state_is_refused_after_a_step_that_could_not_be_done(node):
    node.send("base_link", torque=(0.0, 0.0, TOO_MUCH))
    node.wait_arrived("wrench")
    assert "cannot be done" in node.call("step").message
    node.settle()
    node.clear()
    before = refusals(node.report()[1])
    node.send_pose("world", PLACE, Q)
    node.send_twist("world", LINEAR, ANGULAR)
    node.send("world", force=(1.0, 0.0, 0.0), topic="impulse")
    wait_refusals(node, before, {"stopped": 3})
    assert not node.poses, "a state was published"
    assert "refused: the simulation has stopped; ~/reset starts afresh" in node.process.stderr
    at_start(node)
    node.send_pose("world", PLACE, Q)
    assert shown_next(node).position[1] == pytest.approx(PLACE, rel=0, abs=1e-15)  # measured 1.7e-16
