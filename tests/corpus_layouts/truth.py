"""What a layout holds: returns, images and a camera, made here and known exactly."""

from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from calib_core.recordings import RecordingOptions

START_NS = 1_715_938_951_208_764_000  # 2024-05-17T09:42:31.208764Z
SCANS, FRAMES = 40, 48
WIDTH_PX, HEIGHT_PX = 160, 120
CAMERA = np.array([[131.5, 0.0, 80.25], [0.0, 131.5, 59.75], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Returns:
    """Returns in the radar frame, with the scan's time for each.

    Attributes:
        times_ns: (n,) time of the scan.
        points_m: (n, 3) x forward, y left, z up.
        doppler_mps: (n,) positive moving away.
        snr_db: (n,) amplitude.
    """

    times_ns: np.ndarray
    points_m: np.ndarray
    doppler_mps: np.ndarray
    snr_db: np.ndarray

    def scans(self) -> list["Returns"]:
        return [self.of_time(time) for time in np.unique(self.times_ns)]

    def of_time(self, time_ns: int) -> "Returns":
        return self.where(self.times_ns == time_ns)

    def where(self, mask: np.ndarray) -> "Returns":
        return Returns(self.times_ns[mask], self.points_m[mask], self.doppler_mps[mask], self.snr_db[mask])

    def with_points(self, points_m: np.ndarray) -> "Returns":
        return Returns(self.times_ns, points_m, self.doppler_mps, self.snr_db)

    def with_times(self, times_ns: np.ndarray) -> "Returns":
        return Returns(times_ns, self.points_m, self.doppler_mps, self.snr_db)

    def joined(self, other: "Returns") -> "Returns":
        return Returns(
            np.concatenate([self.times_ns, other.times_ns]),
            np.concatenate([self.points_m, other.points_m]),
            np.concatenate([self.doppler_mps, other.doppler_mps]),
            np.concatenate([self.snr_db, other.snr_db]),
        )


@dataclass(frozen=True, eq=False)
class Truth:
    """What reading a layout must give.

    Attributes:
        paths: what the user opens.
        returns: every return of the radar that should be used.
        image_times_ns: (m,) times of the frames; frame k has the grey grey_of_frame(k * frame_step); empty without returns.
        has_camera: whether the layout states CAMERA.
        position_tolerance_m: what the layout's number types lose.
        time_tolerance_ns: what the layout's times lose.
        has_doppler: whether the layout states the speed.
        times_are_relative: the files hold no times; scan k belongs to frame k.
        given: options a user has to give to read it at all, such as the start of a stream without times.
        stated: options that say what the layout leaves open.
        as_assumed_m: (n, 3) the positions under another assumption, where the layout leaves open what they are.
    """

    paths: tuple[Path, ...]
    returns: Returns
    image_times_ns: np.ndarray
    has_camera: bool = True
    position_tolerance_m: float = 2e-3
    time_tolerance_ns: int = 0
    has_doppler: bool = True
    times_are_relative: bool = False
    given: RecordingOptions = field(default_factory=RecordingOptions)
    stated: RecordingOptions | None = None
    as_assumed_m: np.ndarray | None = None
    frame_step: int = 1


def scene(seed: int, *, scans: int = SCANS, start_ns: int = START_NS, period_ns: int = 100_000_000) -> Returns:
    """Return a parking lot: a reflector in view, clutter on both sides and a few movers, 18 to 30 returns a scan."""
    rng = np.random.default_rng(seed)
    parts = [_scan(rng, start_ns + number * period_ns) for number in range(scans)]
    whole = parts[0]
    for part in parts[1:]:
        whole = whole.joined(part)
    return whole


def _scan(rng: np.random.Generator, time_ns: int) -> Returns:
    count = int(rng.integers(18, 31))
    azimuth = rng.uniform(-1.0, 0.8, count)
    elevation = rng.uniform(-0.12, 0.2, count)
    range_m = rng.uniform(2.5, 45.0, count)
    azimuth[0], elevation[0], range_m[0] = 0.21, 0.02, 9.4
    forward_m = range_m * np.cos(elevation)
    points_m = np.column_stack([forward_m * np.cos(azimuth), forward_m * np.sin(azimuth), range_m * np.sin(elevation)])
    doppler_mps = np.where(rng.uniform(size=count) < 0.3, rng.uniform(-9.0, 9.0, count), rng.normal(0.0, 0.05, count))
    snr_db = rng.uniform(6.0, 35.0, count)
    return Returns(np.full(count, time_ns, dtype=np.int64), points_m, doppler_mps, snr_db)


def mirrored(points_m: np.ndarray) -> np.ndarray:
    """Return the positions (n, 3) of an azimuth that is taken to grow to the other side."""
    return points_m * [1.0, -1.0, 1.0]


def polar(points_m: np.ndarray) -> np.ndarray:
    """Return (n, 3) range [m], azimuth [rad, positive to the left], elevation [rad, positive upwards]."""
    range_m = np.linalg.norm(points_m, axis=1)
    return np.column_stack([range_m, np.arctan2(points_m[:, 1], points_m[:, 0]), np.arcsin(points_m[:, 2] / range_m)])


def image_times(frames: int = FRAMES, *, start_ns: int = START_NS + 12_000_000, rate_hz: float = 12.0) -> np.ndarray:
    """Return the frames' times, to whole microseconds."""
    return start_ns + (np.arange(frames) * 1e6 / rate_hz).astype(np.int64) * 1000


def grey_of_frame(number: int) -> int:
    return 20 + 4 * number


def jpeg(number: int, suffix: str = ".jpg") -> bytes:
    """Return the image of a frame, plain grey, so that it tells its number."""
    pixels = np.full((HEIGHT_PX, WIDTH_PX, 3), grey_of_frame(number), dtype=np.uint8)
    return cv2.imencode(suffix, pixels)[1].tobytes()
