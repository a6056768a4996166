"""Simulation: scenes, sensors and recordings with a known camera_from_radar, for tests and benchmarks."""
