"""Pace and /clock: slower, faster, as fast as possible, and what time does while it stands still."""

import itertools
import os
import time
from pathlib import Path

import numpy as np
import pytest

from . import node_process
from .remote import stamp_ns

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

NANOSECONDS = 1_000_000_000
SCENE = {
    "rate": 200.0,
    "publish_rate": 20.0,
    "outputs": ["clock"],
    "wrench.timeout": 0.0,
    "initial.angular_velocity": [0.3, 0.2, 0.1],
}
PERIOD_NS = 50_000_000


@pytest.fixture(scope="module")
def remote(connect_shared):
    from rosgraph_msgs.msg import Clock

    remote = connect_shared(SCENE)
    remote.clocks = remote.listen(Clock, "/clock")
    return remote.ready()


@pytest.fixture
def clocked(remote):
    """Running at its own pace, from the initial state on."""
    remote.set_parameter("real_time_factor", 1.0)
    remote.pause(False)
    return remote


def clock_ns(message):
    return message.clock.sec * NANOSECONDS + message.clock.nanosec


def passed(remote, count):
    """Simulated and wall time [s] while ``count`` further poses arrive."""
    remote.drain()
    before, begin = stamp_ns(remote.poses[-1]), time.monotonic()
    have = len(remote.poses)
    remote.wait(lambda: len(remote.poses) >= have + count, f"{count} poses")
    return (stamp_ns(remote.poses[-1]) - before) / NANOSECONDS, time.monotonic() - begin


def test_stamps_are_simulated_time_from_zero(clocked):
    """Whoever uses /clock compares it with stamps: both come from the count of steps."""
    track = clocked.collect(5)
    assert track.stamp_ns[-1] < 600 * NANOSECONDS  # wall time would be years
    assert np.all(track.stamp_ns % PERIOD_NS == 0)


def test_clock_says_what_the_stamps_say_and_comes_after_them(clocked):
    clocked.collect(len(clocked.poses) + 10)
    clocked.wait(lambda: len(clocked.clocks) > 10, "the clock")
    ticks = [clock_ns(message) for message in clocked.clocks]
    assert ticks == sorted(ticks)
    latest = ticks[-1]
    clocked.wait(lambda: stamp_ns(clocked.poses[-1]) >= latest, "the pose of that time")


def test_clock_ticks_on_while_time_stands_still(clocked):
    clocked.pause(True)
    clocked.settle()
    del clocked.clocks[:]
    poses = len(clocked.poses)
    clocked.wait(lambda: len(clocked.clocks) >= 3, "three ticks")
    assert {clock_ns(message) for message in clocked.clocks} == {stamp_ns(clocked.poses[-1])} or len(
        {clock_ns(message) for message in clocked.clocks}
    ) == 1
    assert len(clocked.poses) == poses


def test_clock_goes_on_over_a_reset(clocked):
    clocked.collect(len(clocked.poses) + 3)
    clocked.drain()
    before = stamp_ns(clocked.poses[-1])
    clocked.call("reset")
    have = len(clocked.poses)
    clocked.wait(lambda: len(clocked.poses) >= have + 3, "poses after the reset")
    assert stamp_ns(clocked.poses[-1]) > before
    ticks = [clock_ns(message) for message in clocked.clocks]
    assert ticks == sorted(ticks)


def test_slower_than_real_time(clocked):
    assert clocked.set_parameter("real_time_factor", 0.25).successful
    simulated, wall = passed(clocked, 4)
    assert simulated <= 0.25 * wall + PERIOD_NS / NANOSECONDS  # never faster, however busy the machine


def test_as_fast_as_possible_keeps_the_grid_and_serves_requests(connect):
    """Of few messages, each after many steps: the observer must keep up."""
    rate, period_ns = 1e5, NANOSECONDS // 10
    remote = connect({**SCENE, "rate": rate, "publish_rate": 10.0, "outputs": []}).ready()
    assert remote.set_parameter("real_time_factor", 0.0).successful
    have = len(remote.poses)
    remote.wait(lambda: len(remote.poses) >= have + 60, "6 s of simulated time")
    assert remote.set_parameter("real_time_factor", 1.0).successful
    remote.drain()
    stamps = np.array([stamp_ns(message) for message in remote.poses[have:]])
    assert np.all(np.diff(stamps) % period_ns == 0)
    assert np.diff(stamps).min() > 0


def test_diagnostics_tell_the_factor_that_is_reached(clocked):
    clocked.set_parameter("real_time_factor", 0.5)
    clocked.report()
    _, values = clocked.report()
    assert 0.0 < float(values["real-time factor"]) < 0.6


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf"), 1e7])
def test_factor_that_is_none_is_refused_and_changes_nothing(clocked, value):
    result = clocked.set_parameter("real_time_factor", value)
    assert not result.successful
    assert result.reason
    assert clocked.get_parameters("real_time_factor") == [1.0]


def went_back(stamps):
    return any(later < earlier for earlier, later in itertools.pairwise(stamps))


def test_reset_sets_time_back_only_when_asked(connect):
    remote = connect({**SCENE, "reset_time": True}).ready()
    remote.collect(5)
    remote.call("reset")
    remote.wait(
        lambda: went_back([stamp_ns(message) for message in remote.poses]), "a stamp earlier than the one before"
    )


def test_stamps_begin_between_two_readings_of_the_clock(connect, tmp_path):
    """One is taken when the start is over but for the loop, the other when the node answers: no load moves one of them.

    Until then the node is held up, in its last log.
    """
    go_on = tmp_path / "go on"
    folders = [str(node_process.ROOT), str(Path(__file__).parent), os.environ.get("PYTHONPATH")]
    environment = {"HELD_UP_UNTIL": str(go_on), "PYTHONPATH": os.pathsep.join(filter(None, folders))}
    remote = connect({"start_paused": True}, module="held_up", environment=environment)
    remote.process.wait_ready()
    before_ns = time.time_ns()
    go_on.touch()
    remote.ready()  # after a reset, at step 0, where it waits
    after_ns = time.time_ns()
    (stamp,) = {stamp_ns(message) for message in remote.poses}
    assert before_ns <= stamp <= after_ns
