"""What goes wrong around a node, with real processes: it goes on, or ends as it should, and says what happened."""

import os
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, WrenchStamped

from .node_process import READY_SECONDS, ROOT
from .remote import SECONDS, stamp_ns

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

HERE = Path(__file__).parent
# Ten steps a message: who hears each of a thousand a second falls behind on a busy machine.
SCENE = {
    "rate": 1000.0,
    "publish_rate": 100.0,
    "wrench.timeout": 0.5,
    "body.mass": 2.0,
    "outputs": ["wrench_applied"],
}
STEP_NS, MESSAGE_NS = 1_000_000, 10_000_000
BACKLOG = 0.05  # s; a longer one slips
STOP_SECONDS = 5.0  # a second is promised; a busy machine may take longer
nightly = pytest.mark.nightly


@pytest.fixture(scope="module")
def plain(connect_shared):
    """One node for all faults that leave it as it was."""
    return connect_shared(SCENE).ready()


@pytest.fixture
def remote(plain):
    """The same at rest, with nothing unread."""
    plain.drain()
    plain.poses.clear()
    plain.twists.clear()
    plain.fresh()
    return plain


@pytest.fixture
def command(remote):
    """Start a commander of the plain node: ``command(rate, force_x, reliability="RELIABLE")``; returns its process."""
    started = []

    def start(rate, force_x, *more):
        namespace = remote.name.rpartition("/")[0]
        path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
        arguments = [sys.executable, str(HERE / "commander.py"), namespace, str(rate), str(force_x), *more]
        process = subprocess.Popen(arguments, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": path})
        started.append(process)
        remote.wait(lambda: select.select([process.stdout], [], [], 0.0)[0], "a commander that sends")
        assert process.stdout.readline() == b"sending\n"
        return process

    yield start
    for process in started:
        process.terminate()
    for process in started:
        process.wait()
        process.stdout.close()


def end(remote, process, number=signal.SIGTERM):
    """Send a signal and read on until the process has ended: a node whose observer does not read is held up."""
    process.send_signal(number)
    remote.wait(lambda: process.poll() is not None, "its end")
    return process.returncode


def forces(remote, messages):
    """(least, largest) change of the velocity along x in each of the next messages, times mass over time: the force."""
    remote.clear()
    track = remote.collect(messages)
    found = np.diff(track.linear[:, 0]) * SCENE["body.mass"] * 1e9 / np.diff(track.stamp_ns)
    return found.min(), found.max()


def wait_force(remote, force_x, messages=20):
    """Until this force acts throughout so many messages; rounding of the velocities leaves 1e-12 of it."""

    def acts():
        return forces(remote, messages) == pytest.approx((force_x, force_x), rel=1e-6, abs=0.0)

    remote.wait(acts, f"{force_x} N along x")


def wait_obeys(remote, force_x):
    """Until a command has its effect; one alone may be lost, and acts for half a second only."""

    def obeys():
        remote.send("world", (force_x, 0.0, 0.0))
        return forces(remote, 5)[1] == pytest.approx(force_x, rel=1e-6)

    remote.wait(obeys, "a command's effect")


def said(remote, process, text, seconds=SECONDS):
    remote.wait(lambda: text in process.stdout + process.stderr, repr(text), seconds)


def strides(messages):
    return set(np.diff([stamp_ns(message) for message in messages]).tolist())


class Accounts:
    """What a node's reports say of its time: all of it was simulated, or is counted as slipped."""

    def __init__(self, remote):
        self._remote = remote
        self._heard = remote.listen(DiagnosticArray, "/diagnostics")

    def next(self):
        """(ns by the node's own clock, ns accounted for, values by name) of the next report."""
        self._heard.clear()
        self._remote.wait(self._own, "a report")
        stamp, status = self._own()[-1]
        values = {pair.key: pair.value for pair in status.values}
        accounted = int(values["steps"]) * STEP_NS + round(float(values["slipped time [s]"]) * 1e9)
        return stamp, accounted, values

    def _own(self):
        found = [(stamp_ns(message), status) for message in self._heard for status in message.status]
        return [(stamp, status) for stamp, status in found if status.name.startswith(f"{self._remote.name}: ")]


# Commanders -----------------------------------------------------------------------------------------------------------


def test_commander_killed_in_mid_command(remote, command):
    """What it sent last acts to its timeout and no longer; the next commander is heard as if nothing had been."""
    first = command(500.0, 3.0)
    wait_force(remote, 3.0)
    end(remote, first, signal.SIGKILL)
    remote.drain()
    killed_ns = stamp_ns(remote.poses[-1])
    wait_force(remote, 0.0, 50)
    # Looked at every half second, half a second after the last command; test_sources.py has it to the step.
    assert stamp_ns(remote.poses[0]) - killed_ns < 2e9
    command(500.0, -5.0)
    wait_force(remote, -5.0)


def test_two_commanders_on_one_topic_take_turns_and_never_add_up(remote, command):
    applied = remote.listen(WrenchStamped, "wrench_applied")
    command(300.0, 3.0)
    command(170.0, -5.0)

    def found():
        return {message.wrench.force.x for message in applied}

    remote.wait(lambda: {3.0, -5.0} <= found(), "forces of both")
    applied.clear()
    remote.wait(lambda: len(applied) > 300, "300 more")
    assert found() == {3.0, -5.0}


def test_flood_of_20_000_commands_a_second(remote, command):
    """The latest counts: what found no room in the queue of 10 is older. Time is kept, or what slips is counted."""
    accounts, memory = Accounts(remote), resident(remote)
    begun, accounted_then, _ = accounts.next()
    flood = command(20_000.0, 3.0)
    wait_force(remote, 3.0, 200)
    assert strides(remote.poses) == {MESSAGE_NS}
    ended, accounted, values = accounts.next()
    off, grown = (accounted - accounted_then - ended + begun) * 1e-9, resident(remote) - memory
    print(f"flood: {off * 1e3:.3f} ms of {(ended - begun) * 1e-9:.3f} s unaccounted for, memory grew by {grown} kB")
    assert abs(off) < 0.5  # measured 0.001; a report may be interrupted before its stamp
    assert not any(int(values[key]) for key in values if key.startswith("refused"))
    assert grown < 30_000  # measured 4000
    end(remote, flood)
    wait_obeys(remote, 7.0)


@nightly
def test_flood_for_a_minute_leaves_memory_flat(remote, command):
    command(20_000.0, 3.0)
    wait_force(remote, 3.0)
    accounts, found = Accounts(remote), []
    begun = accounts.next()[0]
    while (now := accounts.next()[0] - begun) < 60e9:
        if now > 10e9:
            found.append(resident(remote))
    print(f"20 000 commands a second for a minute: memory grew by {max(found) - found[0]} kB after 10 s")
    assert max(found) - found[0] < 5_000


def resident(remote):
    """Memory [kB] of the node."""
    status = Path(f"/proc/{remote.process.popen.pid}/status").read_text()
    return int(status.rpartition("VmRSS:")[2].split()[0])


# The same name, other QoS ---------------------------------------------------------------------------------------------


def test_second_node_of_the_same_name_is_warned_about(remote, run_node):
    namespace = remote.name.rpartition("/")[0]
    second = run_node(SCENE, arguments=["-r", f"__ns:={namespace}"], namespace=namespace)
    text = f"another node has the name {remote.name}: it takes the same commands"
    try:
        said(remote, second, "]: ready: ")
        for process in (remote.process, second):
            said(remote, process, text)
    finally:  # else the tests that follow hear two nodes
        status = end(remote, second.popen, signal.SIGINT)
    assert status == 0, second.stderr
    remote.report()
    assert (remote.process.stdout + remote.process.stderr).count("another node has the name") == 1


def test_commander_and_listener_of_other_qos_are_warned_about_by_topic(remote, command):
    command(10.0, 3.0, "BEST_EFFORT")
    said(remote, remote.process, "New publisher discovered on topic 'wrench', offering")
    said(remote, remote.process, "Last incompatible policy: RELIABILITY")
    assert remote.report()[1]["wrench held"] == "no"
    remote.listen_late(PoseStamped, "pose")
    said(remote, remote.process, "New subscription discovered on topic 'pose', requesting")
    said(remote, remote.process, "Last incompatible policy: DURABILITY")


# Time -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seconds", [1.0, pytest.param(5.0, marks=nightly)])
def test_stopped_and_continued_it_neither_jumps_nor_bursts(remote, seconds):
    """By SIGSTOP: all that it slept through but the backlog of 50 ms slips, is reported, and is not caught up later."""
    accounts = Accounts(remote)
    begun, accounted_then, values = accounts.next()
    slipped = float(values["slipped time [s]"])
    stopped = stop_for(remote, seconds)
    status, values = remote.wait_report(
        lambda _, v: float(v["slipped time [s]"]) > slipped + seconds / 2, "slipped time"
    )
    more = float(values["slipped time [s]"]) - slipped
    print(f"stopped for {stopped:.3f} s: {more:.3f} s slipped")
    assert more > stopped - BACKLOG - 0.002  # and less the first step; a busy machine adds to it
    assert float(values["largest lateness [s]"]) > stopped - 0.002
    assert "slower than real time by" in status.message
    remote.clear()
    remote.collect(100)
    assert strides(remote.poses) == {MESSAGE_NS}
    ended, accounted, _ = accounts.next()
    assert abs((accounted - accounted_then) - (ended - begun)) < 0.5e9  # measured within 2 ms


def stop_for(remote, seconds):
    """Stop the node for so long, at least; returns for how long it surely stood still."""
    pid = remote.process.popen.pid
    os.kill(pid, signal.SIGSTOP)
    state = Path(f"/proc/{pid}/stat")
    remote.wait(lambda: state.read_text().rpartition(")")[2].split()[0] == "T", "a stopped process")
    begun = time.monotonic()
    remote.wait(lambda: time.monotonic() > begun + seconds, "time")
    stopped = time.monotonic() - begun
    os.kill(pid, signal.SIGCONT)
    return stopped


@pytest.fixture
def shifted_clock(tmp_path):
    """Environment of a process whose system clock can be set, and a function that sets it, in seconds off the real."""
    if (compiler := shutil.which("cc")) is None:
        pytest.skip("no C compiler to build what sets the clock of one process")
    library, file = tmp_path / "shifted_clock.so", tmp_path / "offset"
    file.write_text("0")
    built = [compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(HERE / "shifted_clock.c"), "-ldl"]
    subprocess.run(built, check=True)

    def shift(seconds):
        new = file.with_suffix(".new")
        new.write_text(str(seconds))
        new.replace(file)

    return {"LD_PRELOAD": str(library), "CLOCK_OFFSET_FILE": str(file)}, shift


def test_system_clock_set_back_and_forth_by_an_hour(connect, shifted_clock):
    """Nothing happens to the simulation: steps, stamps, commands and services go on. Reports carry the new time."""
    environment, shift = shifted_clock
    remote = connect(SCENE, environment=environment).ready()
    accounts = Accounts(remote)
    remote.clear()
    for hours in (1, -1):
        shift(3600 * hours)
        remote.wait(lambda off=3600 * hours: abs(accounts.next()[0] * 1e-9 - time.time() - off) < 600.0, f"{hours} h")
        assert remote.call("clear_wrench").success
    assert strides(remote.poses) == {MESSAGE_NS}
    wait_obeys(remote, 3.0)
    assert float(accounts.next()[2]["slipped time [s]"]) < 600.0  # an hour if any loop looked at that clock


# Full and forbidden places --------------------------------------------------------------------------------------------

FULL = 'mount -t tmpfs -o size={size} tmpfs /dev/shm && head -c {fill} /dev/zero > /dev/shm/fill; exec "$@"'


def can_mount():
    tried = subprocess.run(["unshare", "-m", "mount", "-t", "tmpfs", "tmpfs", "/dev/shm"], capture_output=True)
    return tried.returncode == 0


def in_small_memory(size, fill="0"):
    """What starts a process with another /dev/shm, of that size and filled so far."""
    if shutil.which("unshare") is None or not can_mount():
        pytest.skip("this system lets nobody mount a /dev/shm for one process")
    return ["unshare", "-m", "sh", "-c", FULL.format(size=size, fill=fill), "sh"]


def test_little_shared_memory_costs_a_node_nothing_but_that(connect):
    remote = connect(SCENE, prefix=in_small_memory("256k")).ready()
    assert "/dev/shm has " in remote.process.stderr and "messages go by UDP" in remote.process.stderr
    remote.clear()
    remote.collect(50)
    wait_obeys(remote, 3.0)


@pytest.mark.parametrize(("size", "fill"), [("1m", "2m"), ("4k", "0")])
def test_full_shared_memory_is_told_in_one_sentence(run_node, size, fill):
    """Fast DDS left to itself is killed by SIGBUS."""
    process = run_node({}, prefix=in_small_memory(size, fill))
    assert process.wait_end(READY_SECONDS) == 1
    (told,) = [line for line in process.stderr.splitlines() if not line.startswith("head: ")]
    assert told.startswith("rigid_body_node: /dev/shm has ") and "remove files there that nobody uses" in told


def test_log_directory_that_cannot_be_written_is_told_in_one_sentence(run_node, tmp_path):
    """Below a file: nothing else is forbidden to root."""
    file = tmp_path / "file"
    file.touch()
    process = run_node({}, environment={"ROS_LOG_DIR": str(file / "log")})
    assert process.wait_end(READY_SECONDS) == 1
    assert "log directory" in process.stderr and "set ROS_LOG_DIR to a folder that can be written" in process.stderr
    assert process.stderr.count("\n") == 1


CLOSED = ["sh", "-c", 'exec "$0" "$@" <&- >&- 2>&-']


def standard_streams(process):
    return [os.readlink(f"/proc/{process.popen.pid}/fd/{number}") for number in range(3)]


def test_node_without_standard_streams_runs(connect):
    """Nobody sees that it is ready, but it serves; what it opens first does not become its stderr."""
    remote = connect(SCENE, prefix=CLOSED)
    remote.wait(remote._clients["reset"].service_is_ready, "the service", READY_SECONDS)
    remote.wait(lambda: remote.poses, "a pose")
    assert standard_streams(remote.process) == [os.devnull] * 3


def test_so_does_the_controller(remote, run_node):
    controller = run_node(None, module="rigid_body_sim.tools.pointing_controller", prefix=CLOSED)
    remote.wait(lambda: "pointing_controller" in remote._node.get_node_names(), "the controller", READY_SECONDS)
    assert standard_streams(controller) == [os.devnull] * 3
    controller.assert_stopped_cleanly()


def test_stamps_that_no_message_holds_stop_it_like_a_step_that_cannot_be_done(connect):
    """Lockstep by 10^9 s a command: the third has no stamp left. The state before stays, and a reset begins anew."""
    scene = {"rate": 0.001, "lockstep": True, "steps_per_command": 1_000_000, "publish_rate": 0.0}
    remote = connect({**scene, "initial.linear_velocity": [1.0, 0.0, 0.0]}).ready()
    for _ in range(2):
        have = len(remote.poses)
        remote.send("world")
        remote.wait(lambda have=have: len(remote.poses) > have, "an answer")
    remote.send("world")
    status, _ = remote.wait_report(lambda status, _: status.level == status.ERROR, "an error")
    assert "its stamp would be of 2^31 s or more" in status.message
    assert 2.0e9 <= remote.poses[-1].header.stamp.sec < 2**31
    assert remote.poses[-1].pose.position.x == pytest.approx(2**31 // 1000 * 1e3, rel=1e-15)
    assert remote.call("reset").message == "initial state, no wrench, simulated time from zero"
    have = len(remote.poses)
    remote.send("world")
    remote.wait(lambda: len(remote.poses) > have, "an answer")
    assert round(remote.poses[-1].header.stamp.sec, -1) == 10**9 == remote.poses[-1].pose.position.x


# The end --------------------------------------------------------------------------------------------------------------


def test_services_called_during_shutdown(connect):
    """Whoever asks while it ends gets an answer or none; it ends all the same."""
    remote = connect({**SCENE, "start_paused": True}).ready()
    process, client = remote.process, remote._clients["step"]
    for _ in range(200):
        client.call_async(client.srv_type.Request())
    process.popen.send_signal(signal.SIGTERM)
    deadline = time.monotonic() + STOP_SECONDS
    while process.popen.poll() is None and time.monotonic() < deadline:
        client.call_async(client.srv_type.Request())
        remote.turn(0.001)
    assert process.wait_end(1.0) == 0, process.stderr
    assert "Traceback" not in process.stderr, process.stderr
