"""ROS messages: definitions parsed, values read from bytes."""
