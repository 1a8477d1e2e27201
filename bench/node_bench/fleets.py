"""Many bodies: in one node, and in as many nodes. Poses and twists of all are heard by one other process, as bytes."""

import contextlib
import math
import time
from collections.abc import Generator, Iterator, Mapping
from pathlib import Path
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped

from rigid_body_sim import first_start
from rigid_body_sim.scene import parameter_file
from rigid_body_sim.scene.installed import installed_scene
from rigid_body_sim.scene.loader import DEFAULT_NODE

from .bench import CONNECTED_WITHIN, DEEP_QUEUE, WARM_UP, UnderTest, node_under_test
from .record import AT_LEAST, AT_MOST, Figure

BODIES, MANY, NODES = 100, 1000, 20
SETTLED = 3.0  # s in which all subscriptions are matched
CORES, MEGABYTES = 1.0, 300.0  # of one node with BODIES
CPU_SHARE, MEMORY_SHARE = 1 / 10, 1 / 20  # of as many nodes
START = 2.0  # s with a warm cache


class _Heard:
    """Counts what is heard of some bodies, and which publications are missing."""

    def __init__(self, node: UnderTest, spaces: list[str]):
        self.count = 0
        for space in spaces:
            for kind, topic in ((PoseStamped, "pose"), (TwistStamped, "twist")):
                node.ear.create_subscription(kind, f"{space}{topic}", self._hear, DEEP_QUEUE, raw=True)

    def _hear(self, _: bytes) -> None:
        self.count += 1


def fleet(seconds: float) -> Iterator[Figure]:
    """One node of 100 bodies beside 20 nodes, and one of 1000 bodies."""
    cpu, memory = yield from _one_node(BODIES, {}, seconds, published=100.0)
    each_cpu, each_memory = _nodes(seconds)
    how = f"{NODES} nodes of one body each in one run, {each_cpu:.3f} cores and {each_memory:.0f} MB each"
    yield Figure("fleet: CPU, of that of as many nodes", cpu / (BODIES * each_cpu), "", how, (AT_MOST, CPU_SHARE))
    share = memory / (BODIES * each_memory)
    yield Figure("fleet: memory, of that of as many nodes", share, "", f"{how}, PSS", (AT_MOST, MEMORY_SHARE))
    yield from _one_node(MANY, {"rate": 100.0, "publish_rate": 20.0}, seconds, published=20.0)


def _one_node(
    bodies: int, parameters: dict[str, object], seconds: float, published: float
) -> Generator[Figure, None, tuple[float, float]]:
    """Figures of one node of so many bodies; returns its share of a core and its memory [MB]."""
    given = {"bodies.count": bodies, "bodies.prefix": "crate_", **parameters}
    names = [f"crate_{i}/" for i in range(bodies)]
    scene = installed_scene("fleet")
    _fill_cache({**parameter_file.of_scene(scene, DEFAULT_NODE), **given})
    with node_under_test(given, attentive=False, scene=scene) as node:
        node.serve_until(lambda: "ready: " in node.process.said(), CONNECTED_WITHIN, "readiness")
        ready = time.monotonic() - node.began
        heard = _Heard(node, names)
        node.serve_until(lambda: heard.count > 2 * bodies, CONNECTED_WITHIN, "poses of all")
        node.serve(SETTLED + WARM_UP)
        before, cpu, begin = heard.count, node.cpu_seconds(), time.monotonic()
        slipped = _slipped(node)
        node.serve(seconds / 3)
        took = time.monotonic() - begin
        cores, rate = (node.cpu_seconds() - cpu) / took, (heard.count - before) / took
        memory, lost = _pss(node.process.pid), _slipped(node) - slipped
    wanted = 2 * bodies * published
    how = f"{bodies} bodies, {took:.0f} s, heard by one other process"
    yield Figure(f"fleet of {bodies}: CPU", cores, "cores", how, (AT_MOST, CORES))
    yield Figure(f"fleet of {bodies}: memory", memory, "MB", "PSS", (AT_MOST, MEGABYTES) if bodies == BODIES else None)
    yield Figure(f"fleet of {bodies}: messages heard", rate, "1/s", f"of {wanted:g}", (AT_LEAST, 0.99 * wanted))
    yield Figure(f"fleet of {bodies}: time given up", lost, "s", how, (AT_MOST, 0.0))
    goal = (AT_MOST, START) if bodies == BODIES else None
    yield Figure(f"fleet of {bodies}: start, warm cache", ready, "s", "until it says that it is ready", goal)
    return cores, memory


def _fill_cache(given: Mapping[str, Any]) -> None:
    """With all that the node compiles, in the background, too: beside that nothing is measured."""
    now, later = first_start.of_parameters(given)
    first_start.compile_together([*now, *later])


def _slipped(node: UnderTest) -> float:
    """Simulated time [s] by which the node is behind, as it says itself."""
    node.serve_until(lambda: node.ear.diagnostics, CONNECTED_WITHIN, "diagnostics")
    return float(node.ear.diagnostics[-1]["slipped time [s]"])


def _pss(pid: int) -> float:
    """Memory of a process [MB]: what it shares with others counts as its share."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1000


def _nodes(seconds: float) -> tuple[float, float]:
    """Cores and memory [MB] of one of many nodes of one body, all at work and heard."""
    with contextlib.ExitStack() as stack:
        nodes = [stack.enter_context(node_under_test({}, attentive=False)) for _ in range(NODES)]
        for node in nodes:
            node.serve_until(lambda node=node: "ready: " in node.process.said(), CONNECTED_WITHIN, "readiness")
        heard = [_Heard(node, [""]) for node in nodes]
        for node, one in zip(nodes, heard, strict=True):
            node.serve_until(lambda one=one: one.count, CONNECTED_WITHIN, "a pose")
        begin, before = time.monotonic(), [node.cpu_seconds() for node in nodes]
        while time.monotonic() < begin + seconds / 3:
            for node in nodes:
                node.serve(0.005)
        took = time.monotonic() - begin
        used = [node.cpu_seconds() - cpu for node, cpu in zip(nodes, before, strict=True)]
        memory = [_pss(node.process.pid) for node in nodes]
    return math.fsum(used) / NODES / took, math.fsum(memory) / NODES
