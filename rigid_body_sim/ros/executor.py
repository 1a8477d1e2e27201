"""The executor that costs least, and the time that a loop gives it."""

import contextlib
import time
from collections.abc import Callable

from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node

from .pacing import NANOSECONDS

_make_executor: Callable[..., Executor] = SingleThreadedExecutor
with contextlib.suppress(ImportError):  # rclpy before 7.1.4
    from rclpy.experimental import EventsExecutor

    _make_executor = EventsExecutor

UNSERVED_NS = NANOSECONDS // 2000


def executor_for(node: Node) -> Executor:
    """An executor that serves ``node``, to be driven by ``spin_once(timeout_sec=...)``.

    EventsExecutor where rclpy has it, at a tenth of the cost of the other. Its ``spin()`` hangs in rclpy 7.1.6.
    """
    executor = _make_executor(context=node.context)
    executor.add_node(node)
    return executor


class IdleTime:
    """What a loop does between its deadlines: it lets the executor serve whoever asks.

    A wait in the executor costs twice that of a plain sleep (20 us of CPU, not 10), and ends later. So of waits that
    follow closely on each other only one in UNSERVED_NS goes to the executor: nobody waits longer for an answer than
    that, and as long as there is something to serve, all of them do.
    """

    def __init__(self, executor: Executor):
        self._executor = executor
        self._serve_ns = 0

    def spend(self, now_ns: int, idle_ns: int) -> None:
        """Return ``idle_ns`` after ``now_ns`` of the monotonic clock, or sooner when something was served."""
        end_ns = now_ns + idle_ns
        if idle_ns > 0 and end_ns < self._serve_ns:
            time.sleep(idle_ns / NANOSECONDS)
            return
        self._executor.spin_once(timeout_sec=max(0, idle_ns) / NANOSECONDS)
        after_ns = time.monotonic_ns()
        # Back early, or late from the start: there may be more to serve.
        self._serve_ns = 0 if idle_ns <= 0 or after_ns < end_ns else after_ns + UNSERVED_NS
