"""Association of clicks with radar returns: gating, clustering, pairing, and the placements of a recording."""
