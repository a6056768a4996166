"""A recording of a person who walks along a street: images with a textured figure, and the radar's returns."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.measurements import Box, RadarScans, TimeNs
from cocalib.view.reference import Reference
from tests.image_recording import ImageRecording
from tests.street import CAMERA, TRUE_POSE, street

_GOLDEN = Path(__file__).parent / "golden" / "calibration-1.json"


class StreetRecording(ImageRecording):
    """One person, 10 Hz, with the true boxes as `street.boxes`."""

    def __init__(self, seconds: float = 4.0) -> None:
        self.street = street(people=1, seconds=seconds)
        texture = np.random.default_rng(3).normal(size=(24, 9)).astype(np.float32)
        self._figure = np.clip(128 + 70 * cv2.resize(texture, (45, 120), interpolation=cv2.INTER_CUBIC), 0, 255)
        super().__init__([self._drawn(frame.boxes) for frame in self.street.boxes])
        self.image_times = self.street.boxes.times_ns
        self.radar_times = self.street.scans.times_ns

    def radar_windows(self) -> Iterator[RadarScans]:
        yield self.street.scans

    def radar_scans_around(self, times: Sequence[TimeNs], half_window_s: float) -> RadarScans:
        reach_ns = round(half_window_s * 1e9)
        scans = self.street.scans
        if not len(times):
            return RadarScans()
        return scans.between(TimeNs(int(min(times)) - reach_ns), TimeNs(int(max(times)) + reach_ns))

    def camera(self):
        return CAMERA

    def _drawn(self, boxes: Sequence[Box]) -> np.ndarray:
        drawn = np.full((CAMERA.height_px, CAMERA.width_px, 3), 150, dtype=np.uint8)
        drawn[360:] = 90
        for box in boxes:
            left, top, right, bottom = (
                round(value) for value in (box.left_px, box.top_px, box.right_px, box.bottom_px)
            )
            if right - left > 4:
                figure = cv2.resize(self._figure, (right - left, bottom - top), interpolation=cv2.INTER_AREA)
                drawn[top:bottom, left:right] = figure[..., None].astype(np.uint8)
        return drawn


def reference_calibration() -> Reference:
    """The true pose, as a calibration that was given for review."""
    golden = read_calibration(_GOLDEN.read_text(encoding="utf-8")).calibration
    return Reference("true.json", replace(golden, camera=CAMERA, camera_from_radar=TRUE_POSE, pairs=()))
