"""A simulated fleet with known truth, and what it costs to calibrate it on the engines."""
