"""The result of calibrating a lens: the camera, how well it is known, and what each view says."""

from dataclasses import dataclass

from calib_core.arrays import Flags, Points2, Points3, freeze
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_images import BoardCorners, LeftOutImage
from calib_core.results import DataWarning


@dataclass(frozen=True, slots=True, eq=False)
class LensView:
    """A view of the board, as the calibrated camera explains it.

    Attributes:
        corners: what was found in the image.
        camera_from_board: the board's pose.
        residuals_px: (n, 2) projected minus found corners [px].
        used: (n,) which corners were used.
        rms_px: root mean square distance of the used corners.
        held_out_rms_px: the same with the lens calibrated without this view; NaN if not determined.
    """

    corners: BoardCorners
    camera_from_board: RigidTransform
    residuals_px: Points2
    used: Flags
    rms_px: float
    held_out_rms_px: float = float("nan")

    def __post_init__(self) -> None:
        count = len(self.corners.corner_ids)
        freeze(self, residuals_px=(count, 2))
        freeze(self, bool, used=(count,))


@dataclass(frozen=True, slots=True)
class ModelTrial:
    """A lens model that was tried.

    Attributes:
        model: its name.
        rms_px: root mean square distance of all used corners.
        held_out_rms_px: the same for views left out of the calibration.
        worse_by: mean over views of its squared held-out error minus that of the chosen model [px^2]; 0 for the chosen one.
        standard_error: of that difference, paired over views [px^2].
        fault: why it could not be calibrated; empty if it was.
    """

    model: str
    rms_px: float
    held_out_rms_px: float
    worse_by: float = 0.0
    standard_error: float = 0.0
    fault: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class CalibratedLens:
    """A calibrated lens.

    Attributes:
        camera: the intrinsics, with their covariance.
        board: with which they were found.
        board_shape_m: (k, 3) the corners of the board as estimated, by id; as stated if nothing speaks against it.
        views: used ones, in order of their numbers.
        left_out: images that were not used, with the reason.
        rms_px: root mean square distance of all used corners.
        held_out_rms_px: the same for views left out one after the other; NaN if not determined.
        trials: the models that were tried, the simplest first.
        choice: one sentence: which model, and why.
        warnings: what the person must decide on.
    """

    camera: Camera
    board: Board
    board_shape_m: Points3
    views: tuple[LensView, ...]
    left_out: tuple[LeftOutImage, ...]
    rms_px: float
    held_out_rms_px: float
    trials: tuple[ModelTrial, ...] = ()
    choice: str = ""
    warnings: tuple[DataWarning, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, board_shape_m=(None, 3))
