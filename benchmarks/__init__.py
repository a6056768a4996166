"""Benchmarks: accuracy compared with other methods, speed as ratios within one run."""
