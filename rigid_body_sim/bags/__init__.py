"""Bags: what they hold, written and read without ROS. CDR and the layout of rosbag2 come from the library rosbags."""
