"""A simulated recording: frames are rendered on demand, so memory stays bounded."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import RadarScan, ReflectorClick, TimeNs
from calib_core.synthetic.clicking import SimulatedClick, clicks_of
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.radar_returns import Antenna
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.scans import antenna_scans, radar_scans
from calib_core.synthetic.scene.stage import SimulatedPlacement, Stage, child_rng, placements_of, set_stage


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedFrame:
    """One camera frame.

    Attributes:
        time: its header stamp.
        receive_time: when the recorder got it.
        pixels: (h, w, 3) uint8, blue first.
    """

    time: TimeNs
    receive_time: TimeNs
    pixels: np.ndarray

    def jpeg(self, quality: int) -> bytes:
        """Encode as JPEG."""
        import cv2

        good, data = cv2.imencode(
            ".jpg", self.pixels, [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_OPTIMIZE, 1]
        )
        assert good, "OpenCV encodes every 8-bit picture"
        return bytes(data)


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedRecording:
    """The data that two recorders would have written, and the truth.

    Attributes:
        stage: everything decided before the sensors measure.
        placements: the truth about each placement, in order of time.
        clicked: the example clicks with their truth; by default one per placement, with click noise.
    """

    stage: Stage
    placements: tuple[SimulatedPlacement, ...]
    clicked: tuple[SimulatedClick, ...]

    @property
    def clicks(self) -> tuple[ReflectorClick, ...]:
        """The example clicks."""
        return tuple(one.click for one in self.clicked)

    @property
    def options(self) -> SimulationOptions:
        """The options it was made with."""
        return self.stage.options

    @property
    def camera(self) -> Camera:
        """The intrinsics."""
        return self.stage.rig.camera

    @property
    def camera_from_radar(self) -> RigidTransform:
        """The true pose."""
        return self.stage.rig.camera_from_radar

    @property
    def other_camera(self) -> "SimulatedRecording | None":
        """The same recording as the second camera sees it; None if there is none."""
        stage = self.stage.of_other_camera
        return None if stage is None else _recorded(stage)

    def scans(self) -> Iterator[RadarScan]:
        """Yield the scans of all antennas in order of header stamps; the same scans every time."""
        return radar_scans(self.stage)

    def scans_of(self, antenna: Antenna) -> Iterator[RadarScan]:
        """Yield the scans of one of the stage's antennas."""
        return antenna_scans(self.stage, antenna)

    def frames(self, limit: int | None = None) -> Iterator[SimulatedFrame]:
        """Render and yield frames; the same frames every time.

        Args:
            limit: number of frames from the start; None for all.
        """
        stage, options = self.stage, self.options
        renderer = FrameRenderer.of(
            stage.scene, stage.rig, options.surroundings, options.reflector_edge_m, options.reflector_design
        )
        rng = child_rng(options, 11)
        for i, moment_s in enumerate(stage.frame_times.moment_s[:limit]):
            moment = stage.story.at(float(moment_s))
            board = stage.waving.at(float(moment_s)) if stage.waving else None
            noise_grey = options.sensor_noise_grey
            pixels = renderer.render(moment, person=options.person, board=board, noise_grey=noise_grey, rng=rng)
            header, receive = int(stage.frame_times.header_ns[i]), int(stage.frame_times.receive_ns[i])
            yield SimulatedFrame(TimeNs(header), TimeNs(receive), pixels)


def simulate(options: SimulationOptions | None = None) -> SimulatedRecording:
    """Set up a recording; nothing is measured or rendered until requested.

    Args:
        options: what to simulate; None takes the defaults.
    """
    return _recorded(set_stage(options or SimulationOptions()))


def _recorded(stage: Stage) -> SimulatedRecording:
    placements = placements_of(stage)
    return SimulatedRecording(stage, placements, clicks_of(stage, placements))


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
