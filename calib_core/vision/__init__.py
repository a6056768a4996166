"""What pictures show: the reflector's apex near a given pixel."""

from calib_core.vision.apex import Apex, NoApex, find_apex

__all__ = ["Apex", "NoApex", "find_apex"]
