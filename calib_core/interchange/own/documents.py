"""The keys of our three file formats; transforms and cameras to and from their documents.

JSON Schema is generated from these types (docs/schemas). Inputs and settings refuse unknown keys; results may contain more.
"""

from collections.abc import Sequence
from decimal import Decimal
from typing import Annotated, Any, Final, Literal

import msgspec
import numpy as np
from msgspec import UNSET, Meta, Struct, UnsetType, field

from calib_core.camera import Camera, CameraCovariance, CameraModel
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, matrix_from_quaternion_wxyz, quaternion_wxyz_from_matrix
from calib_core.interchange.calibration_file import AssumptionNote, CarriedFrom, Evidence, VehicleNote
from calib_core.interchange.rotations import nearest_rotation
from calib_core.json_forms import Count, Measured, Name, Pixel, Position, Positive, Share
from calib_core.measurements import ChosenReturn, Mark, TimeNs
from calib_core.options import CalibrationOptions
from calib_core.parsing import json_form
from calib_core.radar import RadarErrors
from calib_core.results import InputFile, Metrics, UnconfirmedClicks
from calib_core.results.systematic_errors import SystematicErrorResult
from calib_core.words.outcomes import UnpairedText, WarningText
from calib_core.words.verdict import StatedVerdict

CLICKS_SCHEMA: Final = "cocalib/clicks-1"
PAIRS_SCHEMA: Final = "cocalib/pairs-1"
CALIBRATION_SCHEMA: Final = "cocalib/calibration-1"


def names_schema(text: str, schema: str) -> bool:
    """Return whether JSON text names a schema, without checking anything else."""
    try:
        return json_form(text, dict[str, Any]).get("schema") == schema
    except InputError:  # whoever reads it says what is wrong with it
        return False


Vector2 = tuple[float, float]
Vector4 = tuple[float, float, float, float]
Vector6 = tuple[float, float, float, float, float, float]
Matrix22 = tuple[Vector2, Vector2]
Matrix33 = tuple[Position, Position, Position]
Matrix66 = tuple[Vector6, Vector6, Vector6, Vector6, Vector6, Vector6]


class ClickDocument(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, rename={"chosen": "return"}):
    """The reflector's center in one frame; pixel (0, 0) is the center of the top-left pixel.

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
    """A tape-measured camera center in the radar frame: forward, left, up."""

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
    sigma_px: Positive | UnsetType | None = None
    radar_time: TimeNs | UnsetType | None = None
    candidates: list[CandidateDocument] | UnsetType = []
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


class CalibrationDocument(Struct, frozen=True, kw_only=True):
    """A solved extrinsic calibration with its uncertainty."""

    schema: Literal["cocalib/calibration-1"]
    equation: str = ""
    vehicle: VehicleNote | UnsetType | None = None
    frames: FramesDocument
    camera_from_radar: TransformDocument
    radar_from_camera: TransformDocument | None = None
    check_point: CheckPointDocument | None = None
    verdict: StatedVerdict | UnsetType | None = None
    evidence: Evidence | UnsetType | None = None
    carried_from: CarriedFrom | UnsetType | None = None
    sigma: SigmaDocument = field(default_factory=SigmaDocument)
    covariance: Matrix66 | None = None
    covariance_convention: str = ""
    covariance_quantile: float | None = None
    covariance_parts: CovariancePartsDocument | UnsetType | None = None
    metrics: Metrics = field(default_factory=Metrics)
    noise_scale: NoiseScaleDocument = field(default_factory=NoiseScaleDocument)
    radar_errors: RadarErrors | UnsetType = field(default_factory=RadarErrors)
    systematic_errors: list[SystematicErrorResult] | UnsetType = []
    radar_angle_map: AngleMapDocument | UnsetType | None = None
    paper: PaperDocument = field(default_factory=PaperDocument)
    warnings: list[WarningText] = []
    unpaired: list[UnpairedText] = []
    pairs: list[SolvedPairDocument] = []
    camera: CameraDocument
    given_camera: CameraDocument | UnsetType | None = None
    options: CalibrationOptions = field(default_factory=CalibrationOptions)
    provenance: ProvenanceDocument = field(default_factory=ProvenanceDocument)


for _document in (ClicksDocument, PairsDocument, CalibrationDocument):
    msgspec.json.Decoder(_document)
"""msgspec learns the types here, in the one thread that imports them: two that read their first file crashed it (0.22.0)."""


_AGREEMENT = 1e-5
"""The largest difference allowed between two statements of one transform, in any matrix entry, besides rounding."""
_ORTHONORMAL = 1e-6
_FEWEST_DIGITS = 4
"""Numbers with fewer digits count as rounded to this many: a short number is exact more often than it is rounded."""
_QUATERNION_SHARE = 10
"""How far rounding of a quaternion's or a matrix's entries moves an entry of the rotation, at most."""


def transform_of(document: TransformDocument, *, source: str, place: str) -> RigidTransform:
    """Return the transform in a document; a rotation with few digits becomes the nearest proper one.

    Raises:
        InputError: the rotation is invalid (mirrored, or not orthonormal), or the quaternion is a different rotation.
    """
    rotation = np.array(document.rotation)
    tolerance = _rotation_rounding(document)
    try:
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > _ORTHONORMAL:
            rotation = nearest_rotation(rotation, tolerance=tolerance)
        transform = RigidTransform(rotation, np.array(document.translation_m))
    except ValueError as error:
        raise InputError(f"{source}: {place}.rotation: {error}; give a proper rotation") from None
    if document.quaternion_wxyz is not None and not _same_rotation(
        document.quaternion_wxyz, transform, _AGREEMENT + tolerance
    ):
        raise InputError(
            f"{source}: {place}.quaternion_wxyz: is a different rotation from {place}.rotation; "
            "the order is w, x, y, z; correct one of the two"
        )
    return transform


def are_inverse(document: TransformDocument, inverse: TransformDocument, *, source: str, place: str) -> bool:
    """Return whether two stated transforms are each other's inverse, as far as their digits tell.

    Args:
        document: the one; already read.
        inverse: the other.
        source: the name of the file in error messages.
        place: of the other in the file.

    Raises:
        InputError: the other's rotation is invalid, or contradicts its quaternion.
    """
    turned = TransformDocument(document.rotation, document.translation_m)
    stated = transform_of(turned, source=source, place=place)
    other = transform_of(inverse, source=source, place=place).inverse()
    rounding = max(_rotation_rounding(document), _rotation_rounding(inverse))
    reach_m = float(np.abs(stated.translation_m).sum())
    translation_rounding = 3 * (_rounding(document.translation_m) + _rounding(inverse.translation_m))
    apart = np.abs(other.as_matrix() - stated.as_matrix())
    return bool(
        apart[:, :3].max() <= _AGREEMENT + 2 * rounding
        and apart[:, 3].max() <= _AGREEMENT + translation_rounding + reach_m * rounding
    )


def transform_document(transform: RigidTransform) -> TransformDocument:
    """Return the document of a transform."""
    return TransformDocument(
        rotation=nested(transform.rotation + 0.0),
        translation_m=nested(transform.translation_m + 0.0),
        quaternion_wxyz=nested(quaternion_wxyz_from_matrix(transform.rotation) + 0.0),
    )


def _same_rotation(quaternion_wxyz: tuple[float, ...], transform: RigidTransform, tolerance: float) -> bool:
    quaternion = np.array(quaternion_wxyz)
    if not quaternion.any():
        return False
    return bool(np.abs(matrix_from_quaternion_wxyz(quaternion) - transform.rotation).max() <= tolerance)


def _rotation_rounding(document: TransformDocument) -> float:
    """Return how far rounding may have moved an entry of the rotation, from the digits of its numbers."""
    numbers = [number for row in document.rotation for number in row]
    return _QUATERNION_SHARE * max(_rounding(numbers), _rounding(document.quaternion_wxyz or numbers))


def _rounding(numbers: "tuple[float, ...] | list[float]") -> float:
    """Return half a unit of the last digit that numbers rounded alike were written with.

    They may have been rounded to decimals or to significant digits; the number with the most tells how many.
    """
    written = [Decimal(repr(float(number))).normalize() for number in numbers if np.isfinite(number)]
    decimals = max([_FEWEST_DIGITS, *(-int(one.as_tuple().exponent) for one in written)])
    digits = max([_FEWEST_DIGITS, *(len(one.as_tuple().digits) for one in written)])
    largest = max([0.0, *(abs(float(one)) for one in written)])
    magnitude = int(np.floor(np.log10(largest))) + 1 if largest > 1.0 else 0
    return 0.5 * max(10.0**-decimals, 10.0 ** (magnitude - digits))


def finite_or_none(value: float) -> float | None:
    """Return a finite number as it is, and None for any other."""
    return float(value) if np.isfinite(value) else None


def nan_if_none(value: float | None) -> float:
    """Return the number in a file, NaN for null."""
    return float("nan") if value is None else value


def nested(array: np.ndarray) -> Any:
    """Return an array as nested tuples; None if any entry is not finite."""
    if not np.isfinite(array).all():
        return None
    return tuple(map(tuple, array.tolist())) if array.ndim == 2 else tuple(array.tolist())


def camera_document(camera: Camera) -> CameraDocument:
    """Return the document of a camera."""
    matrix: Any = tuple(tuple(row) for row in camera.matrix_px.tolist())
    size_px = camera.width_px, camera.height_px
    covariance = _covariance_document(camera.covariance)
    return CameraDocument(camera.model, *size_px, matrix, camera.distortion.tolist(), covariance)


def camera_of(document: CameraDocument, *, source: str, place: str = "camera") -> Camera:
    """Return the camera in a document.

    Raises:
        InputError: a parameter is invalid.
    """
    try:
        return Camera(
            document.model,
            document.width_px,
            document.height_px,
            document.matrix_px,  # type: ignore[arg-type]
            document.distortion,  # type: ignore[arg-type]
            _covariance_of(document.covariance),
        )
    except ValueError as error:
        raise InputError(f"{source}: {place}: {error}; correct it or calibrate the camera again") from None


def _covariance_document(covariance: CameraCovariance | None) -> CameraCovarianceDocument | UnsetType:
    if covariance is None:
        return UNSET
    return CameraCovarianceDocument(list(covariance.order), covariance.matrix.tolist())


def _covariance_of(document: CameraCovarianceDocument | UnsetType) -> CameraCovariance | None:
    """Return the covariance in a document; raises ValueError if it cannot be one."""
    if isinstance(document, UnsetType):
        return None
    count = len(document.order)
    if [len(row) for row in document.matrix] != [count] * count:
        raise ValueError(
            f"the covariance of the intrinsics names {count} parameters, its matrix needs as many rows and columns"
        )
    return CameraCovariance(tuple(document.order), np.array(document.matrix, dtype=np.float64).reshape(count, count))


def refuse_repeated_ids(ids: Sequence[str], *, source: str, place: str) -> None:
    """Refuse a list in which two entries have the same id.

    Raises:
        InputError: two entries have the same id; the message names both places.
    """
    first: dict[str, int] = {}
    for index, name in enumerate(ids):
        if name in first:
            places = f"{place}[{first[name]}] and {place}[{index}]"
            raise InputError(f"{source}: {places}: both have the id {name!r}; give each its own")
        first[name] = index


def unconfirmed_of(
    stated: UnconfirmedClicks | UnsetType, present: Sequence[str] | None = None
) -> UnconfirmedClicks | None:
    """Return the unconfirmed clicks that a file states; None if there are none.

    Args:
        stated: in the file.
        present: ids of the file's clicks: others were taken out of it since; None keeps all.
    """
    if isinstance(stated, UnsetType):
        return None
    ids = tuple(name for name in stated.ids if present is None or name in present)
    return UnconfirmedClicks(ids, stated.confidence) if ids else None
