"""Clicks or pairs of a recording become a calibration: by hand, without a person, and in the page's own thread."""
