"""The joint that a file states in its comment: the camera in the frame that the file poses, when its driver publishes it."""

import json
import re

import numpy as np

from calib_core.interchange.imported import WrittenPose
from calib_core.interchange.trees.joint import Joint, Place

_STRING = r'"(?:[^"\\]|\\.)*"'
_FIXED = re.compile(rf"; ({_STRING}) is fixed in ({_STRING}) at x y z qx qy qz qw \[([^\]]*)\]")


def stated_joint(text: str, source: str) -> Joint | None:
    """Return the camera's pose in the frame that a file poses, as its comment states it; None if it states none."""
    match = _FIXED.search(text)
    if match is None:
        return None
    try:
        numbers = np.array(match[3].split(","), dtype=np.float64)
        written = WrittenPose("quaternion_xyzw", numbers[3:], numbers[:3], "radar_from_camera")
        place = Place(source, text.count("\n", 0, match.start()) + 1)
        return Joint.posed(json.loads(match[2]), json.loads(match[1]), written, place)
    except ValueError:
        return None
