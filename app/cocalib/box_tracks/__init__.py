"""Boxes of the session through the frames: which stretches are followed in the pictures, and what comes of it."""
