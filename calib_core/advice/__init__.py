"""What to do with a calibration: where the next placement pays, and the radar's own angle errors as a map."""
