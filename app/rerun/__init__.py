"""A recording and its calibration for the Rerun viewer; rerun-sdk is imported only here, and only when used."""

from app.rerun.native_viewer import open_window, require_display
from app.rerun.sdk import require_sdk
from app.rerun.writing import WrittenView, write_view

__all__ = ["WrittenView", "open_window", "require_display", "require_sdk", "write_view"]
