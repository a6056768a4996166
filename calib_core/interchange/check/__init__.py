"""Check a calibration file against its check point, another calibration or pairs, and find the slip behind a mismatch."""
