"""Our own files: calibration-1, pairs-1, clicks-1, and their schemas."""
