"""What a published and a received message cost, as bytes and typed: ``python -m bench.message_cost``.

CPU time; the candidates take turns in one run, so that they see the same machine, and a figure is the median over
rounds. Publishing is measured without a listener: what the middleware does for one is the same for both.
"""

import platform
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message

from rigid_body_sim.command_line import takes_nothing
from rigid_body_sim.ros import messages, templates
from rigid_body_sim.ros.executor import executor_for
from rigid_body_sim.ros.outputs import Channel, Motion, Outputs
from rigid_body_sim.ros.wrench_reader import WrenchReader
from rigid_body_sim.scene.loader import Scene
from rigid_body_sim.simulation import Simulation

ROUNDS = 15
CALLS = 1000
SCENE = {"outputs": ("odom", "accel", "imu", "wrench_applied", "marker", "clock")}
TOPIC = "message_cost"
SENSOR = "cost_imu"
IMU = {
    "type": "imu",
    "position": [0.0, 0.0, 0.02],
    "gyroscope": {"noise_density": 4.887e-5, "random_walk": 2e-5, "quantization": 0.0010642, "range": 34.9066},
    "accelerometer": {"noise_density": 6.8647e-4, "random_walk": 1e-4, "quantization": 0.0047884, "range": 156.9064},
}


def costs(*parts: Callable[[], object]) -> list[float]:
    """CPU time [µs] of a call of each part: median over rounds."""
    rounds: list[list[float]] = [[] for _ in parts]
    for _ in range(ROUNDS):
        for part, taken in zip(parts, rounds, strict=True):
            begin = time.thread_time_ns()
            for _ in range(CALLS):
                part()
            taken.append((time.thread_time_ns() - begin) / (1000 * CALLS))
    return [statistics.median(taken) for taken in rounds]


def publish_costs(channel: Channel, node: Node, motion: Motion) -> list[float]:
    """Of writing and publishing one output typed, as bytes through ``publish``, and as the node does it."""
    output = channel.output
    values = output.values(motion)
    publisher = node.create_publisher(type(output.message), TOPIC + output.topic.strip("/"), output.depth)
    template = templates.Template(output.message, output.fields, output.stamp)
    typed = templates.Typed(output.message, output.fields, output.stamp)
    return costs(
        lambda: publisher.publish(typed.write(1, values)),
        lambda: publisher.publish(template.write(1, values)),
        lambda: channel.publish(1, motion),
    )


def receive_cost(node: Node, data: bytes, raw: bool, read: Callable[[Any], object]) -> float:
    """CPU time [µs] in ``spin_once`` for one WrenchStamped, taken raw or typed and then read: median."""
    receiver, read_count = Node(f"receiver_{'raw' if raw else 'typed'}"), [0]

    def on_message(message: object) -> None:
        read(message)
        read_count[0] += 1

    receiver.create_subscription(WrenchStamped, TOPIC, on_message, 10, raw=raw)
    publisher = node.create_publisher(WrenchStamped, TOPIC, 10)
    executor, taken = executor_for(receiver), []
    while publisher.get_subscription_count() == 0:
        executor.spin_once(timeout_sec=0.01)
    for _ in range(CALLS):
        before = read_count[0]
        publisher.publish(data)
        begin = time.thread_time_ns()
        while read_count[0] == before:
            executor.spin_once(timeout_sec=0.1)
        taken.append((time.thread_time_ns() - begin) / 1000)
    executor.shutdown()
    receiver.destroy_node()
    node.destroy_publisher(publisher)
    return statistics.median(taken)


def sensing_costs(node: Node) -> list[float]:
    """CPU time [µs] of a step as it is, as the node takes it without sensors, and with an IMU that measures at each.

    The IMU has the noise of quadrotor.yaml and a random walk, after a million samples, and a listener.
    """
    taken, kept = [], []
    for scene in (Scene(), Scene({"sensors": {SENSOR: IMU}})):
        simulation = Simulation.from_scene(scene)
        simulation.step(1_000_000)
        outputs = Outputs(node, scene, simulation)
        kept.append(outputs)  # with its publishers
        taken += [simulation.step, outputs.passing(simulation.step, partial(getattr, simulation, "time_ns"))]
    listener = Node("sensed")
    kind = type(kept[1].channels[0].output.message)
    listener.create_subscription(kind, SENSOR, lambda _: None, 10)
    while kept[1].channels[0].listeners == 0:
        kept[1].count_listeners()
        time.sleep(0.01)
    bare, through, _, sensed = costs(*(partial(step, 1) for step in taken))
    listener.destroy_node()
    return [bare, through, sensed]


def main(args: Sequence[str] | None = None) -> int:
    """Print all figures with the machine's name."""
    takes_nothing("message_cost", "Measures what it costs to publish, read and receive messages.", args)
    rclpy.init()
    node, scene = Node("message_cost"), Scene(SCENE)
    simulation = Simulation.from_scene(scene)
    outputs, motion, reader = Outputs(node, scene, simulation), Motion(simulation), WrenchReader(scene)
    print(f"{platform.node()}, {platform.machine()}, Python {platform.python_version()}; CPU time in us")
    print("\nPublished      typed  bytes  as the node does, values included")
    for channel in outputs.channels:
        typed, sent, whole = publish_costs(channel, node, motion)
        print(f"{channel.output.topic:14s} {typed:5.1f}  {sent:5.1f}  {whole:5.1f}")
    (quiet,) = costs(lambda: outputs.publish(1))
    print(f"all of them when nobody listens: {quiet:.2f}")
    data = bytes(serialize_message(WrenchStamped()))
    by_offset, typed = costs(
        lambda: reader.read(data), lambda: messages.read_wrench(deserialize_message(data, WrenchStamped), scene)
    )
    print(f"\nRead           typed {typed:.1f}, by offset {by_offset:.1f}")
    typed = receive_cost(node, data, False, lambda message: messages.read_wrench(message, scene))
    raw = receive_cost(node, data, True, reader.read)
    print(f"Received       typed {typed:.1f}, raw {raw:.1f}")
    bare, through, sensed = sensing_costs(node)
    print(f"\nA step         by itself {bare:.2f}, in the node without sensors {through:.2f}, with an IMU {sensed:.2f}")
    print(f"A message      of that IMU, measured and sent to a listener: {sensed - bare:.1f}")
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
