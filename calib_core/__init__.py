"""Radar-camera calibration: clicks and radar returns go in, camera_from_radar comes out."""
