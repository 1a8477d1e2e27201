"""Bags as files: written and read without ROS, by who knows of no simulation. rosbags tells types and their layout."""
