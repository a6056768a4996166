"""Images of hypotheses: one frame with the radar's returns where each meaning of a file's numbers puts them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib_core.arrays import Points3
from calib_core.errors import InputError
from calib_core.measurements import TimeNs

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.interchange.hypotheses.ranking import Hypothesis
    from calib_core.recordings import Recording

_WITHIN_S = 0.3
_NEAR_M, _FAR_M = 2.0, 40.0
_QUALITY = 85


@dataclass(frozen=True, slots=True, eq=False)
class FrameWithReturns:
    """A frame of a recording, and what the radar saw at that time.

    Attributes:
        image: uint8 (h, w, 3), blue first.
        points_radar_m: (n, 3) the returns of the nearest scan; none if no scan is near.
        camera: the intrinsics of the image.
    """

    image: np.ndarray
    points_radar_m: Points3
    camera: "Camera"


@dataclass(frozen=True, slots=True)
class Offer:
    """One pose that the numbers in a file can mean.

    Attributes:
        place: of the numbers in the file.
        hypothesis: what they mean.
    """

    place: str
    hypothesis: "Hypothesis"


@dataclass(frozen=True, slots=True, eq=False)
class OpenMeaning:
    """A calibration that does not state what its numbers mean: a person picks, now or again.

    Attributes:
        name: of its file.
        offers: what they can mean, the likeliest first.
        camera: to draw with.
        shown: which of them the calibration is shown with; None if it is not shown until one is picked.
    """

    name: str
    offers: tuple[Offer, ...]
    camera: "Camera"
    shown: int | None = None


def frame_with_returns(recording: "Recording", camera: "Camera", index: int) -> FrameWithReturns:
    """Read a frame and the returns of the scan nearest to it.

    Args:
        recording: with images and a radar.
        camera: the intrinsics of its images.
        index: of the frame.

    Raises:
        InputError: the intrinsics are those of images of another size.
        RecordingError: the frame cannot be read.
    """
    image = recording.image(index)
    if image.shape[:2] != (camera.height_px, camera.width_px):
        height_px, width_px = image.shape[:2]
        raise InputError(
            f"{recording.name}: the images have {width_px} x {height_px} px, and the camera {camera.width_px} x "
            f"{camera.height_px} px; give the intrinsics of these images with --camera FILE"
        )
    time = TimeNs(int(recording.image_times[index]))
    scans = recording.radar_scans_around([time], _WITHIN_S)
    points_radar_m = scans.scan(scans.nearest(time)).points_radar_m if len(scans) else np.zeros((0, 3))
    return FrameWithReturns(image, points_radar_m[np.isfinite(points_radar_m).all(axis=1)], camera)


def tile(frame: FrameWithReturns, hypothesis: "Hypothesis", width_px: int) -> np.ndarray:
    """Draw the returns of a frame where a hypothesis puts them, nearer ones larger and warmer; uint8 (h, w, 3)."""
    import cv2

    scale = width_px / frame.image.shape[1]
    height_px = max(1, round(frame.image.shape[0] * scale))
    drawn = cv2.resize(frame.image, (width_px, height_px), interpolation=cv2.INTER_AREA)
    for (u_px, v_px), range_m in _pixels_and_ranges(frame, hypothesis):
        nearness = float(np.clip(np.log(_FAR_M / range_m) / np.log(_FAR_M / _NEAR_M), 0.0, 1.0))
        at = round((u_px + 0.5) * scale), round((v_px + 0.5) * scale)
        radius = 3 + round(4 * nearness)
        cv2.circle(drawn, at, radius + 1, (0, 0, 0), -1, cv2.LINE_AA)
        colour = (round(255 * (1 - nearness)), 180, round(255 * nearness))
        cv2.circle(drawn, at, radius, colour, -1, cv2.LINE_AA)
    return np.asarray(drawn)


def _pixels_and_ranges(frame: FrameWithReturns, hypothesis: "Hypothesis") -> list[tuple[tuple[float, float], float]]:
    """Return the pixel and the range of each return that is in the image."""
    if not len(frame.points_radar_m):
        return []
    points_camera_m = hypothesis.camera_from_radar @ frame.points_radar_m
    seen = np.flatnonzero(frame.camera.sees(points_camera_m))
    pixels_px = frame.camera.project(points_camera_m[seen])
    ranges_m = np.linalg.norm(frame.points_radar_m[seen], axis=1)
    return [
        ((float(u), float(v)), max(float(range_m), 1e-3)) for (u, v), range_m in zip(pixels_px, ranges_m, strict=True)
    ]


def jpeg(image: np.ndarray) -> bytes:
    """Return an image as a JPEG file."""
    import cv2

    return bytes(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1])
