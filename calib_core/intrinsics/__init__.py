"""Calibrate a camera's lens from images of a board: K, distortion, and how well they are known."""
