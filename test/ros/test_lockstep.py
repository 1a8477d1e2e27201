"""Lockstep: each command advances the simulation and is answered by one pose, the same on every run, to the bit."""

import hashlib
import struct

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rigid_body_sim import Scene, Simulation, Wrench
from rigid_body_sim.tools.control import pointing_law

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
DIGEST = "1069b2712d50ff815abf9d1d871174d883e1124fbadb57bab3c764885e5c5be4"


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
    send_and_wait_for_its_arrival(remote)
    assert remote.call("step").message.startswith("step 16,")
    assert stamp_ns(remote.poses[-1]) == 32_000_000
    assert remote.pause(False).message == "lockstep"
    remote.send("base_link")
    remote.wait(lambda: stamp_ns(remote.poses[-1]) == 42_000_000, "the next command's pose")


def send_and_wait_for_its_arrival(remote):
    """The latest command before it was taken some steps ago."""
    remote.send("base_link", torque=(0.0, 0.0, 1.0))
    remote.wait_arrived("wrench")


def test_command_that_came_while_paused_is_answered_when_it_goes_on(nodes):
    """Whoever has sent it waits for the answer and sends no other: both would wait for ever."""
    remote = nodes[0]
    closed_loop(remote, 3)
    remote.pause(True)
    assert remote.call("step").message.startswith("step 16,")
    send_and_wait_for_its_arrival(remote)
    remote.settle()
    assert stamp_ns(remote.poses[-1]) == 32_000_000
    assert remote.pause(False).message == "lockstep"
    remote.wait(lambda: stamp_ns(remote.poses[-1]) == 42_000_000, "the answer")
    for paused in (True, False):  # it was answered
        remote.pause(paused)
    remote.settle()
    assert stamp_ns(remote.poses[-1]) == 42_000_000


def test_who_joins_late_gets_the_present_state(nodes):
    """Else a controller would have to send a command before it knows anything."""
    from geometry_msgs.msg import PoseStamped

    remote = nodes[0]
    closed_loop(remote, 3)
    late = remote.listen_late(PoseStamped, "pose")
    latest = stamp_ns(remote.poses[-1])
    remote.wait(lambda: late and stamp_ns(late[-1]) == latest, "the latest pose")


# With the controller of this package ----------------------------------------------------------------------------------

CONTROLLER = "rigid_body_sim.tools.pointing_controller"
SATELLITE = {
    "rate": 100.0,
    "publish_rate": 0.0,
    "lockstep": True,
    "body": {"mass": 12.0, "inertia": [0.143956, 0.185168, 0.061212, 0.0, 0.0, 0.0]},
    "initial": {"orientation": {"w": 0.5, "x": 0.5, "y": 0.5, "z": 0.5}, "angular_velocity": [0.1, -0.07, 0.09]},
}


def pointed(steps):
    """Attitudes (w, x, y, z) of the satellite, answered at every step, without ROS."""
    simulation = Simulation.from_scene(Scene(SATELLITE))
    law = pointing_law((1.0, 0.0, 0.0, 0.0), SATELLITE["body"]["inertia"], 1.5, 1.0, 0.05)
    for _ in range(steps + 1):
        yield simulation.pose[3:7]
        torque = law.torque(simulation.pose[3:7], simulation.motion[16:19]).tolist()
        simulation.set_wrench(Wrench(force_body=(0.0, 0.0, 0.0), torque_body=torque), 0.5)
        simulation.step()


@pytest.mark.parametrize("first", ["node", "controller"])
def test_controller_and_node_wait_for_each_other_no_longer(run_node, first):
    """Whichever starts first, also after a kill of the controller; the motion is that without ROS, to the bit."""
    from .remote import Remote

    namespace = f"/{first}_first"
    arguments = ["-r", f"__ns:={namespace}"]
    start = {
        "node": lambda: run_node(SATELLITE, arguments=arguments),  # no long queues: of what is kept the latest alone
        "controller": lambda: run_node(None, module=CONTROLLER, arguments=arguments),
    }
    made = {first: start.pop(first)()}
    made[first].wait_ready()
    made |= {name: begin() for name, begin in start.items()}
    remote = Remote(made["node"], namespace)
    try:
        remote.wait(lambda: len(remote.poses) > 300, "300 steps")
        made["controller"].kill()
        remote.drain()
        stopped_at = stamp_ns(remote.poses[-1])
        again = run_node(None, module=CONTROLLER, arguments=arguments)
        remote.wait(lambda: stamp_ns(remote.poses[-1]) > stopped_at + 10**9, "100 more steps")
        again.assert_stopped_cleanly()
        remote.drain()
        got = {round(stamp_ns(m) / 1e7): m.pose.orientation for m in remote.poses}
        expected = list(pointed(max(got)))
        assert all((q.w, q.x, q.y, q.z) == expected[k] for k, q in got.items())
        made["node"].assert_stopped_cleanly()
    finally:
        remote.close()


def test_what_lockstep_waits_for_is_told(connect):
    """There is somebody on both sides, and neither says a word: told once a wait, after 5 s."""
    remote = connect(SATELLITE).ready()
    topic = remote.name.replace("rigid_body_node", "wrench")
    text = f"waiting for a command: in lockstep each message on {topic} advances the time"

    def told():
        return (remote.process.stdout + remote.process.stderr).count(text)

    remote.wait(told, "the warning")
    remote.send("base_link")
    remote.wait(lambda: told() == 2, "the next one")
    reports = len(remote.reports)
    remote.wait(lambda: len(remote.reports) > reports + 1, "two more reports")
    assert told() == 2
