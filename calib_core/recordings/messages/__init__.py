"""Parse ROS message definitions and decode messages."""
