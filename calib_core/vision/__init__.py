"""What pictures show: the reflector's apex near a given pixel."""

from calib_core.vision.apex import Apex, NoApex, find_apex
from calib_core.vision.box_tracking import LostBox, TrackedBox, follow_box

__all__ = ["Apex", "LostBox", "NoApex", "TrackedBox", "find_apex", "follow_box"]
