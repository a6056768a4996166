"""Which of several transforms in a file is the one between the radar and the camera: one is, or the file is refused."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.imported import looks_like_camera, looks_like_radar

__all__ = ["Ends", "the_one_between"]


@dataclass(frozen=True, slots=True)
class Ends:
    """The two frames that a transform stands between."""

    parent: str
    child: str


def the_one_between(transforms: Sequence[Ends], stated: FrameNames | None, *, source: str) -> int:
    """Return the index of the transform between the radar and the camera; of a single one nothing is asked.

    Args:
        transforms: the frames of each, at least one.
        stated: what the file says in words about its frames, if it does.
        source: what to call the file in an error.

    Raises:
        InputError: none of several stands between a radar and a camera by its names, or more than one does.
    """
    if len(transforms) == 1:
        return 0
    fitting = [index for index, ends in enumerate(transforms) if _fits(ends, stated)]
    if len(fitting) == 1:
        return fitting[0]
    named = ", ".join(f"{ends.parent} to {ends.child}" for ends in transforms[:6])
    raise InputError(
        f"{source}: holds {len(transforms)} transforms ({named}), {len(fitting)} of them between a radar and a camera by name; "
        "keep the one that is meant"
    )


def _fits(ends: Ends, stated: FrameNames | None) -> bool:
    names = {ends.parent.lstrip("/"), ends.child.lstrip("/")}
    if stated is not None:
        return stated.radar in names and bool({stated.camera, stated.camera_link} & names)
    return any(map(looks_like_radar, names)) and any(map(looks_like_camera, names))
