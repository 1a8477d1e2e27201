"""The measurements: each is a function of the seconds that it may measure for, and yields its figures."""

import functools
import json
import random
import statistics
import struct
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from geometry_msgs.msg import WrenchStamped
from rclpy.executors import Executor
from rclpy.node import Node
from std_srvs.srv import Trigger

from rigid_body_sim.ros import realtime
from rigid_body_sim.ros.executor import executor_for
from rigid_body_sim.ros.middleware import VARIABLES
from rigid_body_sim.scene.fleet import by_name, load_any
from rigid_body_sim.scene.installed import installed_scenes
from rigid_body_sim.tools.processes import ChildError

from . import usual_slack
from .bench import CONNECTED_WITHIN, OUR_NODE, SPINNING, UnderTest, commands, node_under_test, subscriber, wait_warm
from .fleets import fleet
from .record import AT_LEAST, AT_MOST, BELOW, Figure

ORDINARY = "bench.node_bench.ordinary_node"
USUAL_SLACK = "bench.node_bench.usual_slack"
TRACED = "bench.node_bench.traced_node"
PLAIN_START, STIFF_START, WARM_START = 5.0, 12.0, 1.0  # s, of two idle cores
ROUNDS = 3
WAKE_UPS = 1000  # in a round
EVERY_STEP = {"publish_rate": 0.0}  # publish each
COMMAND_RATE = 200.0  # Hz
ANSWERED_WITHIN = 20.0  # s; on a busy machine a real-time thread leaves the others little


# 1. Against an ordinary node ------------------------------------------------------------------------------------------


def ordinary(seconds: float) -> Iterator[Figure]:
    """CPU time for a published step at 1 kHz, beside an ordinary rclpy node that does no physics."""
    costs: dict[str, list[float]] = {OUR_NODE: [], ORDINARY: []}
    for _ in range(ROUNDS):
        for module, taken in costs.items():
            with node_under_test({**SPINNING, **EVERY_STEP} if module == OUR_NODE else {}, module) as node:
                taken.append(_cost_of_a_step(node, seconds / (2 * ROUNDS)))
    how = f"utime + stime of the process for each pose heard, 1 kHz, one listener; {ROUNDS} rounds in turn"
    ours, theirs = costs.values()
    yield Figure.median("CPU per published step, ours", ours, "us", how)
    yield Figure.median("CPU per published step, ordinary rclpy node", theirs, "us", how)
    ratios = [a / b for a, b in zip(ours, theirs, strict=True)]
    yield Figure.median("CPU per published step, ratio", ratios, "", "of each round", (AT_MOST, 1 / 3))


def _cost_of_a_step(node: UnderTest, seconds: float) -> float:
    """CPU time [us]."""
    wait_warm(node)
    cpu, poses = node.cpu_seconds(), node.ear.poses
    node.serve(seconds)
    return 1e6 * (node.cpu_seconds() - cpu) / max(1, node.ear.poses - poses)


# 2. Real time ---------------------------------------------------------------------------------------------------------


def steady(rate: float, seconds: float) -> Iterator[Figure]:
    """Integrate and publish at a fixed rate: what is lost, how late it is, and what it costs."""
    with node_under_test({**SPINNING, **EVERY_STEP, "rate": rate}) as node:
        wait_warm(node)
        yield from _steadiness(node, rate, seconds)


def _steadiness(node: UnderTest, rate: float, seconds: float) -> Iterator[Figure]:
    name, ear = f"{rate:g} Hz", node.ear
    ear.period_ns = round(1e9 / rate)
    reports, cpu = _reports(node, seconds)
    first, last = reports[0], reports[-1]
    steps = int(last["steps"]) - int(first["steps"])
    slipped = float(last["slipped time [s]"]) - float(first["slipped time [s]"])
    span = f"pose and twist of each step to one listener, {steps} steps"
    yield Figure(f"{name}: time given up", slipped * rate, "steps", f"slipped time x rate; {span}", (AT_MOST, 0.0))
    how = "gaps between the stamps of poses; no goal: a listener that falls behind loses messages by itself"
    yield Figure(f"{name}: steps that the listener missed", ear.missing, "steps", how)
    achieved = [float(report["achieved rate [Hz]"]) for report in reports[1:]]
    mean = statistics.mean(achieved) / rate - 1.0
    yield Figure(f"{name}: mean rate, error", 1e6 * abs(mean), "ppm", "mean of the diagnostics", (AT_MOST, 100.0))
    late = [1e6 * float(report["lateness p99 [s]"]) for report in reports[1:]]
    how = "lateness of publication against its deadline, as the node tells for each second; median of the seconds"
    yield Figure.median(f"{name}: p99 lateness", late, "us", how, (BELOW, 300.0))
    yield Figure(f"{name}: CPU", cpu, "%", "utime + stime of the process, all threads", (BELOW, 50.0))


def _reports(node: UnderTest, seconds: float) -> tuple[list[dict[str, str]], float]:
    """At least 2 diagnostics, ``seconds`` apart, and the CPU [%] used between the first and the last."""
    heard = node.ear.diagnostics
    heard.clear()
    node.serve_until(lambda: heard, ANSWERED_WITHIN, "diagnostics")
    cpu, began = node.cpu_seconds(), time.monotonic()
    node.serve(seconds)
    node.serve_until(lambda: len(heard) > 1, ANSWERED_WITHIN, "diagnostics")
    return heard, 100 * (node.cpu_seconds() - cpu) / (time.monotonic() - began)


def recording(seconds: float) -> Iterator[Figure]:
    """At 10 kHz, to one listener: what the node's own recorder costs the loop's thread, and what it loses."""
    ways = {"not recording": False, "recording": True}
    costs: dict[str, list[float]] = {way: [] for way in ways}
    late: dict[str, list[float]] = {way: [] for way in ways}
    dropped = 0
    with tempfile.TemporaryDirectory() as folder:
        for number, way in enumerate([*ways] * ROUNDS):
            path = {"record.path": f"{folder}/{number}"} if ways[way] else {}
            with node_under_test({**SPINNING, **EVERY_STEP, **path, "rate": 10000.0}) as node:
                wait_warm(node)
                reports, cost = _loop_thread(node, seconds / (len(ways) * ROUNDS))
            costs[way].append(cost)
            late[way] += [1e6 * float(report["lateness p99 [s]"]) for report in reports[1:]]
            dropped += int(reports[-1]["dropped"])
    how = f"schedstat of the loop's thread for each step, one listener; {ROUNDS} rounds in turn"
    for way in ways:
        yield Figure.median(f"10000 Hz, {way}: CPU of the loop's thread", costs[way], "us", how)
        yield Figure.median(f"10000 Hz, {way}: p99 lateness", late[way], "us", f"median of {len(late[way])} seconds")
    more = [b - a for a, b in zip(*costs.values(), strict=True)]
    yield Figure.median("10000 Hz, recording: CPU more", more, "us", "difference of each round", (BELOW, 10.0))
    yield Figure("10000 Hz, recording: messages dropped", dropped, "", "of the diagnostics", (AT_MOST, 0.0))


def _loop_thread(node: UnderTest, seconds: float) -> tuple[list[dict[str, str]], float]:
    """Diagnostics, and CPU time [us] of the loop's thread for each step between the first and the last."""
    heard = node.ear.diagnostics
    heard.clear()
    node.serve_until(lambda: heard, ANSWERED_WITHIN, "diagnostics")
    cpu = node.loop_seconds()
    node.serve(seconds)
    before = len(heard)
    node.serve_until(lambda: len(heard) > before, ANSWERED_WITHIN, "diagnostics")
    steps = int(heard[-1]["steps"]) - int(heard[0]["steps"])
    return heard, 1e6 * (node.loop_seconds() - cpu) / max(1, steps)


def wake_up(seconds: float) -> Iterator[Figure]:
    """What timer slack and real-time priority buy: each by itself, in the same run."""
    yield from _overshoot()
    ways = {
        "usual timer slack of 50 us": (USUAL_SLACK, 0),
        "timer slack of 1 ns, as the node sets it": (OUR_NODE, 0),
        "real-time priority 50, and usual slack": (USUAL_SLACK, 50),
        "real-time priority 50, slack of 1 ns": (OUR_NODE, 50),
    }
    found: dict[str, list[tuple[float, float]]] = {way: [] for way in ways}
    refused: dict[str, str] = {}
    for way, (module, priority) in [*ways.items()] * ROUNDS:
        if way not in refused:
            parameters = {**SPINNING, **EVERY_STEP, "rate": 10000.0, "realtime_priority": priority}
            with node_under_test(parameters, module) as node:
                found[way] += _promptness(node, seconds / (len(ways) * ROUNDS))
                if warnings := [line for line in node.process.said().split("\n") if "has no effect" in line]:
                    refused[way] = warnings[0]
    for way, pairs in found.items():
        if way in refused:
            yield Figure.missing(f"10000 Hz, {way}", refused[way])
            continue
        late, cpu = zip(*pairs, strict=True)
        yield Figure.median(f"10000 Hz, {way}: p99 lateness", late, "us", f"median of {len(late)} seconds")
        yield Figure.median(f"10000 Hz, {way}: CPU", cpu, "%", "of the same")


def _overshoot() -> Iterator[Figure]:
    """What a waiting executor loses on each call, in a thread of this process."""
    executor = executor_for(Node("sleeper"))
    found: dict[int, list[float]] = {slack: [] for slack in (usual_slack.USUAL_NS, 1)}
    with ThreadPoolExecutor(1) as thread:  # timer slack belongs to a thread, and this one is to keep its own
        for slack in [*found] * ROUNDS:
            found[slack] += thread.submit(_overshoots, executor, slack).result()
    executor.shutdown()
    for slack, late in found.items():
        how = f"spin_once(0.1 ms), by how much longer it takes; median of {len(late)} calls, spread of the middle half"
        quarters = tuple(np.percentile(late, (25, 75)).tolist())
        yield Figure(f"wake-up, timer slack {slack} ns", statistics.median(late), "us", how, spread=quarters)


def _overshoots(executor: Executor, slack_ns: int) -> list[float]:
    realtime.set_timer_slack(slack_ns)
    late = []
    for _ in range(WAKE_UPS):
        began = time.monotonic_ns()
        executor.spin_once(timeout_sec=1e-4)
        late.append((time.monotonic_ns() - began) / 1e3 - 100.0)
    return late


def _promptness(node: UnderTest, seconds: float) -> list[tuple[float, float]]:
    """Lateness [us] in each second, and the CPU [%] of the whole."""
    wait_warm(node)
    reports, cpu = _reports(node, seconds)
    return [(1e6 * float(report["lateness p99 [s]"]), cpu) for report in reports[1:]]


def middleware(seconds: float) -> Iterator[Figure]:
    """What our profile of Fast DDS buys: CPU with it and without, at a priority that a busy machine cannot delay."""
    parameters = {**SPINNING, **EVERY_STEP, "rate": 5000.0, "realtime_priority": 50}
    # Where whoever runs this has set none of the variables, the node takes our profile for the Fast DDS that it has.
    ways = {"no profile": dict.fromkeys(VARIABLES, ""), "the node's profile": {}}
    found: dict[str, list[float]] = {way: [] for way in ways}
    for way, environment in [*ways.items()] * ROUNDS:
        with node_under_test(parameters, environment=environment) as node:
            wait_warm(node)
            found[way].append(_reports(node, seconds / (2 * ROUNDS))[1])
    for way, cpu in found.items():
        yield Figure.median(f"5000 Hz, {way}: CPU", cpu, "%", f"all threads; {ROUNDS} rounds in turn")


# 3. As fast as possible -----------------------------------------------------------------------------------------------


def free(seconds: float) -> Iterator[Figure]:
    """Simulated seconds in a second, without pacing."""
    parameters = {**SPINNING, "real_time_factor": 0.0, "publish_rate": 100.0}
    with node_under_test(parameters, attentive=False) as node:
        wait_warm(node)
        yield from _factors(node, seconds / 2, "nobody listens", 2000.0)
        with subscriber(node):
            node.serve(1.0)
            yield from _factors(node, seconds / 2, "one subscriber", 500.0)


def _factors(node: UnderTest, seconds: float, who: str, goal: float) -> Iterator[Figure]:
    reports, cpu = _reports(node, seconds)
    factors = [float(report["real-time factor"]) for report in reports[1:]]
    how = "rate 1000, publish_rate 100; from the diagnostics, median of the seconds"
    yield Figure.median(f"real-time factor, {who}", factors, "", how, (AT_LEAST, goal))
    per_cpu = 100.0 * statistics.mean(factors) / cpu
    yield Figure(f"simulated seconds in a CPU second, {who}", per_cpu, "", "of the same, all threads counted")


# 4. From command to motion --------------------------------------------------------------------------------------------


class Push:
    """Pushes a body at rest and notes when its pose first shows that; then has it put back."""

    _x = struct.Struct("<d").unpack_from

    def __init__(self, node: UnderTest):
        self._node = node
        self._publish = commands(node)
        self._reset = node.ear.create_client(Trigger, "rigid_body_node/reset")
        self._wrench = WrenchStamped()
        self._wrench.wrench.force.x = 1.0
        self._moved_ns: int | None = None
        self._at_rest = 0
        node.ear.on_pose = self._on_pose

    def _on_pose(self, data: bytes) -> None:
        if self._x(data, len(data) - 56)[0] == 0.0:  # the last 7 doubles are position and quaternion
            self._at_rest += 1
        else:
            self._at_rest = 0
            if self._moved_ns is None:
                self._moved_ns = time.monotonic_ns()

    def milliseconds(self) -> float:
        """From the call of publish to the arrival of the first pose that has moved."""
        node = self._node
        answer = self._reset.call_async(Trigger.Request())
        node.serve_until(answer.done, ANSWERED_WITHIN, "answer to reset")
        self._at_rest = 0
        node.serve_until(lambda: self._at_rest > 5, ANSWERED_WITHIN, "pose at rest")
        node.serve(random.uniform(0.0, 0.002))  # else commands would come at the same time in each step
        self._moved_ns, began_ns = None, time.monotonic_ns()
        self._publish(self._wrench)
        node.serve_until(lambda: self._moved_ns, ANSWERED_WITHIN, "pose that moved")
        return (self._moved_ns - began_ns) / 1e6


def command(seconds: float) -> Iterator[Figure]:
    """Time from publishing a wrench in this process to the first pose that shows it, at 1 kHz."""
    with node_under_test(EVERY_STEP) as node:
        wait_warm(node)
        push = Push(node)
        push.milliseconds()  # the first one waits for the service to be discovered
        end, taken = time.monotonic() + seconds, []
        while time.monotonic() < end or len(taken) < 5:
            taken.append(push.milliseconds())
    parts = ", ".join(f"{part} % {np.percentile(taken, part):.2f} ms" for part in (5, 25, 75, 95, 99))
    how = f"{len(taken)} pushes at random times within a step, Python's own time here included; {parts}"
    yield Figure.median("command to motion", taken, "ms", how, (BELOW, 2.0))


# 5. Start -------------------------------------------------------------------------------------------------------------


def start(seconds: float) -> Iterator[Figure]:
    """From the start of the process until it can publish, and to the first pose heard; compiled kernels are cached."""
    with node_under_test({}) as node:  # fills the cache where it is empty
        node.serve_until(lambda: node.ear.poses, CONNECTED_WITHIN, "pose")
    ready, heard, used = [], [], []
    end = time.monotonic() + seconds / 3
    while len(ready) < 3 or (time.monotonic() < end and len(ready) < 9):
        with node_under_test({}) as node:
            node.serve_until(lambda node=node: "ready: " in node.process.said(), CONNECTED_WITHIN, "readiness")
            ready.append(time.monotonic() - node.began)
            used.append(node.cpu_seconds())
            node.serve_until(lambda node=node: node.ear.poses, CONNECTED_WITHIN, "pose")
            heard.append(time.monotonic() - node.began)
    how = f"{len(ready)} starts, until the node says that it is ready"
    yield Figure.median("start to the first pose published, warm cache", ready, "s", how, (BELOW, 2.0))
    how = "the same starts; a Fast DDS participant may learn of another only when that announces itself, every 3 s"
    yield Figure.median("start to the first pose heard, warm cache", heard, "s", how)
    yield Figure.median("start to the first pose published, CPU", used, "s", "which a busy machine does not change")


def cold_start(_: float) -> Iterator[Figure]:
    """By scene: from the start of the process until it can publish, with an empty cache and with what that left."""
    for path in installed_scenes():
        with tempfile.TemporaryDirectory() as folder:
            environment = {"XDG_CACHE_HOME": folder, "NUMBA_CACHE_DIR": folder}
            cold, told = _start_of(path, environment)
            warm, again = _start_of(path, environment)
        if told is None or again is not None:
            yield Figure.missing(f"cold start: {path.stem}", "kernels were not compiled, or compiled again (no numba?)")
            continue
        loaded = any(one.terms().loads for one in by_name(load_any(path)).values())
        goal = STIFF_START if loaded else PLAIN_START
        how = f"one start; that kernels are compiled was said after {told:.2f} s"
        yield Figure(f"cold start: {path.stem}", cold, "s", how, (AT_MOST, goal))
        yield Figure(f"warm start: {path.stem}", warm, "s", "the next start", (AT_MOST, WARM_START))


def _start_of(scene: Path, environment: dict[str, str]) -> tuple[float, float | None]:
    """Time [s] until a node of the scene says that it is ready, and until it says that it compiles."""
    told = None
    with node_under_test({}, scene=scene, attentive=False, environment=environment) as node:
        node.serve_until(lambda: {"compiling kernels", "ready: "} & said(node), CONNECTED_WITHIN, "announcement")
        if "compiling kernels" in said(node):
            told = time.monotonic() - node.began
        node.serve_until(lambda: "ready: " in said(node), 2 * CONNECTED_WITHIN, "readiness")
        return time.monotonic() - node.began, told


def said(node: UnderTest) -> set[str]:
    """Which of the sentences about its start a node has said."""
    return {sentence for sentence in ("compiling kernels", "ready: ") if sentence in node.process.said()}


# 6. Memory ------------------------------------------------------------------------------------------------------------


def memory(seconds: float) -> Iterator[Figure]:
    """Memory of the process under 200 commands a second at 1 kHz, and what the loop leaves behind by tracemalloc."""
    with node_under_test(EVERY_STEP) as node:
        wait_warm(node)
        resident = list(_under_commands(node, seconds, node.resident_kb))
    times, sizes = zip(*resident, strict=True)
    slope = float(np.polyfit(times, sizes, 1)[0]) if len(times) > 1 else 0.0
    how = f"least squares through {len(sizes)} readings in {times[-1]:.0f} s, {sizes[0]} kB first, {sizes[-1]} kB last"
    yield Figure("resident memory, growth", slope, "kB/s", how, (AT_MOST, 1.0))
    yield from _traced(seconds / 2)


def _under_commands(node: UnderTest, seconds: float, look: Callable[[], float]) -> Iterator[tuple[float, float]]:
    """Send a wrench 200 times a second; (time, ``look()``) twelve times in all."""
    publish, wrench = commands(node), WrenchStamped()
    began = time.monotonic()
    looks = 0
    for sent in range(round(seconds * COMMAND_RATE)):
        wrench.wrench.torque.z = 1e-3 * (-1) ** sent
        publish(wrench)
        due = began + sent / COMMAND_RATE
        node.serve(max(0.0, due - time.monotonic()))
        if time.monotonic() - began >= looks * seconds / 11:
            looks += 1
            yield time.monotonic() - began, look()


def _traced(seconds: float) -> Iterator[Figure]:
    """tracemalloc makes the loop several times slower, so it has a process of its own."""
    with node_under_test(EVERY_STEP, TRACED, leading=(str(max(1.0, seconds)),)) as node:
        try:
            for _ in _under_commands(node, CONNECTED_WITHIN, lambda: 0):
                pass
        except ChildError:  # it ends by itself
            pass
        lines = [line for line in node.process.said().split("\n") if line.startswith("{")]
    if not lines:
        yield Figure.missing("memory held by the loop", "the traced node gave no result")
        return
    grown = json.loads(lines[-1])
    how = f"tracemalloc over {grown['steps']} steps, {grown['bytes']} B in {grown['blocks']} blocks; {grown['lines']}"
    per_step = grown["bytes"] / max(1, grown["steps"])
    yield Figure("memory held by the loop, growth", per_step, "B/step", how, (AT_MOST, 0.1))


MEASUREMENTS = {
    "ordinary": ordinary,
    "10khz": functools.partial(steady, 10000.0),
    "1khz": functools.partial(steady, 1000.0),
    "recording": recording,
    "wake_up": wake_up,
    "middleware": middleware,
    "free": free,
    "command": command,
    "start": start,
    "cold_start": cold_start,
    "memory": memory,
    "fleet": fleet,
}


def measure(name: str, seconds: float) -> Iterable[Figure]:
    """The figures of one measurement; what could not be measured is one figure with the reason."""
    try:
        yield from MEASUREMENTS[name](seconds)
    except (ChildError, TimeoutError) as reason:
        yield Figure.missing(name, reason)
