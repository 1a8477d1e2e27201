"""How messages lie in bytes: stated once, for the node and for bags. No ROS."""
