"""A controller in lockstep, for its tests: node and controller as processes, and the motion that they come to."""

import itertools
import os
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

from ..scenarios.motion import RecordedMotion, recorded
from .processes import Child, children

NANOSECONDS = 1_000_000_000
NODE = "rigid_body_sim.ros.main"
PATIENCE = 120.0  # s without a step; the first start of a scene compiles, on a machine that does much else a minute
_LOOK_EVERY = 0.05  # s
_numbers = itertools.count(1)


class LockstepError(RuntimeError):
    """Simulated time stands still. The text says when it does, and what node and controller have said last."""


def run(
    scene: str | os.PathLike[str],
    controller: Sequence[str | os.PathLike[str]],
    seconds: float,
    *,
    parameters: Mapping[str, Any] = MappingProxyType({}),
    bag: str | os.PathLike[str] | None = None,
    patience: float = PATIENCE,
) -> RecordedMotion:
    """The motion of a scene under a controller in the first ``seconds`` of simulated time: the same bits every time.

    rigid_body_node runs the scene, a parameter file, in lockstep, with ``parameters`` beside those of the file:
    ``lockstep_on`` and ``steps_per_command`` say what a command is. ``controller`` is a command line; ``--ros-args -r
    __ns:=/lockstep_...`` is put at its end, so that no other run is heard: its topics must be relative. It must ask
    for the state that the node keeps (durability TRANSIENT_LOCAL), or begin with a command.

    The node records into ``bag``, a folder that does not exist yet, or else into one that is removed afterwards. The
    bag goes on until both have ended, somewhat after ``seconds``; what is returned does not.

    Raises ChildError (``rigid_body_sim.tools.processes``) when one of the two ends by itself, LockstepError when
    simulated time stands still for ``patience`` [s], and ValueError for seconds that are not greater than zero. Needs
    rclpy and the extra ``bag``.
    """
    if not seconds > 0.0:
        raise ValueError(f"seconds = {seconds}: is not greater than zero")
    with tempfile.TemporaryDirectory() as folder, children() as running:
        path = Path(bag or Path(folder) / "bag").absolute()
        namespace = f"/lockstep_{os.getpid()}_{next(_numbers)}"
        given = Path(folder) / "lockstep.yaml"
        given.write_text(yaml.safe_dump(_parameters(parameters, path)), encoding="utf-8")
        in_namespace = ["--ros-args", "-r", f"__ns:={namespace}"]
        files = ["--params-file", str(Path(scene).absolute()), "--params-file", str(given)]
        pair = (
            running.start(NODE, [*in_namespace, *files]),
            running.run([*(os.fspath(word) for word in controller), *in_namespace]),
        )
        with _time_in(namespace) as simulated:
            _wait(pair, simulated, round(seconds * NANOSECONDS), patience)
        running.end()
        return recorded(path).until(seconds)


def _parameters(others: Mapping[str, Any], bag: Path) -> dict[str, Any]:
    return {"/**": {"ros__parameters": {**others, "lockstep": True, "record.path": str(bag)}}}


@contextmanager
def _time_in(namespace: str) -> Iterator[Any]:
    """A function: the stamp [ns] of the last pose heard in a namespace, waited for a moment; -1 before the first."""
    from geometry_msgs.msg import PoseStamped
    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    from ..ros.executor import executor_for

    heard, context = [-1], Context()
    context.init([])
    node = Node("lockstep", context=context)
    executor = executor_for(node)

    def on_pose(message: PoseStamped) -> None:
        heard[0] = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec

    # What it misses is in the bag; nobody waits for it.
    profile = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    node.create_subscription(PoseStamped, f"{namespace}/pose", on_pose, profile)

    def simulated() -> int:
        executor.spin_once(timeout_sec=_LOOK_EVERY)
        return heard[0]

    try:
        yield simulated
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()


def _wait(pair: Sequence[Child], simulated: Any, end_ns: int, patience: float) -> None:
    """Until simulated time has come to ``end_ns``."""
    last_ns, since = -1, time.monotonic()
    while last_ns < end_ns:
        for child in pair:
            child.check()
        if (now_ns := simulated()) != last_ns:
            last_ns, since = now_ns, time.monotonic()
        elif time.monotonic() - since > patience:
            where = "no pose has come" if last_ns < 0 else f"simulated time stands still at {last_ns / NANOSECONDS:g} s"
            said = "; ".join(f"{child.name} said last: {child.last_line()}" for child in pair)
            raise LockstepError(f"{where} for {patience:g} s; {said}")
