"""The files in which labelling tools and detectors keep boxes, one module each, and their registry."""
