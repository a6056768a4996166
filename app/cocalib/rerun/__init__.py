"""A recording and its calibration for the Rerun viewer; rerun-sdk is imported only here, and only when used."""

from cocalib.rerun.viewer import has_display, is_installed, open_window, require_display, require_sdk
from cocalib.rerun.writing import WrittenView, write_view

__all__ = ["WrittenView", "has_display", "is_installed", "open_window", "require_display", "require_sdk", "write_view"]
