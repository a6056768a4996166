"""Boxes around objects, from the files of labelling tools, from topics of a recording, and from a fixed rig's pictures."""
