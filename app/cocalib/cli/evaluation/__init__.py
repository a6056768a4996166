"""The commands that judge a calibration on a recording."""
