"""Simulated fleets: their mathematics at the level of poses, and whole batches of recordings."""
