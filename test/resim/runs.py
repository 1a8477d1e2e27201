"""Runs as a node makes them and a recorder sees them, without either: what is in their bags is known to the bit."""

from dataclasses import dataclass

import numpy as np

from rigid_body_sim import Simulation, commands
from rigid_body_sim.bags import journal
from rigid_body_sim.resim.journaled import JournaledSimulation

from ..bags import making

LATENCY_NS = 200_000  # from the node to the recorder
SCENE = {
    "rate": 500.0,
    "publish_rate": 50.0,
    "wrench.timeout": 0.1,
    "wrench.topics": ["wrench", "gust"],
    "body.mass": 2.0,
    "body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0],
    "body.center_of_mass": [0.01, -0.02, 0.03],
    "initial.orientation": {"w": 0.4, "x": 0.2, "y": -0.8, "z": 0.4},
    "initial.angular_velocity": [1.1, -2.0, 0.7],
    "gravity": [0.0, 0.0, -9.80665],
    "frames.hook.position": [0.1, 0.2, 0.3],
    "frames.hook.axes": "world",
}


@dataclass
class Send:
    """A command: simulated time [ns] at which it reaches the node, topic, frame, and force and torque."""

    at_ns: int
    frame_id: str
    numbers: tuple
    topic: str = "/wrench"
    stamp_ns: int | None = None  # in its header; None: as ``at_ns``
    raw: bool = False  # a Wrench, which has no header


def sends(scene, seconds, per_second=100.0, topic="/wrench", seed=3, frames=("base_link", "world", "hook", "")):
    """Random commands in the middle of steps, so that small errors of time do not change their step."""
    random = np.random.default_rng(seed)
    rate = scene["rate"]
    steps = np.unique(random.integers(0, int(seconds * rate), int(seconds * per_second)))
    return [
        Send(round((k + 0.5) * 1e9 / rate), frames[i % len(frames)], tuple(random.normal(size=6).tolist()), topic)
        for i, k in enumerate(steps.tolist())
    ]


def hold(simulation, scene, send):
    """As the node does."""
    if send.topic == "/actuator_commands":
        simulation.set_actuators(send.numbers, scene["wrench.timeout"] or None)
        return
    meaning = commands.meaning("" if send.raw else send.frame_id, scene, "wrench")
    wrench = commands.make_wrench(meaning, send.numbers[:3], send.numbers[3:], "wrench", limit(scene))
    simulation.set_wrench(wrench, scene["wrench.timeout"] or None, send.topic)


def advance(simulation, scene, begun, steps):
    """As the node does: without motion until something has ``begun`` it, where the scene has start_on_command."""
    (simulation.step if begun or not scene["start_on_command"] else simulation.wait)(steps)


def limit(scene):
    most = [scene[f"wrench.max_{what}"] or np.inf for what in ("force", "torque")]
    return lambda f, t: (commands.scaled_down(f, most[0]), commands.scaled_down(t, most[1]))


def message(send, epoch_ns):
    if send.topic == "/actuator_commands":
        return making.numbers(send.numbers)
    if send.raw:
        return making.wrench(send.numbers)
    stamp_ns = epoch_ns + send.at_ns if send.stamp_ns is None else send.stamp_ns
    return making.wrench_stamped(stamp_ns, send.frame_id, send.numbers)


def outputs(scene, simulation, epoch_ns, receive_ns):
    """Pose and twist of the present step, as the node sends them."""
    motion, stamp_ns = simulation.motion, epoch_ns + simulation.time_ns
    body = scene["twist_frame"] == "body"
    frame, twist = (scene["body.frame_id"], motion[13:19]) if body else (scene["world_frame_id"], motion[7:13])
    return [
        ("/pose", receive_ns, making.pose_stamped(stamp_ns, scene["world_frame_id"], motion[:7])),
        ("/twist", receive_ns + 1, making.twist_stamped(stamp_ns, frame, twist)),
    ]


def in_real_time(scene, given, seconds, *, lag_ns=0, factor=1.0, epoch_ns=making.EPOCH_NS):
    """What a recorder has of a run in real time, whose simulated time begins ``lag_ns`` after its epoch."""

    def wall(simulated_ns):
        return epoch_ns + lag_ns + round(simulated_ns / factor) + LATENCY_NS

    simulation, messages = Simulation.from_scene(scene), []
    waiting, begun = sorted(given, key=lambda send: send.at_ns), False
    for step in range(int(seconds * scene["rate"]) + 1):
        advance(simulation, scene, begun, step - simulation.steps)
        if step % scene.steps_per_publish == 0:
            messages += outputs(scene, simulation, epoch_ns, wall(simulation.time_ns))
        end_ns = (step + 1) * 1e9 / scene["rate"]
        while waiting and waiting[0].at_ns < end_ns:
            send = waiting.pop(0)
            hold(simulation, scene, send)
            begun = True
            messages.append((send.topic, wall(send.at_ns), message(send, epoch_ns)))
    return sorted(messages, key=lambda entry: entry[1])


def in_lockstep(scene, given):
    """The same in lockstep, the commands in the given order; a refused one advances nothing."""
    simulation, now_ns = Simulation.from_scene(scene), making.EPOCH_NS
    leading = "/actuator_commands" if "actuators" in scene["lockstep_on"] else "/wrench"
    messages = outputs(scene, simulation, 0, now_ns)
    for send in given:
        now_ns += 1_000_000
        messages.append((send.topic, now_ns, message(send, 0)))
        try:
            hold(simulation, scene, send)
        except (commands.RefusedError, ValueError):
            continue
        if send.topic == leading:
            simulation.step(scene["steps_per_command"])
            messages += outputs(scene, simulation, 0, now_ns + 300_000)
    return messages


def with_journal(scene, given, seconds, also=()):
    """What the node's own recorder has of a run in real time: the same, with its journal in place of the commands.

    ``also`` are calls at other times [ns]: (time, function of the simulation).
    """
    simulation, messages, now_ns = JournaledSimulation.from_scene(scene), [], making.EPOCH_NS + 7
    begun = False

    def note(step, call, values):
        nonlocal now_ns, begun
        begun = call in journal.COMMANDS or (begun and call != "reset")
        now_ns += 1
        messages.append(("/node/journal", now_ns, making.text(journal.text(now_ns, step, call, values))))

    note(0, journal.SCENE, journal.scene_values(scene, making.EPOCH_NS))
    simulation.journal = note
    calls = [(send.at_ns, lambda simulation, send=send: hold(simulation, scene, send)) for send in given]
    calls = sorted([*calls, *also], key=lambda entry: entry[0])
    for step in range(int(seconds * scene["rate"]) + 1):
        if step:
            advance(simulation, scene, begun, 1)
        if step % scene.steps_per_publish == 0:
            messages += outputs(scene, simulation, making.EPOCH_NS, now_ns + 1)
            now_ns += 2
        while calls and calls[0][0] < (step + 1) * 1e9 / scene["rate"]:
            calls.pop(0)[1](simulation)
    return messages


def stamp_ns(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def numbers_of(pose):
    p, q = pose.position, pose.orientation
    return p.x, p.y, p.z, q.w, q.x, q.y, q.z


def vectors_of(twist):
    return [getattr(part, axis) for part in (twist.linear, twist.angular) for axis in "xyz"]


def told_by(messages, pose, twist=None):
    """The same run with other messages in place of its poses, made by ``pose``, and of its twists."""
    told, last = [], None
    for topic, receive_ns, message in messages:
        if topic == "/pose":
            last = receive_ns, message
        elif topic == "/twist":
            told.append(pose(*last, message))
            told += [] if twist is None else [twist(receive_ns, message)]
        else:
            told.append((topic, receive_ns, message))
    return told


def odometry(child="base_link", topic="/odom", world="world"):
    """What makes an Odometry of a pose and a twist."""

    def made(receive_ns, pose, twist):
        values = numbers_of(pose.pose), vectors_of(twist.twist)
        return topic, receive_ns, making.odometry(stamp_ns(pose), world, child, *values)

    return made
