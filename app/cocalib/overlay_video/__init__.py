"""The camera's frames as a video with what the radar saw, what was clicked and what was detected drawn over them."""

from cocalib.overlay_video.writing import OverlayOptions, WrittenOverlay, write_overlay

__all__ = ["OverlayOptions", "WrittenOverlay", "write_overlay"]
