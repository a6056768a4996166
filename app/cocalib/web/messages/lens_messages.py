"""Calibrating the lens: what a page asks for, and what it is sent."""

from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

from calib_core.intrinsics.board import BoardKind
from calib_core.intrinsics.board_images import LeftOutImage
from calib_core.intrinsics.calibrated_lens import ModelTrial
from calib_core.intrinsics.coverage import Coverage
from calib_core.intrinsics.image_maps import ImageGrid
from cocalib.view.model import Figure, WarningRow

LensModelName: TypeAlias = Literal["auto", "pinhole", "plumb_bob", "rational_polynomial", "equidistant"]
Stage: TypeAlias = Literal["idle", "searching", "calibrating", "cancelled", "failed", "done"]


class _Form(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A request about the lens."""


class LensCalibrate(_Form, frozen=True, tag="lens_calibrate"):
    """Look for a board in the recording and calibrate the lens; a cancelled search for the same board goes on."""

    kind: BoardKind
    size: Annotated[str, Meta(max_length=20)]
    square_mm: float
    marker_mm: float = 0.0
    dictionary: Annotated[str, Meta(max_length=60)] = ""
    model: LensModelName = "auto"


class LensCancel(_Form, frozen=True, tag="lens_cancel"):
    """Stop looking for the board; what was found so far is kept."""


class LensUse(_Form, frozen=True, tag="lens_use"):
    """Solve with the calibrated lens from now on; a step of the session that can be undone."""


@dataclass(frozen=True, slots=True)
class LensCamera:
    """A camera's intrinsics, as a table.

    Attributes:
        about: where they come from.
        model: name of the lens model.
        size: of its images.
        field: how much it sees, in words.
        parameters: all of them.
        known: whether their standard deviations are.
    """

    about: str
    model: str
    size: str
    field: str
    parameters: tuple[Figure, ...]
    known: bool


@dataclass(frozen=True, slots=True)
class LensState:
    """The intrinsics in use, and how far a calibration of the lens is.

    Attributes:
        intrinsics: in use; None if there are none.
        chosen: whether they were chosen in this session, and not given when the recording was opened.
        images: how many there are to look for a board in.
        stage: what is being done.
        searched: images so far.
        total: images that the search looks at.
        views: images in which the board was found so far.
        left_out: images that are not used so far.
        doing: what is computed, in words.
        problem: why there is no result; "" if there is no reason to say.
        hint: what to do about it.
        can_resume: a cancelled search can go on.
        coverage: of the views so far; None before the first.
        result: number of the newest result; 0 if there is none.
        in_use: whether the newest result is what the session is solved with.
    """

    intrinsics: LensCamera | None
    chosen: bool
    images: int
    stage: Stage
    searched: int
    total: int
    views: int
    left_out: int
    doing: str
    problem: str
    hint: str
    can_resume: bool
    coverage: Coverage | None
    result: int
    in_use: bool


@dataclass(frozen=True, slots=True)
class LensViewRow:
    """A view of the board that was used.

    Attributes:
        frame: index of its frame.
        name: what messages call it.
        rms_px: root mean square distance of its corners.
        held_out_rms_px: the same with the lens calibrated without it; not a number if not determined.
    """

    frame: int
    name: str
    rms_px: float
    held_out_rms_px: float


@dataclass(frozen=True, slots=True)
class LensTrial:
    """A lens model that was tried, and what to say of it.

    Attributes:
        trial: its figures.
        note: how much worse it is than the chosen one, or why it could not be calibrated.
        chosen: whether it is the chosen one.
    """

    trial: ModelTrial
    note: str
    chosen: bool


@dataclass(frozen=True, slots=True)
class LensResult:
    """A calibrated lens.

    Attributes:
        number: of the result; increases with each.
        camera: the intrinsics.
        board: with which they were found.
        choice: which lens model, and why.
        rms_px: root mean square distance of all used corners.
        held_out_rms_px: the same for views left out one after the other; not a number if not determined.
        views: that were used, those that fit worst first.
        left_out: images that were not used.
        trials: models that were tried.
        warnings: what to decide on.
        residuals: found corner (u, v) and its residual (du, dv), of a sample of the corners [px].
        pattern: whether the residuals are more than noise, in a sentence.
        uncertainty: standard deviation of the projection over the image [px]; None if it is not known.
        unseen: what that cannot see, in sentences.
    """

    number: int
    camera: LensCamera
    board: str
    choice: str
    rms_px: float
    held_out_rms_px: float
    views: tuple[LensViewRow, ...]
    left_out: tuple[LeftOutImage, ...]
    trials: tuple[LensTrial, ...]
    warnings: tuple[WarningRow, ...]
    residuals: tuple[tuple[float, float, float, float], ...]
    pattern: str
    uncertainty: ImageGrid | None
    unseen: str
