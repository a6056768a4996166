"""Formats for the intrinsics of a camera, one per file; `written` lists them."""
