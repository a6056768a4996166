"""The report: one self-contained HTML file that says how good a calibration is, where, and how one knows."""
