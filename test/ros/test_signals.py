"""Ctrl-C and SIGTERM: exit status 0, no traceback, and nothing is left behind, whenever they come."""

import os
import random
import signal
import time
from pathlib import Path

import pytest

from .domains import OWN, free_domain
from .node_process import READY_SECONDS, SEGMENT, SHARED_MEMORY, all_processes, shared_memory

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

SIGNALS = [signal.SIGINT, signal.SIGTERM]
STOP_SECONDS = 5.0


def assert_stops(process, number):
    status, seconds = process.stop(number, STOP_SECONDS)
    print(f"{number.name}: {seconds:.3f} s")
    assert "Traceback" not in process.stderr, process.stderr
    assert status == 0, f"exit status {status}: {process.stderr}"


@pytest.mark.parametrize("number", SIGNALS)
def test_signal_stops_a_busy_node(run_node, number):
    """One that does nothing but publish ends between two messages, not in the middle of one."""
    process = run_node({"rate": 20000.0, "publish_rate": 0.0})
    process.wait_ready()
    assert_stops(process, number)


def test_signal_stops_a_paused_node(run_node):
    """One that sleeps until its next report."""
    process = run_node({"start_paused": True})
    process.wait_ready()
    assert_stops(process, signal.SIGINT)


def test_two_signals_stop_it_no_worse(run_node):
    process = run_node({})
    process.wait_ready()
    process.popen.send_signal(signal.SIGINT)
    assert_stops(process, signal.SIGINT)


# Libraries that a starting node loads one after the other: each says how far it has come.
MOMENTS = ["_multiarray_umath", "libllvmlite", "_rclpy_pybind11", SEGMENT]


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("moment", MOMENTS)
def test_signal_during_start(run_node, number, moment):
    """While it imports numpy, numba and rclpy, and while it joins the network."""
    process = run_node({})
    process.wait_loaded(moment, 30.0)
    assert_stops(process, number)


@pytest.mark.parametrize(("number", "delay"), [(signal.SIGINT, 0.2), (signal.SIGINT, 2.0), (signal.SIGTERM, 3.0)])
def test_signal_while_kernels_compile(run_node, tmp_path, number, delay):
    """A first start compiles for many seconds, and nobody wants to wait for that after Ctrl-C.

    The delay is the thing under test: it hits Python, or LLVM, which cannot be interrupted by an exception.
    """
    process = run_node({}, environment={"NUMBA_CACHE_DIR": str(tmp_path)})
    process.wait_for_output("compiling kernels", 60.0)
    time.sleep(delay)
    assert_stops(process, number)


# At random moments ----------------------------------------------------------------------------------------------------


class Alone:
    """A node that shares its domain with nobody, so that what it leaves behind is seen to be its own."""

    def __init__(self, run_node, parameters, mark):
        self._mark = f"RIGID_BODY_SIM_MARK={mark}"  # in its environment, and in that of any process that it starts
        name, _, value = self._mark.partition("=")
        self._before = set(SHARED_MEMORY.iterdir())  # a port that somebody has left there is used again, and stays
        self.process = run_node(parameters, environment={"ROS_DOMAIN_ID": str(free_domain(OWN)), name: value})

    def wait_handles_signals(self):
        """Before that it is Python that starts."""
        status = Path(f"/proc/{self.process.popen.pid}/status")

        def handles():
            caught = int(status.read_text().partition("SigCgt:")[2].split()[0], 16)
            return caught >> (signal.SIGTERM - 1) & 1

        self.process.wait_until(handles, "handler of SIGTERM", READY_SECONDS)

    def ends(self, again=None):
        """SIGTERM, and once more so many seconds later: status 0, and nothing is left behind. Returns seconds."""
        process, begun, files = self.process.popen, time.monotonic(), set()
        process.terminate()
        while process.poll() is None:
            files |= shared_memory(process.pid)
            assert time.monotonic() < begun + STOP_SECONDS, self.process.stderr
            if again is not None and time.monotonic() > begun + again:
                process.terminate()
                again = None
            time.sleep(0.002)
        seconds = time.monotonic() - begun
        assert process.returncode == 0, self.process.stderr
        assert "Traceback" not in self.process.stderr, self.process.stderr
        in_use = set().union(*map(shared_memory, all_processes()))
        assert not {file for file in files - self._before - in_use if file.exists()}, "shared memory is left behind"
        assert not [pid for pid in all_processes() if self._mark in environment_of(pid)], "a process is left behind"
        return seconds


def environment_of(pid):
    try:
        return Path(f"/proc/{pid}/environ").read_text(errors="replace").split("\0")
    except OSError:  # ended, or somebody else's
        return []


SCENES = [{"rate": 1000.0, "publish_rate": 0.0}, {"lockstep": True}, {}]
LONGEST_START = 1.5  # s, to ready on an idle machine
LONGEST_END = 0.2  # s


def ends_at_random(run_node, phase, number):
    """SIGTERM at a random moment of the phase: seconds that the end takes."""
    chance = random.Random(f"{phase} {number}")
    alone = Alone(run_node, chance.choice(SCENES), f"{os.getpid()}-{phase}-{number}")
    if phase == "start-up":
        alone.wait_handles_signals()
        third = number % 3 + chance.random()
        time.sleep(third / 3.0 * LONGEST_START)  # the moment is under test, here and below
        return alone.ends()
    alone.process.wait_ready()
    if phase == "run":
        time.sleep(chance.uniform(0.0, 1.0))
        return alone.ends()
    return alone.ends(again=chance.uniform(0.0, LONGEST_END))


MOMENTS = [("start-up", 0), ("start-up", 1), ("start-up", 2), ("run", 0), ("shutdown", 0), ("shutdown", 1)]


@pytest.mark.parametrize(("phase", "number"), MOMENTS)
def test_sigterm_at_a_random_moment(run_node, phase, number):
    print(f"{ends_at_random(run_node, phase, number):.3f} s")


@pytest.mark.nightly
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(("phase", "times"), [("start-up", 40), ("run", 30), ("shutdown", 30)])
def test_sigterm_at_a_hundred_random_moments(run_node, phase, times):
    took = sorted(ends_at_random(run_node, phase, 10 + number) for number in range(times))
    print(f"SIGTERM during {phase}, {times} times: {took[-1]:.3f} s at most, {took[times // 2]:.3f} s usually")
