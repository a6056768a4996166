"""The keys of our three file formats. JSON Schema is generated from these types (docs/schemas).

Inputs and settings refuse unknown keys; results may contain more.
"""

import dataclasses
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import msgspec
from msgspec import UNSET, Meta, Struct, UnsetType, field

from calib_core.camera import CameraModel
from calib_core.interchange.calibration_file import AssumptionNote, Evidence, VehicleNote
from calib_core.json_forms import Count, Measured, Name, Pixel, Position, Positive, Share
from calib_core.measurements import ChosenReturn, Mark, TimeNs, Unpaired
from calib_core.options import RETIRED_METHODS, CalibrationOptions
from calib_core.radar import RadarErrors
from calib_core.results import DataWarning, InputFile, Metrics, UnconfirmedClicks
from calib_core.results.systematic_errors import SystematicErrorResult
from calib_core.results.verdict import Verdict

CLICKS_SCHEMA: Final = "cocalib/clicks-1"
PAIRS_SCHEMA: Final = "cocalib/pairs-1"
CALIBRATION_SCHEMA: Final = "cocalib/calibration-1"


def names_schema(text: str, schema: str) -> bool:
    """Return whether JSON text names a schema, without checking anything else."""
    try:
        content = msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError):  # whoever reads it says what is wrong with it
        return False
    return isinstance(content, dict) and content.get("schema") == schema


Vector2 = tuple[float, float]
Vector4 = tuple[float, float, float, float]
Vector6 = tuple[float, float, float, float, float, float]
Matrix22 = tuple[Vector2, Vector2]
Matrix33 = tuple[Position, Position, Position]
Matrix66 = tuple[Vector6, Vector6, Vector6, Vector6, Vector6, Vector6]


class ClickDocument(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, rename={"chosen": "return"}):
    """The reflector's centre in one frame; pixel (0, 0) is the centre of the top-left pixel.

    mark "untouched" is where the radar expected the reflector: no measurement, and not used. return is the radar return that
    a person chose for the click.
    """

    id: Name
    image_time: TimeNs
    pixel_px: Pixel
    sigma_px: Positive | None = None
    excluded: bool = False
    mark: Mark = "clicked"
    chosen: ChosenReturn | None = None


class ClicksDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """Clicks on recorded frames, identified by the frames' stamps."""

    schema: Literal["cocalib/clicks-1"]
    clicks: list[ClickDocument]
    radar_topics: list[str] | UnsetType = UNSET
    unconfirmed: UnconfirmedClicks | UnsetType = UNSET


class CameraCovarianceDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """Covariance of the intrinsics: the parameters it is of, and its rows; a parameter that it does not name is exact."""

    order: list[str]
    matrix: list[list[Measured]]


class CameraDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """A calibrated camera; coefficients in OpenCV's order."""

    model: CameraModel
    width_px: Annotated[int, Meta(ge=1)]
    height_px: Annotated[int, Meta(ge=1)]
    matrix_px: Matrix33
    distortion: list[Measured] = []
    covariance: CameraCovarianceDocument | UnsetType = UNSET


class RadarDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """Standard deviations of one radar position."""

    sigma_range_m: Positive | None = None
    sigma_azimuth_rad: Positive | None = None
    sigma_elevation_rad: Positive | None = None


class PositionDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """A tape-measured camera centre in the radar frame: forward, left, up."""

    position_m: Position
    sigma_m: Positive = 0.03


class PairDocument(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """One reflector position seen by both sensors."""

    id: Name
    radar_m: Position
    pixel_px: Pixel
    alternatives_radar_m: list[Position] = []
    sigma_px: Positive | None = None


class PairsDocument(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Ready-made pairs and the camera they were clicked in."""

    schema: Literal["cocalib/pairs-1"]
    camera: CameraDocument
    pairs: list[PairDocument]
    radar: RadarDocument | None = None
    camera_position_in_radar: PositionDocument | None = None


class TransformDocument(Struct, frozen=True):
    """p_target = rotation p_source + translation_m; the quaternion is the same rotation."""

    rotation: Matrix33
    translation_m: Position
    quaternion_wxyz: Vector4 | None = None


class FramesDocument(Struct, frozen=True):
    """Names of the two frames; the camera's is the optical one (x right, y down, z forward)."""

    radar: Name
    camera: Name


class SigmaDocument(Struct, frozen=True):
    """Square roots of the covariance's diagonal."""

    x_m: float | None = None
    y_m: float | None = None
    z_m: float | None = None
    rot_x_rad: float | None = None
    rot_y_rad: float | None = None
    rot_z_rad: float | None = None


class CheckPointDocument(Struct, frozen=True):
    """A radar point and the pixel it must project to."""

    radar_m: Position
    pixel_px: Pixel


class CandidateDocument(Struct, frozen=True):
    """A radar position that may be the reflector.

    sigma_polar holds the standard deviations of range [m], azimuth and elevation [rad]; null if no noise is assumed.
    Candidates of one pair with the same alternative_of are positions of one return of which at most one is true.
    """

    radar_m: Position
    sigma_polar: tuple[Positive, Positive, Positive] | None = None
    score: Share = 1.0
    returns: Count = 1
    scans: Count = 1
    snr_db: float | None = None
    alternative_of: Count | UnsetType = UNSET


class SolvedPairDocument(Struct, frozen=True, rename={"chosen": "return"}):
    """One pair under the solved pose; residual_px is projected_px minus pixel_px, distance_px its length.

    sigma_px, radar_time and candidates are the data the pair was solved from; with them it can be solved again. rival is the
    candidate that explains the click as well as the chosen one, if there is one. mark and return are those of the click;
    return is absent unless a person chose one.
    """

    id: Name
    radar_m: Position
    pixel_px: Pixel
    inlier: bool
    image_time: TimeNs | None = None
    excluded: bool = False
    projected_px: Vector2 | None = None
    residual_px: Vector2 | None = None
    distance_px: float | None = None
    outlier_probability: float | None = None
    influence: float | None = None
    candidate: Count = 0
    rival: Count | UnsetType = UNSET
    expected_covariance_px2: Matrix22 | None = None
    sigma_px: Positive | None = None
    radar_time: TimeNs | None = None
    candidates: list[CandidateDocument] = []
    mark: Mark | UnsetType = UNSET
    chosen: ChosenReturn | UnsetType = UNSET


class TopicsDocument(Struct, frozen=True):
    """The topics that were read; radar_all names those of a radar with several, and radar_choice says why it was used."""

    radar: str | None = None
    image: str | None = None
    camera_info: str | None = None
    radar_all: list[str] | UnsetType = UNSET
    radar_choice: str | UnsetType = UNSET


class ClocksDocument(Struct, frozen=True):
    """Which stamps each topic uses: "header" or "receive"."""

    radar: str | None = None
    image: str | None = None


class ProvenanceDocument(Struct, frozen=True):
    """Where the result comes from."""

    inputs: list[InputFile] = []
    topics: TopicsDocument = field(default_factory=TopicsDocument)
    clocks: ClocksDocument = field(default_factory=ClocksDocument)
    radar_axes: str | None = None
    video_start: str | None = None
    version: str | None = None
    column_map: list[str] | UnsetType = UNSET
    assumptions: list[AssumptionNote] | UnsetType = UNSET
    unconfirmed: UnconfirmedClicks | UnsetType = UNSET
    damage: list[str] | UnsetType = UNSET


class NoiseScaleDocument(Struct, frozen=True):
    """Ratios of estimated to assumed standard deviations."""

    click: float = 1.0
    range: float = 1.0
    azimuth: float = 1.0
    elevation: float = 1.0


class PaperDocument(Struct, frozen=True):
    """Mean reprojection errors of Algorithm 1's two candidates."""

    iterative_px: float | None = None
    sqpnp_px: float | None = None


class AngleMapDocument(Struct, frozen=True):
    """The radar's own smooth angle errors: what to add to a measured azimuth and elevation before applying the pose.

    Rows correspond to elevation_rad, columns to azimuth_rad; interpolate linearly, and use the edge value beyond the edge.
    """

    azimuth_rad: list[float]
    elevation_rad: list[float]
    add_azimuth_rad: list[list[float]]
    add_elevation_rad: list[list[float]]
    sigma_azimuth_rad: list[list[float]]
    sigma_elevation_rad: list[list[float]]
    aed_px: float | None = None
    corrected_aed_px: float | None = None


class CovariancePartsDocument(Struct, frozen=True, omit_defaults=True):
    """What of the covariance rests on stated standard deviations: of errors that all pairs share, of a measured position."""

    systematic: Matrix66
    camera_position: Matrix66 | None = None


class FleetPriorDocument(Struct, frozen=True):
    """What versions before this one wrote of a fleet's prior: read, so that a pose that rests on it is told, and not written."""

    vehicle_type: Name
    used: bool


@dataclass(frozen=True, slots=True)
class BoardOptions:
    """The checkerboard of the method ccm, which older versions had."""

    columns: int = 8
    rows: int = 5
    square_m: float = 0.1
    reach_squares: float = 0.35
    registration: Literal["rigid", "linear"] = "rigid"


@dataclass(frozen=True, slots=True)
class StatedOptions(CalibrationOptions):
    """The options that a file states: those of a calibration, and what older versions had as well."""

    method: Literal["default", "paper", "pmm", "ccm"] = "default"  # type: ignore[assignment]
    board: BoardOptions = dataclasses.field(default_factory=BoardOptions)

    @classmethod
    def of(cls, options: CalibrationOptions) -> "StatedOptions":
        """Return the options of a calibration as a file states them."""
        return (
            options
            if isinstance(options, cls)
            else cls(**{one.name: getattr(options, one.name) for one in dataclasses.fields(options)})
        )

    def options(self) -> CalibrationOptions:
        """Return the options of a calibration; those of a method of older versions stay as they were stated."""
        if self.method in RETIRED_METHODS:
            return self
        return CalibrationOptions(
            **{one.name: getattr(self, one.name) for one in dataclasses.fields(CalibrationOptions)}
        )


class CalibrationDocument(Struct, frozen=True):
    """A solved extrinsic calibration with its uncertainty."""

    schema: Literal["cocalib/calibration-1"]
    camera_from_radar: TransformDocument
    frames: FramesDocument
    camera: CameraDocument
    radar_from_camera: TransformDocument | None = None
    equation: str = ""
    covariance: Matrix66 | None = None
    covariance_convention: str = ""
    covariance_quantile: float | None = None
    covariance_parts: CovariancePartsDocument | None = None
    sigma: SigmaDocument = field(default_factory=SigmaDocument)
    check_point: CheckPointDocument | None = None
    metrics: Metrics = field(default_factory=Metrics)
    noise_scale: NoiseScaleDocument = field(default_factory=NoiseScaleDocument)
    radar_errors: RadarErrors = field(default_factory=RadarErrors)
    systematic_errors: list[SystematicErrorResult] = []
    radar_angle_map: AngleMapDocument | None = None
    paper: PaperDocument = field(default_factory=PaperDocument)
    verdict: Verdict | None = None
    evidence: Evidence | None = None
    warnings: list[DataWarning] = []
    unpaired: list[Unpaired] = []
    pairs: list[SolvedPairDocument] = []
    given_camera: CameraDocument | None = None
    fleet_prior: FleetPriorDocument | None = None
    vehicle: VehicleNote | None = None
    options: StatedOptions = field(default_factory=StatedOptions)
    provenance: ProvenanceDocument = field(default_factory=ProvenanceDocument)


for _document in (ClicksDocument, PairsDocument, CalibrationDocument):
    msgspec.json.Decoder(_document)
"""msgspec learns the types here, in the one thread that imports them: two that read their first file crashed it (0.22.0)."""
