"""A simulated recording: scans are measured and frames are rendered on demand, so memory stays bounded."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from calib_core.arrays import Points2, Points3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.radar_returns import Antenna
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.scans import labelled_scans
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
        assert good, "OpenCV encodes every 8-bit image"
        return bytes(data)


@dataclass(frozen=True, eq=False)
class SimulatedRecording:
    """The data that two recorders would have written, and the truth.

    Attributes:
        stage: everything decided before the sensors measure.
        placements: the truth about each placement, in order of time.
        clicks: the example clicks, one for each placement in their order, with click noise; ids "c1", "c2", ...
        first: of a second camera, the same recording through the first one, which has the same scans.
    """

    stage: Stage
    placements: tuple[SimulatedPlacement, ...]
    clicks: tuple[ReflectorClick, ...]
    first: "SimulatedRecording | None" = None

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
    def points_radar_m(self) -> Points3:
        """The true position of each placement: (n, 3)."""
        return np.array([placement.position_radar_m for placement in self.placements]).reshape(-1, 3)

    @property
    def pixels_px(self) -> Points2:
        """The true pixel of each placement: (n, 2)."""
        return np.array([placement.pixel_px for placement in self.placements]).reshape(-1, 2)

    @property
    def other_camera(self) -> "SimulatedRecording | None":
        """The same recording as the second camera sees it; None if there is none."""
        stage = self.stage.of_other_camera
        return None if stage is None else _recorded(stage, self)

    @cached_property
    def scans(self) -> RadarScans:
        """The scans of all antennas, by header stamps."""
        if self.first is not None:
            return self.first.scans
        return RadarScans.from_scans([scan for antenna in self.stage.antennas for scan in self.scans_of(antenna)])

    def scans_of(self, antenna: Antenna) -> Iterator[RadarScan]:
        """Yield the scans of one of the stage's antennas; the same scans every time."""
        return (scan for scan, _ in labelled_scans(self.stage, antenna))

    @cached_property
    def renderer(self) -> FrameRenderer:
        """What draws the frames; its backdrop takes some seconds."""
        stage, options = self.stage, self.options
        companion = options.surroundings.companion
        return FrameRenderer.of(stage.scene, stage.rig, companion=companion, edge_m=options.reflector_edge_m)

    def image(self, index: int, rng: np.random.Generator, renderer: FrameRenderer | None = None) -> np.ndarray:
        """Render a frame: (h, w, 3) uint8, blue first.

        Args:
            index: of the frame.
            rng: of the camera's noise.
            renderer: to draw it with another look.
        """
        stage, options, moment_s = self.stage, self.options, float(self.stage.frame_times.moment_s[index])
        return (renderer or self.renderer).render(
            stage.story.at(moment_s),
            person=options.person,
            board=stage.waving.at(moment_s) if stage.waving else None,
            noise_grey=options.sensor_noise_grey,
            rng=rng,
        )

    def frames(self, limit: int | None = None) -> Iterator[SimulatedFrame]:
        """Render and yield frames; the same frames every time.

        Args:
            limit: number of frames from the start; None for all.
        """
        rng, times = child_rng(self.options, 11), self.stage.frame_times
        for i in range(len(times))[:limit]:
            header, receive = int(times.header_ns[i]), int(times.receive_ns[i])
            yield SimulatedFrame(TimeNs(header), TimeNs(receive), self.image(i, rng))


def simulate(options: SimulationOptions | None = None) -> SimulatedRecording:
    """Set up a recording; nothing is measured or rendered until requested.

    Args:
        options: what to simulate; None takes the defaults.
    """
    return _recorded(set_stage(options or SimulationOptions()))


def _recorded(stage: Stage, first: SimulatedRecording | None = None) -> SimulatedRecording:
    placements = placements_of(stage)
    return SimulatedRecording(stage, placements, _clicks(stage, placements), first)


def _clicks(stage: Stage, placements: tuple[SimulatedPlacement, ...]) -> tuple[ReflectorClick, ...]:
    """Click each placement in its best frame, with click noise."""
    noise_px = stage.options.click_sigma_px * child_rng(stage.options, 8).standard_normal((len(placements), 2))
    clicks = []
    for number, (placement, error_px) in enumerate(zip(placements, noise_px, strict=True), 1):
        u_px, v_px = (placement.pixel_px + error_px).tolist()
        clicks.append(ReflectorClick(placement.best_image_time, f"c{number}", round(u_px, 2), round(v_px, 2)))
    return tuple(clicks)
