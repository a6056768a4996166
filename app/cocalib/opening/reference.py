"""Read the calibration that the page shows until the clicks give a new one, and the camera in it."""

from pathlib import Path
from typing import TYPE_CHECKING

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.interchange import adopted_calibration, calibration_bytes, read_any
from calib_core.interchange.hypotheses.ranking import clear_one, hypotheses_of, likely_ones
from calib_core.interchange.hypotheses.reading import as_imported, picked, read_unstated
from calib_core.results import DataWarning
from cocalib.hypothesis_sheet import Offer, OpenMeaning
from cocalib.opening.choice import MeaningPick
from cocalib.view import Reference

if TYPE_CHECKING:
    from calib_core.interchange import ImportedCalibration
    from calib_core.interchange.hypotheses.found_poses import FoundPose
    from calib_core.interchange.hypotheses.ranking import Hypothesis
    from calib_core.interchange.hypotheses.reading import UnstatedFile

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
    chosen = _chosen(file, pick, source)
    if chosen is None:
        return _open_meaning(file, name, camera)
    pose, hypothesis = chosen
    found = as_imported(file, pose, hypothesis, by_hand=bool(pick.meaning))
    return Reference(name, adopted_calibration(found, source, camera=camera))


def meaning_of(path: Path, camera: Camera, pick: MeaningPick = _NOTHING_PICKED) -> OpenMeaning | None:
    """Return what a file can mean that does not say it, with the meaning that is taken; None if it says what it means.

    Args:
        path: of the file.
        camera: the recording's.
        pick: what a person picked.

    Raises:
        InputError: it contains no calibration, or nothing of what was picked.
    """
    file = read_unstated(calibration_bytes(path), str(path))
    if file is None:
        return None
    chosen = _chosen(file, pick, str(path))
    shown = None if chosen is None else Offer(chosen[0].place, chosen[1])
    return _open_meaning(file, name_text(path.name), camera, shown)


def about_calibration(
    path: Path | None, shown: Reference | OpenMeaning | None, meaning: OpenMeaning | None
) -> tuple[DataWarning, ...]:
    """Return what the user must know about the calibration to show: why it is not shown, or what is assumed about it.

    Args:
        path: of its file; None if there is none.
        shown: the calibration, or what it can mean; None without intrinsics.
        meaning: what it can mean, if its file does not say: a person can pick again.
    """
    if path is None:
        return ()
    name = name_text(path.name)
    if shown is None:
        message = f"{name} is not shown, since there are no camera intrinsics"
        hint = "drop the camera file on the page, or give --camera FILE"
        return (DataWarning("calibration-not-shown", message, hint),)
    if isinstance(shown, OpenMeaning):
        message = f"{name} is not shown, since it does not state what its numbers mean"
        return (DataWarning("calibration-ambiguous", message, "pick a meaning, each drawn over a frame"),)
    if meaning is not None and meaning.shown is not None:
        words = meaning.offers[meaning.shown].hypothesis.meanings[0].words
        message = f"{name} does not state what its numbers mean; it is shown as if it {words}"
        hint = "if returns lie beside what they come from, pick another meaning; clicks on the reflector test it"
        return (DataWarning("calibration-picked", message, hint),)
    notes = [warning.message for warning in shown.calibration.warnings if warning.code == "assumed"]
    if not notes:
        return ()
    hint = "returns that lie beside what they come from show that it is wrong; clicks on the reflector test it"
    return (DataWarning("calibration-assumed", f"{name} is shown with an assumption: {'; '.join(notes)}", hint),)


def _chosen(file: "UnstatedFile", pick: MeaningPick, source: str) -> "tuple[FoundPose, Hypothesis] | None":
    """Return the meaning that was picked, or else the only plausible one; None if there are several.

    Raises:
        InputError: the file has nothing of what was picked.
    """
    if not pick.meaning and len(file.poses) > 1 and len(_of_radars(file)) != 1:
        return None
    pose = file.pose_at(pick.place or None)
    hypotheses = hypotheses_of(pose)
    chosen = picked(hypotheses, pick.meaning, source) if pick.meaning else clear_one(pose, hypotheses)
    return None if chosen is None else (pose, chosen)


def _of_radars(file: "UnstatedFile") -> "list[FoundPose]":
    return [pose for pose in file.poses if pose.hints.names_radar]


def _open_meaning(file: "UnstatedFile", name: str, camera: Camera, shown: Offer | None = None) -> OpenMeaning:
    """Return what a person can pick from: the meaning that is shown is always among them."""
    ranked = [(pose, hypotheses_of(pose)) for pose in (_of_radars(file) or file.poses)[:_MOST_POSES]]
    most = _MOST_OFFERS // len(ranked)
    offers = [Offer(pose.place, one) for pose, hypotheses in ranked for one in likely_ones(hypotheses)[:most]]
    if shown is None:
        return OpenMeaning(name, tuple(offers), camera)
    same = [
        number
        for number, one in enumerate(offers)
        if (one.place, one.hypothesis.key) == (shown.place, shown.hypothesis.key)
    ]
    return OpenMeaning(name, tuple(offers if same else [shown, *offers]), camera, shown=same[0] if same else 0)
