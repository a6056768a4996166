"""Read the calibration that the page shows until the clicks give a new one, and the camera in it."""

from pathlib import Path
from typing import TYPE_CHECKING

from app.hypothesis_sheet import Offer, OpenMeaning
from app.opening.choice import MeaningPick
from app.view import Reference
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.interchange import adopted_calibration, calibration_bytes, read_any
from calib_core.interchange.hypotheses.ranking import clear_one, hypotheses_of, likely_ones
from calib_core.interchange.hypotheses.reading import as_imported, picked, read_unstated

if TYPE_CHECKING:
    from calib_core.interchange import ImportedCalibration

__all__ = ["camera_in", "camera_of", "reference_from"]

_NOTHING_PICKED = MeaningPick()
_MOST_POSES, _MOST_OFFERS = 4, 12


def camera_of(found: "ImportedCalibration", path: Path, size_px: tuple[int, int]) -> Camera | None:
    """Return the camera of a calibration for pictures of a size; None if it has none.

    Raises:
        InputError: its matrix is not a camera's.
    """
    try:
        return found.camera_for(size_px)
    except ValueError as error:
        raise InputError(f"{path}: {error}; give the intrinsics with --camera FILE") from None


def camera_in(path: Path, width_px: int, height_px: int) -> Camera | None:
    """Return the camera in a calibration file if it has this image size, else None.

    Raises:
        InputError: the file contains no calibration.
    """
    data = calibration_bytes(path)
    file = read_unstated(data, str(path))
    if file is not None:
        sized = None if file.camera is None or file.camera.size_px is None else file.camera
        camera = sized.camera(image_size_px=None, source=str(path)) if sized else None
    else:
        camera = camera_of(read_any(data, str(path)), path, (width_px, height_px))
    fits = camera is not None and (camera.width_px, camera.height_px) == (width_px, height_px)
    return camera if fits else None


def reference_from(path: Path, camera: Camera | None, pick: MeaningPick = _NOTHING_PICKED) -> Reference | OpenMeaning:
    """Return the calibration in a file, to be shown with the recording's camera; or what it can mean, if it does not say.

    Args:
        path: of the file.
        camera: the recording's.
        pick: what a person picked.

    Raises:
        InputError: it contains no calibration, contradicts itself or fails its own check point.
    """
    if camera is None:
        raise InputError(f"{path}: showing this calibration needs intrinsics; give --camera FILE")
    data, source, name = calibration_bytes(path), str(path), name_text(path.name)
    file = read_unstated(data, source)
    if file is None:
        return Reference(name, adopted_calibration(read_any(data, source), source, camera=camera))
    radars = [pose for pose in file.poses if pose.hints.names_radar]
    if pick.meaning or len(file.poses) == 1 or len(radars) == 1:
        pose = file.pose_at(pick.place or None)
        hypotheses = hypotheses_of(pose)
        chosen = picked(hypotheses, pick.meaning, source) if pick.meaning else clear_one(pose, hypotheses)
        if chosen is not None:
            found = as_imported(file, pose, chosen, by_hand=bool(pick.meaning))
            return Reference(name, adopted_calibration(found, source, camera=camera))
    ranked = [(pose, hypotheses_of(pose)) for pose in (radars or file.poses)[:_MOST_POSES]]
    most = _MOST_OFFERS // len(ranked)
    offers = (Offer(pose.place, one) for pose, hypotheses in ranked for one in likely_ones(hypotheses)[:most])
    return OpenMeaning(name, tuple(offers), camera)
