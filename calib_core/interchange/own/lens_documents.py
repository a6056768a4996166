"""The keys of one more of our files: a lens calibrated from views of a board."""

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta, Struct

from calib_core.interchange.own.documents import CameraDocument
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_images import LeftOutImage
from calib_core.json_forms import Count, Measured, Name
from calib_core.words.outcomes import WarningText

INTRINSICS_SCHEMA: Final = "cocalib/intrinsics-1"

_Side = Annotated[int, Meta(ge=1, le=1_000_000)]


class ImageSource(Struct, frozen=True, forbid_unknown_fields=True):
    """Where the images come from: what it is called, how many there are, and a hash by which it is known again."""

    name: Name
    images: Count = msgspec.field(name="pictures")
    sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]


class LensParameterDocument(Struct, frozen=True):
    """One of the intrinsics with its standard deviation; null if it is not known."""

    name: str
    value: float
    sigma: float | None


class LensPoseDocument(Struct, frozen=True):
    """p_camera = rotation p_board + translation_m; the board's corners have z = 0 unless board_shape_m says otherwise."""

    rotation: list[list[float]]
    translation_m: list[float]


class LensViewDocument(Struct, frozen=True):
    """A view as the lens explains it: root mean square distances of its corners, used and predicted."""

    index: int
    name: str
    corners: int
    used_corners: int
    rms_px: float | None
    held_out_rms_px: float | None
    blur_px: float | None
    camera_from_board: LensPoseDocument


class ModelTrialDocument(Struct, frozen=True):
    """A lens model that was tried; worse_by is the mean over views of what it predicts worse than the chosen one."""

    model: str
    rms_px: float | None
    held_out_rms_px: float | None
    worse_by_px2: float | None
    standard_error_px2: float | None
    fault: str


class UncertaintyDocument(Struct, frozen=True):
    """Standard deviation of the projection of far points over the image; null where the lens sees nothing."""

    x_px: list[float]
    y_px: list[float]
    sigma_px: list[list[float | None]]
    sentence: str


class ResidualFieldDocument(Struct, frozen=True):
    """Mean residuals over cells of the image with their standard errors; null in empty cells."""

    x_px: list[float]
    y_px: list[float]
    mean_px: list[list[tuple[float | None, float | None]]]
    standard_error_px: list[list[float | None]]
    corners: list[list[int]]
    systematic_px: float | None
    sentence: str


class CoverageDocument(Struct, frozen=True):
    """Where the corners are, how the board was turned and how far it was, and what to film next."""

    counts: list[list[int]]
    share: float
    tilts: dict[str, int]
    distances: dict[str, int]
    missing: list[str]


class IntrinsicsDocument(Struct, frozen=True):
    """A calibrated lens with all that is known about it."""

    schema: Literal["cocalib/intrinsics-1"]
    camera: CameraDocument
    board: Board
    source: ImageSource
    parameters: list[LensParameterDocument]
    field_of_view_deg: tuple[float | None, float | None]
    rms_px: float | None
    held_out_rms_px: float | None
    choice: str
    models: list[ModelTrialDocument]
    searched: int
    views: list[LensViewDocument]
    left_out: list[LeftOutImage]
    projection_uncertainty: UncertaintyDocument
    residual_field: ResidualFieldDocument
    coverage: CoverageDocument | None
    halves_apart: str
    warnings: list[WarningText]
    board_shape_m: list[tuple[Measured, Measured, Measured]]


msgspec.json.Decoder(IntrinsicsDocument)  # for the reason given in documents.py
