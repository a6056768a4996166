"""The baseline of a watch: what image, still returns and traffic were like when the calibration was known to hold.

It holds medians and statistics only: grey backgrounds of at most 480 px, places that return again and again, and how boxes and
returns differ by class. It belongs to one calibration, whose file's hash it keeps.
"""

import base64
import binascii
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta, Struct

from calib_core.interchange.syntax.strict_json import document_text, parse_document
from calib_core.json_forms import Name
from calib_core.measurements import TimeNs
from calib_core.watching.still_returns import StillPlaces
from calib_core.watching.traffic import TrafficModel

BASELINE_SCHEMA: Final = "cocalib/baseline-1"

_JPEG_QUALITY = 92
_LARGEST_PX = 2000
_Hash = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
_Image = Annotated[str, Meta(max_length=400_000)]
_Side = Annotated[int, Meta(ge=1, le=1_000_000)]


class Baseline(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A baseline; backgrounds are JPEG in base64.

    Attributes:
        calibration_sha256: of the file of the calibration.
        recording: name of the recording.
        start: its first stamp.
        end: its last.
        image_size_px: of the recorded images.
        backgrounds: grey, one for each part of the recording.
        still_returns: places that the radar sees again and again; None where the sensors move.
        traffic: what traffic was like; None without boxes.
    """

    schema: Literal["cocalib/baseline-1"]
    calibration_sha256: _Hash
    recording: Name
    start: TimeNs
    end: TimeNs
    image_size_px: tuple[_Side, _Side]
    backgrounds: Annotated[list[_Image], Meta(max_length=8)] = msgspec.field(default_factory=list)
    still_returns: StillPlaces | None = None
    traffic: TrafficModel | None = None

    def __post_init__(self) -> None:
        self.images()

    def images(self) -> list[np.ndarray]:
        """Return the backgrounds as uint8 (h, w).

        Raises:
            ValueError: one is no image, or too large.
        """
        return [_decoded(text) for text in self.backgrounds]


def write_baseline(baseline: Baseline) -> str:
    """Write baseline-1 text."""
    return document_text(baseline)


def read_baseline(text: str, *, source: str) -> Baseline:
    """Read baseline-1 text.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    return parse_document(text, Baseline, source=source)


def encoded(image: np.ndarray) -> str:
    """Return a background (h, w) as a baseline keeps it."""
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
        raise ValueError("backgrounds: not base64; write the baseline again from its recording") from None
    if not data.startswith(b"\xff\xd8"):
        raise ValueError("backgrounds: not a JPEG file; write the baseline again from its recording")
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    except cv2.error:
        image = None
    if image is None or max(image.shape) > _LARGEST_PX:
        raise ValueError(
            "backgrounds: an image cannot be read or is too large; write the baseline again from its recording"
        )
    return np.asarray(image)
