"""What our node is compared with: pose and twist at 1 kHz as rclpy's tutorials publish, without any physics."""

import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

PERIOD = 0.001  # s


class OrdinaryNode(Node):
    """A timer, and two typed messages in each call of it."""

    def __init__(self):
        super().__init__("ordinary_node")
        self._pose = self.create_publisher(PoseStamped, "pose", 10)
        self._twist = self.create_publisher(TwistStamped, "twist", 10)
        self.create_timer(PERIOD, self._on_timer)

    def _on_timer(self) -> None:
        pose, twist = PoseStamped(), TwistStamped()
        pose.header.stamp = twist.header.stamp = self.get_clock().now().to_msg()
        pose.header.frame_id, twist.header.frame_id = "world", "base_link"
        pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = 1.0, 2.0, 3.0
        pose.pose.orientation.x, pose.pose.orientation.w = 0.6, 0.8
        twist.twist.linear.x, twist.twist.linear.y, twist.twist.linear.z = 1.0, 2.0, 3.0
        twist.twist.angular.x, twist.twist.angular.y, twist.twist.angular.z = 0.1, 0.2, 0.3
        self._pose.publish(pose)
        self._twist.publish(twist)


def main() -> None:
    """Publish until Ctrl-C."""
    rclpy.init()
    executor = SingleThreadedExecutor()
    executor.add_node(OrdinaryNode())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
