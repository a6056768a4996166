"""The 3D view of one tab, drawn in viser."""
