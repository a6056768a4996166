"""Measurements: accuracy against peers, speed as ratios within one run."""
