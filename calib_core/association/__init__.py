"""Radar returns and clicks become pairs: gating, clustering, pairing, and the placements of a recording."""
