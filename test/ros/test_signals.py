"""Ctrl-C and SIGTERM: exit status 0 and no traceback, whenever they come."""

import signal
import time

import pytest

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
MOMENTS = ["_multiarray_umath", "libllvmlite", "_rclpy_pybind11", "/dev/shm/fastrtps_"]


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
