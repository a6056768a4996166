"""A recording and its calibration for the Rerun viewer; rerun-sdk is imported only here, and only when used."""

from app.rerun.sdk import NO_NETWORK, quiet_environment, require_sdk
from app.rerun.writing import WrittenView, write_view

__all__ = ["NO_NETWORK", "WrittenView", "quiet_environment", "require_sdk", "write_view"]
