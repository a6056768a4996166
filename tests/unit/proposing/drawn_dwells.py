"""Small drawn images of dwells: a textured wall, a reflector of three sheets, and whoever stands about."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.errors import CalibrationError
from calib_core.measurements import NS_PER_S, TimeNs

_SIZE_PX = (320, 200)
_FOCAL_PX = 400.0
CAMERA = Camera(
    model="plumb_bob",
    width_px=_SIZE_PX[0],
    height_px=_SIZE_PX[1],
    matrix_px=np.array([[_FOCAL_PX, 0.0, 159.5], [0.0, _FOCAL_PX, 99.5], [0.0, 0.0, 1.0]]),
    distortion=np.zeros(5),
)
_REFLECTOR_M = 0.24
_FINE = 8


@dataclass(frozen=True, slots=True, eq=False)
class DrawnDwell:
    """When and where a reflector stands.

    Attributes:
        start_s: of the dwell.
        end_s: of the dwell.
        apex_px: (column, row).
        range_m: from the radar, and from the camera.
    """

    start_s: float
    end_s: float
    apex_px: tuple[float, float]
    range_m: float = 6.0


def placements_of(dwells: Sequence[DrawnDwell]) -> tuple[Placement, ...]:
    """Return the dwells as the radar sees them."""
    found = []
    for dwell in dwells:
        position_m = dwell.range_m * np.array([1.0, 0.0, 0.0])
        found.append(
            Placement(TimeNs(round(dwell.start_s * NS_PER_S)), TimeNs(round(dwell.end_s * NS_PER_S)), position_m, 1.0)
        )
    return tuple(found)


def wall(seed: int = 0) -> np.ndarray:
    """Return a wall with texture: (h, w, 3) uint8."""
    rng = np.random.default_rng(seed)
    coarse = rng.uniform(80.0, 150.0, (_SIZE_PX[1] // 10, _SIZE_PX[0] // 10, 3)).astype(np.float32)
    return np.asarray(cv2.resize(coarse, _SIZE_PX, interpolation=cv2.INTER_CUBIC).clip(0, 255).astype(np.uint8))


@dataclass(eq=False)
class DrawnFrames:
    """Frames at 2 Hz; counts which are asked for.

    Attributes:
        dwells: of all reflectors.
        gains: of the channels at each second from the start; 1 where there is none.
        people: (start_s, end_s, left, top, width, height) of dark rectangles.
        moved_px: by how much all is shifted, columns and rows.
        broken: numbers of frames that cannot be read.
    """

    dwells: Sequence[DrawnDwell]
    gains: Sequence[tuple[float, float, float]] = ()
    people: Sequence[tuple[float, float, int, int, int, int]] = ()
    moved_px: tuple[int, int] = (0, 0)
    broken: frozenset[int] = frozenset()
    asked: list[int] = field(default_factory=list)

    @property
    def image_times(self) -> np.ndarray:
        """Stamps up to two seconds after the last dwell [ns]."""
        last_s = max(dwell.end_s for dwell in self.dwells) + 2.0
        return (np.arange(0.0, last_s, 0.5) * NS_PER_S).astype(np.int64)

    def image(self, index: int, /) -> np.ndarray:
        """Draw a frame."""
        self.asked.append(index)
        if index in self.broken:
            raise CalibrationError(f"frame {index} is broken")
        time_s = 0.5 * index
        drawn = wall()
        for dwell in self.dwells:
            if dwell.start_s <= time_s <= dwell.end_s:
                _draw_reflector(drawn, dwell.apex_px, _REFLECTOR_M / dwell.range_m * _FOCAL_PX)
        for start_s, end_s, left, top, width, height in self.people:
            if start_s <= time_s <= end_s:
                drawn[top : top + height, left : left + width] = (50, 40, 45)
        drawn = np.roll(drawn, self.moved_px[::-1], axis=(0, 1))
        noisy = drawn + np.random.default_rng(index).normal(0.0, 1.0, drawn.shape)
        gains = self.gains[int(time_s)] if int(time_s) < len(self.gains) else (1.0, 1.0, 1.0)
        return np.asarray((noisy * np.array(gains)).clip(0.0, 255.0).astype(np.uint8))


def _draw_reflector(drawn: np.ndarray, apex_px: tuple[float, float], width_px: float) -> None:
    """Fill three sheets that meet at the apex, smoothly."""
    reach = int(width_px) + 2
    left, top = (int(v) - reach for v in apex_px)
    part = drawn[top : top + 2 * reach, left : left + 2 * reach]
    fine = cv2.resize(part, None, fx=_FINE, fy=_FINE, interpolation=cv2.INTER_NEAREST)
    turns = np.deg2rad([-90.0, 30.0, 150.0])
    tips = np.stack([np.cos(turns), np.sin(turns)], axis=1) * 0.58 * width_px + apex_px
    for one, two, grey in ((0, 1, 235), (1, 2, 60), (2, 0, 165)):
        corners = (np.array([apex_px, tips[one], tips[two]]) - (left, top) + 0.5) * _FINE - 0.5
        cv2.fillPoly(fine, [np.round(corners * 16).astype(np.int32)], (grey, grey, grey), cv2.LINE_8, 4)
    part[:] = cv2.resize(fine, part.shape[1::-1], interpolation=cv2.INTER_AREA)
