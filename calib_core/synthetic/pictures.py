"""Frames of a simulated recording by number: only those asked for are rendered."""

from functools import cached_property

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.synthetic.recording import SimulatedRecording
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.scene.stage import child_rng

_JPEG_QUALITY = 90


class SimulatedPictures:
    """Renders any frame; its camera noise is a draw of its own, so pixels differ from those of `frames()` by noise."""

    def __init__(self, recording: SimulatedRecording, renderer: FrameRenderer | None = None) -> None:
        self._recording = recording
        self._given = renderer
        self.image_times: TimesNs = recording.stage.frame_times.header_ns

    @cached_property
    def _renderer(self) -> FrameRenderer:
        if self._given is not None:
            return self._given
        stage, options = self._recording.stage, self._recording.options
        return FrameRenderer.of(
            stage.scene, stage.rig, options.surroundings, options.reflector_edge_m, options.reflector_design
        )

    def image(self, index: int, /) -> np.ndarray:
        """Render a frame, compressed as JPEG and decoded again: uint8 (h, w, 3), blue first."""
        import cv2

        stage, options = self._recording.stage, self._recording.options
        moment_s = float(stage.frame_times.moment_s[index])
        board = stage.waving.at(moment_s) if stage.waving else None
        pixels = self._renderer.render(
            stage.story.at(moment_s),
            person=options.person,
            board=board,
            noise_grey=options.sensor_noise_grey,
            rng=np.random.default_rng([int(child_rng(options, 11).integers(2**31)), index]),
        )
        good, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        assert good, "OpenCV encodes every 8-bit picture"
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR))
