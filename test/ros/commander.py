"""Somebody who commands a node, as a process: ``python commander.py namespace rate force_x [reliability]``.

It sends forces along x in the world's frame, so many a second (0: one alone, and then it stays), and prints "sending"
when the first is out. Bytes, made once: what is measured is the node, not its commander. SIGTERM ends it.
"""

import signal
import sys
import time

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message


def message(force_x):
    wrench = WrenchStamped()
    wrench.header.frame_id = "world"
    wrench.wrench.force.x = force_x
    return bytes(serialize_message(wrench))


def main(namespace, rate, force_x, reliability="RELIABLE"):
    rclpy.init(signal_handler_options=rclpy.SignalHandlerOptions.NO)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    node = Node("commander", namespace=namespace)
    try:
        command(node, float(rate), float(force_x), reliability)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def command(node, rate, force_x, reliability):
    quality = QoSProfile(depth=10, reliability=ReliabilityPolicy[reliability])
    publisher = node.create_publisher(WrenchStamped, "wrench", quality)
    data = message(force_x)
    while reliability == "RELIABLE" and not publisher.get_subscription_count():
        time.sleep(0.01)
    publisher.publish(data)
    print("sending", flush=True)
    send_on(publisher, data, rate)


def send_on(publisher, data, rate):
    """Until SIGTERM."""
    start, sent = time.monotonic(), 0
    while True:
        due = int((time.monotonic() - start) * rate)
        for _ in range(due - sent):
            publisher.publish(data)
        sent = due
        time.sleep(0.0005 if rate else 0.1)


if __name__ == "__main__":
    main(*sys.argv[1:])
