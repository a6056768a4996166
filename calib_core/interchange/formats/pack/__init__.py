"""The deployment pack: a zip archive of everything that a robot needs of a calibration, with a self-test of its own."""
