"""Advice from a calibration: where the next placement helps most, and a map of the radar's angle errors."""
