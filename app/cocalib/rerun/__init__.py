"""A recording and its calibration for the Rerun viewer; rerun-sdk is imported only here, and only when used."""

from cocalib.rerun.sdk import require_sdk
from cocalib.rerun.viewer import open_window, require_display
from cocalib.rerun.writing import WrittenView, write_view

__all__ = ["WrittenView", "open_window", "require_display", "require_sdk", "write_view"]
