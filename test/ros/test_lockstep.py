"""Lockstep: each command advances the simulation and is answered by one pose, the same on every run, to the bit."""

import hashlib
import struct

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Scene, Simulation, Wrench

from .remote import stamp_ns

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

SCENE = {
    "lockstep": True,
    "steps_per_command": 5,
    "reset_time": True,
    "rate": 500.0,
    "publish_rate": 50.0,
    "wrench.timeout": 0.1,
    "wrench.topics": ["wrench", "gust"],
    "body.mass": 2.0,
    "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0],
    "initial.orientation": {"w": 0.4, "x": 0.2, "y": -0.8, "z": 0.4},
    "initial.angular_velocity": [1.1, -2.0, 0.7],
    "gravity": [0.0, 0.0, -9.80665],
}
ROUNDS = 250
PERIOD_NS = 10_000_000
# Of the poses and twists of all rounds. Sums, products, quotients and roots decide them, which IEEE 754 fixes.
DIGEST = "8b86d465ae4c376284b0c415b58aa738c33b1dd206296a00ff798f169bf2363a"


def command(q, w_body):
    """Force and torque (body axes) of a controller that stops the spin and turns the body upright."""
    sign = 1.0 if q[0] >= 0.0 else -1.0
    torque = [-6.0 * sign * q[i + 1] - 1.5 * w_body[i] for i in range(3)]
    return (0.0, 0.0, 2.0 * 9.80665), torque


def digest(rows):
    return hashlib.sha256(b"".join(struct.pack(f"<{len(row)}d", *row) for row in rows)).hexdigest()


@pytest.fixture(scope="module")
def nodes(connect_shared):
    return [remote.ready() for remote in (connect_shared(SCENE), connect_shared(SCENE))]


def closed_loop(remote, rounds=ROUNDS):
    """Stamps, and positions, quaternions and twists, of a controller in the loop from the initial state on."""
    remote.call("reset")
    remote.settle()
    remote.poses.clear()
    remote.twists.clear()
    force, torque = command([*SCENE["initial.orientation"].values()], SCENE["initial.angular_velocity"])
    for answered in range(1, rounds + 1):
        remote.send("base_link", force, torque)
        track = remote.collect(answered)
        assert len(track.stamp_ns) == answered
        force, torque = command(track.orientation[-1].tolist(), track.angular[-1].tolist())
    remote.settle()
    assert len(remote.poses) == rounds, "more poses than commands"
    return track.stamp_ns, np.hstack((track.position, track.orientation, track.linear, track.angular))


def offline(rounds=ROUNDS):
    """The same without ROS."""
    sim = Simulation.from_scene(Scene(SCENE))
    rows, q, w = [], [*SCENE["initial.orientation"].values()], SCENE["initial.angular_velocity"]
    for _ in range(rounds):
        force, torque = command(q, w)
        sim.set_wrench(Wrench(force_body=force, torque_body=torque), SCENE["wrench.timeout"])
        sim.step(SCENE["steps_per_command"])
        motion = sim.motion
        rows.append((*motion[0:7], *motion[13:19]))
        q, w = motion[3:7], motion[16:19]
    return np.array(rows)


def test_two_runs_are_equal_to_the_bit_and_equal_to_one_without_ros(nodes):
    runs = [closed_loop(remote) for remote in nodes]
    for stamps, rows in runs:
        assert_array_equal(stamps, PERIOD_NS * np.arange(1, ROUNDS + 1))
        assert_array_equal(rows, offline())


@pytest.mark.no_numba
def test_digest_of_the_run_is_what_it_was():
    assert digest(offline().tolist()) == DIGEST


def test_controller_has_done_its_work():
    """So that what is compared above is a motion worth comparing."""
    end = offline()[-1]
    assert abs(end[3]) > 0.99 and np.linalg.norm(end[10:13]) < 0.05  # measured 1 - 1.3e-6 and 0.0079


def test_no_time_passes_without_a_command(nodes):
    remote = nodes[0]
    closed_loop(remote, 3)
    for _ in range(2):  # a second and more of wall time
        status, values = remote.report()
        assert (status.message, values["mode"]) == ("lockstep", "lockstep")
        assert values["steps"] == str(3 * SCENE["steps_per_command"])
    assert len(remote.poses) == 3


def test_command_on_another_topic_is_held_and_advances_nothing(nodes):
    remote = nodes[0]
    closed_loop(remote, 3)
    gust = remote.publisher("gust")
    remote.send("world", force=(40.0, 0.0, 0.0), through=gust)
    remote.wait_report(lambda _, values: values["gust age [s]"] != "none yet", "the gust")
    assert len(remote.poses) == 3
    before = remote.track().linear[-1]
    remote.send("world", force=(0.0, 0.0, 2.0 * 9.80665))
    track = remote.collect(4)
    assert np.linalg.norm(track.linear[-1] - before) == pytest.approx(0.2, abs=0.02)  # 40 N on 2 kg for 10 ms


def test_refused_command_advances_nothing(nodes):
    remote = nodes[0]
    closed_loop(remote, 3)
    remote.send("base_link", force=(float("nan"), 0.0, 0.0))
    remote.wait_report(lambda _, values: values["refused: not finite"] != "0", "the refusal")
    assert len(remote.poses) == 3
    remote.send("base_link")
    assert len(remote.collect(4).stamp_ns) == 4


def test_paused_lockstep_takes_steps_from_the_service_only(nodes):
    remote = nodes[0]
    closed_loop(remote, 3)
    remote.pause(True)
    remote.send("base_link")
    assert remote.call("step").message.startswith("step 16,")
    assert stamp_ns(remote.poses[-1]) == 32_000_000
    assert remote.pause(False).message == "lockstep"
    remote.send("base_link")
    remote.wait(lambda: stamp_ns(remote.poses[-1]) == 42_000_000, "the next command's pose")


def test_who_joins_late_gets_the_present_state(nodes):
    """Else a controller would have to send a command before it knows anything."""
    from geometry_msgs.msg import PoseStamped

    remote = nodes[0]
    closed_loop(remote, 3)
    late = remote.listen_late(PoseStamped, "pose")
    latest = stamp_ns(remote.poses[-1])
    remote.wait(lambda: late and stamp_ns(late[-1]) == latest, "the latest pose")
