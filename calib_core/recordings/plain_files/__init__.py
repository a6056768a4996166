"""Recordings outside ROS containers: pictures, CSV, radar files and videos."""
