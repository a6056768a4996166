"""Small cases for tests: few placements, small images, and a backdrop that is not traced ray by ray."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import cv2
import numpy as np

from benchmarks.proposing.cases import Case, case_of
from benchmarks.proposing.drawn import Drawn, drawn_from
from benchmarks.proposing.images import SimulatedImages
from calib_core.arrays import TimesNs
from calib_core.proposing import FrameSource
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.rendering.still import Still, pixel_rays

__all__ = ["draw_small", "quick_frames", "small_case"]

_SIZE_PX = (480, 270)
_PLACEMENTS = 4
_MORE = 6
_GREY = (70.0, 150.0)
_COARSE_PX = 20


def small_case(seed: int) -> Case:
    """Return the case of a seed with fewer and smaller images; every fourth has enough placements for `--auto`."""
    case = case_of(seed)
    options = replace(
        case.options,
        placements=_MORE if seed % 4 == 0 else _PLACEMENTS,
        dwell_s=4.0,
        width_px=_SIZE_PX[0],
        height_px=_SIZE_PX[1],
        camera_rate_hz=0.8,
        radar_rate_hz=5.0,
        sensor_noise_grey=0.0,
    )
    return replace(case, options=options)


def draw_small(seed: int, renderer: Callable[..., FrameRenderer] = FrameRenderer) -> Drawn:
    """Simulate a small case; nothing is kept on the disk."""
    case = small_case(seed)
    recording = simulate(case.options)
    return drawn_from(recording, case, None, quick_frames(recording, renderer))


def quick_frames(recording: SimulatedRecording, renderer: Callable[..., FrameRenderer] = FrameRenderer) -> FrameSource:
    """Return the frames of a recording before a backdrop that is not traced, each rendered once."""
    return _Remembered(SimulatedImages(recording, _rendered_by(renderer, recording)))


class _Remembered:
    """Frames that are rendered once."""

    def __init__(self, source: FrameSource) -> None:
        self.image_times: TimesNs = source.image_times
        self.image = cache(source.image)


def _rendered_by(renderer: Callable[..., FrameRenderer], recording: SimulatedRecording) -> FrameRenderer:
    """Return a renderer with soft spots of grey in place of the scene."""
    rig, options = recording.stage.rig, recording.options
    width_px, height_px = rig.camera.width_px, rig.camera.height_px
    rng = np.random.default_rng([options.seed, 19])
    spots = rng.uniform(*_GREY, (height_px // _COARSE_PX, width_px // _COARSE_PX, 3)).astype(np.float32)
    levels = np.asarray(cv2.resize(spots, (width_px, height_px), interpolation=cv2.INTER_CUBIC))
    still = Still(
        levels,
        np.full((height_px, width_px), np.inf, dtype=np.float32),
        np.zeros((height_px, width_px), dtype=np.bool_),
        pixel_rays(rig),
        rig.camera_position_world_m,
    )
    return renderer(recording.stage.scene, rig, still)
