"""Our own files: calibration-1, pairs-1, clicks-1, the keys of boxes-1 and labels-1, and their schemas."""
