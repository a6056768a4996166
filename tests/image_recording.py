"""A recording made of given images and an empty radar, for tests of page and port; simulated recordings with grey images."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import pytest

from calib_core.arrays import TimesNs
from calib_core.camera import Camera
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.synthetic.recording import SimulatedFrame, SimulatedRecording

START = 1_760_000_000 * NS_PER_S + 123_456_789


@dataclass(frozen=True)
class Image:
    data: bytes
    format: Literal["jpeg", "png"]
    width_px: int
    height_px: int


@dataclass
class ImageRecording:
    """Frames at 10 Hz from arrays (h, w, 3) of uint8."""

    images: Sequence[np.ndarray]
    radar_topic: str = "/radar"
    image_topic: str = "/camera"
    camera_info_topic: str | None = None
    radar_clock: str | None = "header"
    image_clock: str | None = "header"
    radar_axes: str | None = None
    video_start: str | None = None
    radar_topics: tuple[str, ...] = ("/radar",)
    radar_choice: str = ""
    assumptions: tuple[Any, ...] = ()
    stated_assumptions: tuple[Any, ...] = ()
    column_map: tuple[str, ...] = ()
    radar_option_notes: tuple[str, ...] = ()
    returns_origin: Any = None
    radar_columns: tuple[Any, ...] = ()
    radar_notes: tuple[str, ...] = ()
    image_names: tuple[str, ...] = ()
    radar_frame: str = "radar"
    camera_frame: str = "camera_optical"
    topics: tuple[Any, ...] = ()
    warnings: tuple[Any, ...] = ()
    damage: tuple[Any, ...] = ()
    paths: tuple[Path, ...] = ()
    radar_times: TimesNs = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        self._data = [cv2.imencode(".png", image)[1].tobytes() for image in self.images]
        self.image_times = START + np.arange(len(self.images), dtype=np.int64) * (NS_PER_S // 10)

    def image_bytes(self, index: int) -> Image:
        height_px, width_px = self.images[index].shape[:2]
        return Image(self._data[index], "png", width_px, height_px)

    def image(self, index: int) -> np.ndarray:
        return self.images[index]

    def camera(self) -> Camera | None:
        height_px, width_px = self.images[0].shape[:2]
        return Camera(
            "pinhole", width_px, height_px, np.array([[500, 0, width_px / 2], [0, 500, height_px / 2], [0, 0, 1]])
        )

    def radar_windows(self) -> Iterator[RadarScans]:
        return iter(())

    def radar_scans_around(self, times: Sequence[TimeNs], half_window_s: float) -> RadarScans:
        return RadarScans()

    def fingerprint(self) -> tuple[Any, ...]:
        return ()


def grey_images(count: int, width_px: int = 320, height_px: int = 240) -> list[np.ndarray]:
    """Return plain images, each of another grey."""
    return [np.full((height_px, width_px, 3), 20 + 10 * index % 200, dtype=np.uint8) for index in range(count)]


@contextmanager
def grey_frames() -> Iterator[None]:
    """Leave what is simulated meanwhile grey: where nobody looks at the images, rendering them is most of the work."""

    def frames(recording: SimulatedRecording, limit: int | None = None) -> Iterator[SimulatedFrame]:
        grey = np.full((recording.camera.height_px, recording.camera.width_px, 3), 90, np.uint8)
        times = recording.stage.frame_times
        for header, receive in zip(times.header_ns[:limit].tolist(), times.receive_ns[:limit].tolist(), strict=True):
            yield SimulatedFrame(TimeNs(header), TimeNs(receive), grey)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SimulatedRecording, "frames", frames)
        yield
