"""Simulated pairs without a recording, what may be wrong with them, and the errors that they share."""
