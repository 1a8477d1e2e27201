"""The node's own recorder: the bytes that were sent and received, and a run that repeats to the bit."""

import itertools
import math
import os
import random
import resource
import signal
import struct

import pytest
from geometry_msgs.msg import WrenchStamped
from rclpy.serialization import serialize_message
from std_srvs.srv import SetBool

from . import bag
from .node_process import ROOT
from .remote import SECONDS, stamp_ns

pytest.importorskip("rclpy")
pytest.importorskip("rosbags")
pytestmark = pytest.mark.ros

SCENE = {
    "rate": 1000.0,
    "publish_rate": 0.0,
    "wrench.topics": ["wrench", "gust"],
    "wrench.timeout": 0.05,
    "body.mass": 2.0,
    "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0],
    "body.center_of_mass": [0.1, 0.0, 0.0],
    "initial.angular_velocity": [0.3, 1.0, 0.2],
    "gravity": [0.0, 0.0, -9.80665],
    "outputs": ["odom"],
    "reset_time": True,
}
CALLS = {"scene", "set_wrench", "clear_wrench", "apply_impulse", "set_state", "reset", "change"}


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "bag"


def everything(remote):
    """Send all that decides a motion, while it goes on; returns the bytes of the wrenches."""
    sent = []
    for i in range(40):
        wrench = WrenchStamped()
        wrench.header.frame_id = "base_link" if i % 3 else "world"
        wrench.wrench.torque.z, wrench.wrench.force.x = 0.1 * i, -0.3 * i
        sent.append(serialize_message(wrench))
        remote.send_bytes(sent[-1], "gust" if i % 5 == 4 else "wrench")
        remote.turn(0.005)
        if i == 10:
            remote.send("world", (0.1, 0.0, 0.0), (0.0, 0.02, 0.0), topic="impulse")
        if i == 15:
            assert remote.set_together({"body.mass": 3.0, "gravity": [0.0, 0.1, -1.62]}).successful
        if i == 20:
            remote.send_pose("world", (1.0, 2.0, 3.0), (0.4, 0.2, -0.8, 0.4))
        if i == 25:
            remote.call("reset")
        if i == 30:
            remote.send_twist("base_link", (0.1, 0.2, 0.3), (0.5, -0.4, 0.3))
        if i == 35:
            remote.call("clear_wrench")
    return sent


def wait_for_steps(remote, count):
    """Until so many more poses have come."""
    remote.clear()
    remote.collect(count)


def strides(stamps):
    return {b - a for a, b in itertools.pairwise(stamps)}


def ended(remote):
    remote.process.assert_stopped_cleanly()


def test_run_in_real_time_repeats_to_the_bit(connect, folder):
    remote = connect({**SCENE, "record.path": str(folder)}).ready()
    sent = everything(remote)
    wait_for_steps(remote, 50)
    remote.drain()
    heard = [(stamp_ns(message), message.pose.position.x) for message in remote.poses]
    _, values = remote.report()
    ended(remote)
    recorded = bag.read(folder, remote.name.removesuffix("/rigid_body_node"))

    assert values["dropped"] == "0"
    assert set(recorded.calls()) == CALLS
    assert recorded.assert_repeats() > 400
    poses = recorded.stamps("/pose")
    assert recorded.stamps("/odom") == recorded.stamps("/twist") == poses
    assert {stride for stride in strides(poses) if stride > 0} == {1_000_000}, "a step is missing"
    assert set(heard) <= {(bag.stamp_ns(data), position_x(data)) for _, data in recorded.messages["/pose"]}
    received = [data for topic in ("/wrench", "/gust") for _, data in recorded.messages[topic]]
    assert sorted(received) == sorted(sent)
    assert [len(recorded.messages[topic]) for topic in ("/impulse", "/set_pose", "/set_twist")] == [1, 1, 1]


def position_x(data):
    return struct.unpack_from("<d", data, len(data) - 56)[0]


def test_run_in_lockstep_repeats_to_the_bit(connect, folder):
    scene = {**SCENE, "lockstep": True, "steps_per_command": 3, "drag.angular_linear": [0.01, 0.02, 0.03]}
    remote = connect({**scene, "record.path": str(folder)}).ready()
    remote.settle()
    remote.clear()
    sent = everything(remote)
    led = sum(1 for i in range(len(sent)) if i % 5 != 4)
    remote.collect(led + 4)  # beside commands: an impulse, a reset, and two states
    ended(remote)
    recorded = bag.read(folder, remote.name.removesuffix("/rigid_body_node"))

    assert set(recorded.calls()) == CALLS
    assert len(recorded.messages["/wrench"]) == led
    assert recorded.assert_repeats() >= 2 * led
    assert recorded.stamps("/pose")[0] == 0


def test_run_with_pauses_and_steps_repeats_to_the_bit(connect, folder):
    """While it stands still, states set from outside are published with the stamp of the same step."""
    remote = connect({**SCENE, "start_paused": True, "reset_time": False, "record.path": str(folder)}).ready()
    for i in range(5):
        remote.send_pose("world", (float(i), 0.0, 0.0), (1.0, 0.0, 0.0, 0.1 * i))
        remote.call("step")
        remote.send("base_link", torque=(0.0, 0.1 * i, 0.0))
        remote.call("step")
    remote.call("pause", SetBool.Request(data=False))
    wait_for_steps(remote, 20)
    ended(remote)
    recorded = bag.read(folder, remote.name.removesuffix("/rigid_body_node"))
    assert recorded.assert_repeats() > 2 * (5 + 10 + 20)
    assert len(set(recorded.stamps("/pose"))) < len(recorded.stamps("/pose"))


# Without listeners ----------------------------------------------------------------------------------------------------


def wait_recorded(process, folder, size=1_000_000):
    file = folder / f"{folder.name}_0.mcap"
    process.wait_until(lambda: file.exists() and file.stat().st_size > size, f"{size} bytes in the bag", SECONDS)


def change(remote, chance):
    """One of all that may be asked of a node, some of it refused."""
    frame, force, torque = chance.choice(("world", "base_link", "nowhere")), vector(chance, 2.0), vector(chance, 0.1)
    whole = {"body.mass": chance.uniform(1.0, 3.0), "gravity": vector(chance, 9.0)}
    actions = [
        lambda: remote.send(frame, force, torque, topic=chance.choice(("wrench", "gust", "impulse"))),
        lambda: remote.send(frame, (math.nan, 0.0, 0.0)),
        lambda: remote.send_pose("world", force, (0.4, 0.2, -0.8, chance.choice((0.4, math.inf)))),
        lambda: remote.send_twist(frame, force, torque),
        lambda: remote.call(chance.choice(("reset", "clear_wrench"))),
        lambda: remote.call("step"),
        lambda: remote.pause(chance.random() < 0.4),
        lambda: remote.set_together(whole | ({"rate": 5.0} if chance.random() < 0.2 else {})),
        lambda: remote.set_parameter("real_time_factor", chance.choice((0.5, 1.0, 3.0, -1.0))),
    ]
    chance.choice(actions)()
    remote.turn(chance.choice((0.0, 0.002, 0.02)))


def vector(chance, size):
    return [chance.uniform(-size, size) for _ in range(3)]


@pytest.mark.parametrize("changes", [100, pytest.param(1000, marks=pytest.mark.nightly)])
def test_run_of_random_changes_repeats_to_the_bit(connect, folder, changes):
    """A fresh simulation that is given what the node took, at the same steps, goes through every recorded pose."""
    remote = connect({**SCENE, "record.path": str(folder)}).ready()
    chance = random.Random(changes)
    for _ in range(changes):
        change(remote, chance)
    remote.pause(False)
    wait_for_steps(remote, 50)
    _, values = remote.report()
    ended(remote)
    recorded = bag.read(folder, remote.name.removesuffix("/rigid_body_node"))
    assert values["dropped"] == "0"
    assert set(recorded.calls()) == CALLS
    assert recorded.assert_repeats() > 2 * changes


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_every_step_at_10_khz_is_recorded_while_nobody_listens(run_node, folder, number):
    spinning = {name: SCENE[name] for name in ("body.inertia", "initial.angular_velocity")}
    process = run_node({**spinning, "rate": 10000.0, "publish_rate": 0.0, "record.path": str(folder)})
    process.wait_ready()
    wait_recorded(process, folder, 8_000_000)
    status, seconds = process.stop(number)
    print(f"{number.name}: {seconds:.3f} s")
    assert (status, process.stderr.count("Traceback")) == (0, 0), process.stderr
    assert (folder / "metadata.yaml").exists()
    recorded = bag.read(folder)
    poses = recorded.stamps("/pose")
    assert len(poses) > 20_000
    assert strides(poses) == {100_000}
    assert recorded.stamps("/twist") == poses
    assert recorded.assert_repeats() == 2 * len(poses)


def test_as_fast_as_possible_it_waits_for_the_disk(run_node, folder):
    """Where no clock presses, the recorder holds the simulation up, and loses nothing."""
    process = run_node({"real_time_factor": 0.0, "publish_rate": 0.0, "record.path": str(folder)})
    process.wait_ready()
    wait_recorded(process, folder, 20_000_000)
    assert process.stop()[0] == 0
    poses = bag.read(folder).stamps("/pose")
    assert strides(poses) == {1_000_000}


def test_killed_node_leaves_what_was_written(run_node, folder):
    process = run_node({"publish_rate": 0.0, "record.path": str(folder)})
    process.wait_ready()
    wait_recorded(process, folder)
    process.kill()
    assert not (folder / "metadata.yaml").exists()
    recorded = bag.read_unfinished(folder)
    assert recorded.assert_repeats() > 2000
    poses = recorded.stamps("/pose")
    assert strides(poses) == {1_000_000}


def test_topics_can_be_chosen(run_node, folder):
    names = ["/pose", "gust", "pose"]  # twice the same
    process = run_node({**SCENE, "record.topics": names, "record.path": str(folder)})
    process.wait_ready()
    wait_recorded(process, folder, 50_000)
    assert process.stop()[0] == 0
    from rosbags.highlevel import AnyReader

    with AnyReader([folder]) as reader:
        told = [connection.topic for connection in reader.connections]
    assert told == ["/pose", "/gust", "/rigid_body_node/journal"]


def test_a_short_run_is_closed(run_node, folder):
    """Also when it ends before the first chunk was due, and while paused."""
    process = run_node({"start_paused": True, "record.path": str(folder)})
    process.wait_ready()
    assert process.stop()[0] == 0
    recorded = bag.read(folder)
    assert recorded.calls() == ["scene"]
    assert len(recorded.messages["/pose"]) == 1


# When it cannot be ----------------------------------------------------------------------------------------------------


def test_full_disk_stops_the_recorder_and_not_the_simulation(connect, folder):
    remote = connect({**SCENE, "record.path": str(folder)}).ready()
    limit = 1_500_000
    resource.prlimit(remote.process.popen.pid, resource.RLIMIT_FSIZE, (limit, limit))
    status, values = remote.wait_report(lambda status, _: "recording" in status.message, "a full disk")
    assert (int.from_bytes(status.level, "little"), values["mode"]) == (2, "running")
    assert "has stopped ([Errno 27] File too large), and the simulation goes on" in status.message
    dropped = int(values["dropped"])
    assert dropped > 0
    assert int(remote.wait_report(lambda _, values: int(values["dropped"]) > dropped, "more")[1]["steps"]) > 0
    wait_for_steps(remote, 20)
    ended(remote)
    assert remote.process.stderr.count("has stopped") + remote.process.stdout.count("has stopped") == 1
    recorded = bag.read_unfinished(folder, remote.name.removesuffix("/rigid_body_node"))
    assert recorded.assert_repeats() > 1000
    assert sum(map(len, recorded.messages.values())) == int(values["recorded"])


def test_message_larger_than_the_buffer_is_told_and_no_other_lost(connect, folder):
    remote = connect({**SCENE, "record.path": str(folder)}).ready()
    remote.send("x" * 17_000_000, (1.0, 0.0, 0.0))
    remote.wait_report(lambda _, values: values["dropped"] == "1", "a dropped message")
    wait_for_steps(remote, 200)
    _, values = remote.report()
    ended(remote)
    assert values["dropped"] == "1"
    told = remote.process.stdout + remote.process.stderr
    assert told.count("bytes on /") == 1 and "is not recorded: the recorder's buffer has 16000000 bytes" in told
    poses = bag.read(folder, remote.name.removesuffix("/rigid_body_node")).stamps("/pose")
    assert len(poses) > 200 and {stride for stride in strides(poses) if stride > 0} == {1_000_000}


@pytest.mark.parametrize(
    ("path", "given", "said"),
    [
        ("there", {}, "exists already; give a folder that does not exist yet"),
        ("file/bag", {}, "cannot be made (Not a directory); give a folder that can be"),
        ("new", {"record.topics": ["odom"]}, "'odom' is not recorded here; give any of /pose, /twist, /impulse, /set"),
        ("new", {"record.topics": ["1 2"]}, "'1 2' is not recorded here; give any of"),
    ],
)
def test_what_cannot_be_recorded_keeps_it_from_starting(run_node, tmp_path, path, given, said):
    (tmp_path / "there").mkdir()
    (tmp_path / "file").touch()
    process = run_node({**given, "record.path": str(tmp_path / path)})
    assert process.wait_end(SECONDS + 100) == 1
    assert said in process.stderr
    assert process.stderr.startswith("rigid_body_node: parameter record.")
    assert process.stderr.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "there"]


def test_without_rosbags_it_says_what_to_install(run_node, tmp_path, folder):
    (tmp_path / "rosbags").mkdir()
    (tmp_path / "rosbags" / "__init__.py").write_text("raise ImportError('not here')")
    there = {"PYTHONPATH": os.pathsep.join((str(tmp_path), str(ROOT)))}
    process = run_node({"record.path": str(folder)}, environment=there)
    assert process.wait_end(SECONDS + 100) == 1
    assert "bags need the library rosbags, which cannot be imported (not here)" in process.stderr
    assert "pip install '.[bag,fast]'" in process.stderr
    assert not folder.exists()
