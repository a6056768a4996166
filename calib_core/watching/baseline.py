"""The baseline of a watch: what image, still returns and traffic were like when the calibration was known to hold.

It holds medians and statistics only: grey backgrounds of at most 480 px, places that return again and again, and how boxes and
returns differ by class. It belongs to one calibration, whose file's hash it keeps.
"""

import base64
import binascii
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta, Struct

from calib_core.errors import InputError
from calib_core.interchange.syntax.strict_json import document_text, parse_document
from calib_core.json_forms import Count, Name
from calib_core.measurements import TimeNs
from calib_core.watching.still_returns import StillPlaces
from calib_core.watching.traffic import TrafficModel

BASELINE_SCHEMA: Final = "cocalib/baseline-1"

_JPEG_QUALITY = 92
_LARGEST_PX = 2000
_Finite = Annotated[float, Meta(ge=-1e12, le=1e15)]
_Hash = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
_Image = Annotated[str, Meta(max_length=400_000)]
_Side = Annotated[int, Meta(ge=1, le=1_000_000)]


class StillPlacesDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """Places that return again and again: range [m], azimuth and elevation [rad], and the spreads of the two angles [rad]."""

    polar: Annotated[list[tuple[_Finite, _Finite, _Finite]], Meta(max_length=1000)]
    spreads_rad: Annotated[list[tuple[_Finite, _Finite]], Meta(max_length=1000)]


class TrafficDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """How boxes and returns differ in traffic, by class; the unknowns are turn, clock, and the body height of each class."""

    labels: Annotated[list[Annotated[str, Meta(max_length=200)]], Meta(max_length=200)]
    factors: list[list[list[_Finite]]]
    middle: list[_Finite]
    information: list[list[_Finite]]
    gradient: list[_Finite]
    passages: list[Count]
    seconds: Annotated[float, Meta(ge=0.0, le=1e9)]


class BaselineDocument(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A baseline; backgrounds are JPEG in base64."""

    schema: Literal["cocalib/baseline-1"]
    calibration_sha256: _Hash
    recording: Name
    start: TimeNs
    end: TimeNs
    image_size_px: tuple[_Side, _Side]
    backgrounds: Annotated[list[_Image], Meta(max_length=8)] = msgspec.field(default_factory=list)
    still_returns: StillPlacesDocument | None = None
    traffic: TrafficDocument | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Baseline:
    """What later recordings are compared with.

    Attributes:
        calibration_sha256: of the file of the calibration.
        recording: name of the recording.
        start: its first stamp.
        end: its last.
        image_size_px: of the recorded images.
        backgrounds: uint8 (h, w) grey, one for each part of the recording.
        places: that the radar sees again and again; None where the sensors move.
        traffic: what traffic was like; None without boxes.
    """

    calibration_sha256: str
    recording: str
    start: TimeNs
    end: TimeNs
    image_size_px: tuple[int, int]
    backgrounds: tuple[np.ndarray, ...] = ()
    places: StillPlaces | None = None
    traffic: TrafficModel | None = None


def write_baseline(baseline: Baseline) -> str:
    """Write baseline-1 text."""
    places, traffic = baseline.places, baseline.traffic
    return document_text(
        BaselineDocument(
            BASELINE_SCHEMA,
            baseline.calibration_sha256,
            baseline.recording[:200] or "recording",
            baseline.start,
            baseline.end,
            baseline.image_size_px,
            [_encoded(image) for image in baseline.backgrounds],
            None if places is None else StillPlacesDocument(places.polar.tolist(), places.spreads_rad.tolist()),
            None if traffic is None else _traffic_document(traffic),
        )
    )


def read_baseline(text: str, *, source: str) -> Baseline:
    """Read baseline-1 text.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    document = parse_document(text, BaselineDocument, source=source)
    places, traffic = document.still_returns, document.traffic
    try:
        return Baseline(
            document.calibration_sha256,
            document.recording,
            document.start,
            document.end,
            document.image_size_px,
            tuple(_decoded(image) for image in document.backgrounds),
            None if places is None else StillPlaces(np.array(places.polar), np.array(places.spreads_rad)),
            None if traffic is None else _traffic(traffic),
        )
    except ValueError as error:
        raise InputError(f"{source}: {error}; write the baseline again from its recording") from None


def _traffic_document(traffic: TrafficModel) -> TrafficDocument:
    return TrafficDocument(
        list(traffic.labels),
        traffic.factors.tolist(),
        traffic.middle.tolist(),
        traffic.information.tolist(),
        traffic.gradient.tolist(),
        list(traffic.passages),
        traffic.seconds,
    )


def _traffic(document: TrafficDocument) -> TrafficModel:
    """Return the model of a document.

    Raises:
        ValueError: its parts are not of one size, or it knows less than nothing.
    """
    count = len(document.labels)
    if len(document.passages) != count or len(set(document.labels)) != count:
        raise ValueError("traffic: labels and passages must be of one number, and each label there once")
    model = TrafficModel(
        tuple(document.labels),
        np.array(document.factors).reshape(count, 2, 2),
        np.array(document.middle),
        np.array(document.information),
        np.array(document.gradient),
        tuple(document.passages),
        document.seconds,
    )
    scale = np.trace(model.information)
    if (model.factors <= 0.0).any() or np.linalg.eigvalsh(model.information).min() < -1e-6 * abs(scale):
        raise ValueError("traffic: factors and information must be positive")
    return model


def _encoded(image: np.ndarray) -> str:
    import cv2

    return base64.b64encode(
        cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1].tobytes()
    ).decode()


def _decoded(text: str) -> np.ndarray:
    """Return a background.

    Raises:
        ValueError: it is no image, or too large.
    """
    import cv2

    try:
        data = base64.b64decode(text, validate=True)
    except binascii.Error:
        raise ValueError("backgrounds: not base64") from None
    if not data.startswith(b"\xff\xd8"):
        raise ValueError("backgrounds: not a JPEG file")
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    except cv2.error:
        image = None
    if image is None or max(image.shape) > _LARGEST_PX:
        raise ValueError("backgrounds: an image cannot be read or is too large")
    return np.asarray(image)
