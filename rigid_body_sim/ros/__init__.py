"""The ROS 2 node: the only place that imports rclpy, with the ROS side of the tools."""
