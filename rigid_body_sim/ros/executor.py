"""The executor that costs least."""

from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node

try:
    from rclpy.experimental import EventsExecutor
except ImportError:  # rclpy before 7.1.4
    EventsExecutor = None


def executor_for(node: Node) -> Executor:
    """An executor that serves ``node``, to be driven by ``spin_once(timeout_sec=...)``.

    EventsExecutor where rclpy has it, at a tenth of the cost of the other. Its ``spin()`` hangs in rclpy 7.1.6.
    """
    executor = EventsExecutor() if EventsExecutor is not None else SingleThreadedExecutor()
    executor.add_node(node)
    return executor
