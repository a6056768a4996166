"""Calibrations in the formats of other tools, reader beside writer, and the registry of them."""
