"""Camera frames of simulated recordings: rendered on request, once and kept as JPEG, and under light that changes."""

import os
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from calib_core.arrays import TimesNs, Values
from calib_core.measurements import NS_PER_S
from calib_core.proposing import FrameSource
from calib_core.synthetic.recording import SimulatedRecording
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.scene.stage import child_rng

__all__ = ["ChangingLight", "KeptImages", "SimulatedImages"]

_JPEG_QUALITY = 90
_PERIODS_S = (25.0, 90.0)
_BRIGHTER = 0.22
_COLOURED = 0.04
_STEP = (0.75, 1.3)


class SimulatedImages:
    """Renders any frame; its camera noise is a draw of its own, so pixels differ from those of `frames()` by noise."""

    def __init__(self, recording: SimulatedRecording, renderer: FrameRenderer | None = None) -> None:
        self._recording, self._renderer = recording, renderer
        self.image_times: TimesNs = recording.stage.frame_times.header_ns

    def image(self, index: int, /) -> np.ndarray:
        """Render a frame, compressed as JPEG and decoded again: uint8 (h, w, 3), blue first."""
        rng = np.random.default_rng([int(child_rng(self._recording.options, 11).integers(2**31)), index])
        pixels = self._recording.image(index, rng, self._renderer)
        good, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        assert good, "OpenCV encodes every 8-bit image"
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR))


@dataclass(frozen=True, slots=True)
class KeptImages:
    """Frames that come from a folder if they were asked for before, and otherwise from their source.

    Attributes:
        source: renders a frame, slowly.
        folder: keeps each as NUMBER.jpg.
    """

    source: FrameSource
    folder: Path

    @property
    def image_times(self) -> TimesNs:
        """Their stamps, ascending [ns]."""
        return self.source.image_times

    def image(self, index: int, /) -> np.ndarray:
        """Return a frame: uint8 (h, w, 3), blue first. The first answer is compressed and decoded like every later one."""
        path = self.folder / f"{index}.jpg"
        if not path.is_file():
            good, data = cv2.imencode(".jpg", self.source.image(index), [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
            assert good, "OpenCV encodes every 8-bit image"
            path.parent.mkdir(parents=True, exist_ok=True)
            unfinished = path.with_suffix(f".{os.getpid()}")
            unfinished.write_bytes(data.tobytes())
            unfinished.replace(path)
        return np.asarray(cv2.imdecode(np.fromfile(path, dtype=np.uint8), cv2.IMREAD_COLOR))


class ChangingLight:
    """Frames whose brightness and tint drift, and that a change of exposure makes brighter or darker at once."""

    def __init__(self, source: FrameSource, seed: int) -> None:
        self._source = source
        self.image_times: TimesNs = source.image_times
        times_s = (self.image_times - self.image_times[0]) / NS_PER_S
        self._gains = _gains(times_s, np.random.default_rng([seed, 16]))

    def image(self, index: int, /) -> np.ndarray:
        """Return a frame: uint8 (h, w, 3), blue first."""
        bright = self._source.image(index).astype(np.float32) * self._gains[index].astype(np.float32)
        return np.asarray(np.clip(bright + 0.5, 0.0, 255.0).astype(np.uint8))


def _gains(times_s: Values, rng: np.random.Generator) -> np.ndarray:
    """Draw factors of the channels over time: (m, 3)."""
    waves = [
        np.sin(2.0 * np.pi * (times_s / rng.uniform(*_PERIODS_S) + rng.uniform()))[:, None] * weight
        for weight in (np.full(3, _BRIGHTER), _COLOURED * rng.standard_normal(3))
    ]
    changed = times_s > rng.uniform(0.2, 0.8) * times_s[-1]
    return np.asarray(np.exp(waves[0] + waves[1]) * np.where(changed, rng.uniform(*_STEP), 1.0)[:, None])
