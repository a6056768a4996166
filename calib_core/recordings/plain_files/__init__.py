"""Recordings that are no ROS container: pictures, CSV, radar files and videos."""
