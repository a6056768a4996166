"""Checks of a calibration file: the check point, the slips that explain a miss, another calibration, pairs."""
