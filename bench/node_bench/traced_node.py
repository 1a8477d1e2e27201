"""rigid_body_node under tracemalloc: prints how much more memory it holds after a while of its loop than before."""

import gc
import json
import sys
import time
import tracemalloc

import rclpy

from rigid_body_sim.ros.node import RigidBodyNode

WARM_UP = 3.0  # s: diagnostics, first commands and all caches have been through by then


class Watch:
    """Stands for a request to stop: the loop asks it every turn, and it measures between two of these times."""

    def __init__(self, node: RigidBodyNode, seconds: float):
        self._steps_of = node.simulation
        self._begin = time.monotonic() + WARM_UP
        self._end = self._begin + seconds
        self.before: tuple[int, tracemalloc.Snapshot] | None = None
        self.after: tuple[int, tracemalloc.Snapshot] | None = None

    @property
    def requested(self) -> bool:
        """True when it is over."""
        now = time.monotonic()
        if self.before is None and now >= self._begin:
            self.before = self._reading()
        elif now >= self._end:
            self.after = self._reading()
        return self.after is not None

    def _reading(self) -> tuple[int, tracemalloc.Snapshot]:
        gc.collect()  # what waits for the collector is not held
        ours = tracemalloc.Filter(False, tracemalloc.__file__), tracemalloc.Filter(False, __file__)
        return self._steps_of.steps, tracemalloc.take_snapshot().filter_traces(ours)

    def result(self) -> dict:
        """Steps, bytes and blocks by which the traced memory grew, and the lines that hold most of them."""
        (first, before), (last, after) = self.before, self.after
        grown = after.compare_to(before, "lineno")
        return {
            "steps": last - first,
            "bytes": sum(line.size_diff for line in grown),
            "blocks": sum(line.count_diff for line in grown),
            "lines": [f"{line.traceback} {line.size_diff:+d} B" for line in grown[:3] if line.size_diff],
        }


def main(seconds: str, *ros_arguments: str) -> None:
    """Run for that many seconds after a warm-up and print the result as a line of JSON."""
    rclpy.init(args=["", *ros_arguments], signal_handler_options=rclpy.SignalHandlerOptions.NO)
    node = RigidBodyNode()
    tracemalloc.start()
    watch = Watch(node, float(seconds))
    node.run(watch)
    print(json.dumps(watch.result()), flush=True)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main(*sys.argv[1:])
