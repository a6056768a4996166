"""Read a file of the corpus as a user does and compare what was read with its truth."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from calib_core.errors import CalibrationError
from calib_core.interchange.format import ImportedCalibration
from calib_core.interchange.hypotheses.reading import read_clear, read_unstated
from calib_core.interchange.importing import read_together, tree_files
from calib_core.interchange.trees.frame_choice import WantedFrames
from tests.corpus_calibrations.truth import CAMERA_FROM_RADAR, DISTORTION, SIZE, Calibration, K

Outcome = Literal["right", "refused", "wrong"]


@dataclass(frozen=True)
class Reading:
    """How a file was read.

    Attributes:
        outcome: "right" if the pose, and the camera that the file holds, are those it was made from.
        why: the differences, the assumptions or the refusal.
        assumed: whether reading took something for granted.
    """

    outcome: Outcome
    why: str
    assumed: bool = False


def read(calibration: Calibration, folder: Path) -> Reading:
    """Write a file and those beside it, and read it."""
    for name, content in {**calibration.beside, calibration.file_name: calibration.content}.items():
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    try:
        found = _found(calibration, folder)
    except CalibrationError as error:
        return Reading("refused", str(error).removeprefix(str(folder)))
    off = float(np.abs(found.camera_from_radar.as_matrix() - CAMERA_FROM_RADAR).max())
    camera = _camera_difference(calibration, found)
    if off > calibration.close or camera:
        return Reading("wrong", f"off by {off:.2g} {camera}; assumed: {'; '.join(found.assumptions)}")
    return Reading("right", "; ".join(found.assumptions), bool(found.assumptions))


def _found(calibration: Calibration, folder: Path) -> ImportedCalibration:
    """Read as `cocalib import` does: what states nothing by its one plausible meaning, all else by its format or as a tree.

    Raises:
        InputError: there is no pose between a radar and a camera, or what it means is not clear.
    """
    files = tree_files([folder if calibration.folder else folder / calibration.file_name])
    if len(files) == 1 and read_unstated(files[0].data, files[0].source) is not None:
        return read_clear(files[0].data, files[0].source)
    return read_together(files, WantedFrames(*(calibration.frames or (None, None))))


def _camera_difference(calibration: Calibration, found: ImportedCalibration) -> str:
    """Return what differs in the camera that must be in the file; empty if nothing does."""
    if not calibration.holds_camera:
        return ""
    camera = found.camera if "size" in calibration.holds_camera else found.camera_for(SIZE)
    if camera is None:
        return "no camera"
    if (camera.width_px, camera.height_px) != SIZE or np.abs(camera.matrix_px - K).max() > 1e-9:
        return "another camera matrix or size"
    expected = DISTORTION[: len(camera.distortion)] if "lens" in calibration.holds_camera else ()
    least = 4 if "lens" in calibration.holds_camera else 0
    same = len(camera.distortion) >= least and np.allclose(camera.distortion, expected, rtol=0, atol=1e-12)
    return "" if same else f"distortion {camera.distortion.tolist()}"
