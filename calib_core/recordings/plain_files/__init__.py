"""Recordings outside ROS containers: images, CSV, radar files and videos."""
