"""Choose the transform between the radar and the camera among several in a file, or refuse the file."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.format import looks_like_camera, looks_like_radar


@dataclass(frozen=True, slots=True)
class Ends:
    """The two frames of a transform."""

    parent: str
    child: str


def choose_transform(transforms: Sequence[Ends], stated: FrameNames | None, *, source: str) -> int:
    """Return the index of the transform between the radar and the camera; a single one is taken as it is.

    Args:
        transforms: the frames of each, at least one.
        stated: the frames that the file states in a comment, if it does.
        source: the name of the file in error messages.

    Raises:
        InputError: of several, none is between a radar and a camera by its frame names, or more than one is.
    """
    if len(transforms) == 1:
        return 0
    fitting = [index for index, ends in enumerate(transforms) if _fits(ends, stated)]
    if len(fitting) == 1:
        return fitting[0]
    named = ", ".join(f"{ends.parent} to {ends.child}" for ends in transforms[:6])
    raise InputError(
        f"{source}: contains {len(transforms)} transforms ({named}), {len(fitting)} of them between a radar and a camera by "
        "name; keep only the intended one"
    )


def _fits(ends: Ends, stated: FrameNames | None) -> bool:
    names = {ends.parent.lstrip("/"), ends.child.lstrip("/")}
    if stated is not None:
        return stated.radar in names and bool({stated.camera, stated.camera_link} & names)
    return any(map(looks_like_radar, names)) and any(map(looks_like_camera, names))
