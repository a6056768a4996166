"""The fields of the export panel in a URL: frame names, the radar's pose in a third frame, rectified pictures."""

from dataclasses import dataclass
from typing import Literal
from urllib.parse import parse_qs

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange import FrameNames, parent_pose

Field = Literal["frames", "parent", "rectified"]
"""A part of the panel that the user fills in."""

_RADAR_FRAME, _CAMERA_FRAME, _PARENT, _RECTIFIED = "radar_frame", "camera_frame", "parent_from_radar", "rectified"


class FieldError(InputError):
    """What is in a field cannot be used, or the format needs it filled in.

    Attributes:
        field: which one.
    """

    def __init__(self, field: Field, reason: str) -> None:
        super().__init__(reason)
        self.field: Field = field


@dataclass(frozen=True, slots=True)
class Fields:
    """What the user filled in.

    Attributes:
        frames: the names to write.
        parent_from_radar: the radar's pose in a third frame; None for the radar as origin.
        rectified: the pictures are rectified.
    """

    frames: FrameNames
    parent_from_radar: RigidTransform | None
    rectified: bool


def fields_in(query: str, usual: FrameNames) -> Fields:
    """Return the fields in the query of a URL.

    Args:
        query: `radar_frame=`, `camera_frame=`, `parent_from_radar=x,y,z,qx,qy,qz,qw` and `rectified=1`, each optional.
        usual: the calibration's frame names, for what the query does not name.

    Raises:
        FieldError: a name cannot be a frame's, a pose is none, or rectified is neither 0 nor 1.
    """
    given = {key: values[-1] for key, values in parse_qs(query, keep_blank_values=True).items()}
    try:
        frames = FrameNames(given.get(_RADAR_FRAME, usual.radar), given.get(_CAMERA_FRAME, usual.camera))
    except InputError as error:
        raise FieldError("frames", str(error)) from None
    return Fields(frames, _parent_in(given.get(_PARENT, "")), _rectified_in(given.get(_RECTIFIED, "0")))


def _parent_in(text: str) -> RigidTransform | None:
    if not text:
        return None
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        raise FieldError("parent", f"{_PARENT}: {text!r} is not seven numbers") from None
    try:
        return parent_pose(numbers)
    except InputError as error:
        raise FieldError("parent", str(error)) from None


def _rectified_in(text: str) -> bool:
    if text not in ("0", "1"):
        raise FieldError(
            "rectified", f"{_RECTIFIED}: {text!r} is neither 0 nor 1; 1 means that the pictures are rectified"
        )
    return text == "1"
