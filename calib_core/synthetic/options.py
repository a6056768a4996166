"""All options of a simulated recording. They define the flags of `cocalib simulate`."""

from dataclasses import dataclass
from typing import Literal

from calib_core.camera import CameraModel
from calib_core.errors import OptionError
from calib_core.options import option
from calib_core.synthetic.rig import RigOptions

__all__ = ["Clutter", "Container", "RadarMessage", "RadarName", "SceneName", "SimulationOptions"]

SceneName = Literal["rooftop", "field", "aisle", "checkerboard"]
RadarName = Literal["awr1843", "imaging"]
RadarMessage = Literal["filled", "stock", "cloud"]
Clutter = Literal["none", "scene", "heavy"]
Container = Literal["ros1", "mcap", "db3"]


@dataclass(frozen=True, slots=True)
class SimulationOptions:
    """What to simulate; the same options give the same bytes."""

    scene: SceneName = option(
        "rooftop",
        "Scene: a rooftop, an open field, a narrow aisle between shelves, or a yard with a checkerboard wall.",
    )
    radar: RadarName = option("awr1843", "Radar: a TI AWR1843 with its bins, or a finer imaging radar.")
    placements: int = option(20, "Number of placements of the reflector.")
    dwell_s: float = option(6.0, "How long the reflector stays at each placement, from release to pick-up [s].")
    heights: bool = option(False, "Put the reflector on a tripod of varying height instead of on the ground.")
    clutter: Clutter = option(
        "scene", "Static radar returns: none, from the visible scene, or also from strong invisible objects."
    )
    person: bool = option(True, "Have a person carry the reflector; otherwise it just appears at each placement.")
    camera_model: CameraModel = option("plumb_bob", "Lens model.")
    field_of_view_deg: float | None = option(
        None, "Horizontal field of view before distortion [deg]; by default 75, or 110 for equidistant."
    )
    width_px: int = option(1280, "Image width in pixels.")
    height_px: int = option(720, "Image height in pixels.")
    camera_rate_hz: float = option(5.0, "Frames per second.")
    radar_rate_hz: float = option(10.0, "Scans per second.")
    angle_bins: bool = option(
        True, "Report azimuths on the grid of the radar's angle bins; otherwise interpolate the peak."
    )
    radar_message: RadarMessage = option(
        "filled",
        'In ROS 1 bags: one RadarScan message per return with all fields filled ("filled"), or with range, bearing, Doppler '
        'bin and intensity zero as in the stock driver ("stock"), or one PointCloud2 per scan ("cloud").',
    )
    raw_images: bool = option(False, "Write sensor_msgs/Image instead of JPEG.")
    jpeg_quality: int = option(85, "JPEG quality, 1 to 100.")
    sensor_noise_grey: float = option(
        0.0, "Standard deviation of the camera's noise [grey levels of 255]; makes JPEG larger."
    )
    stamp_jitter_s: float = option(0.002, "Standard deviation of the timing of both sensors [s].")
    dropped_share: float = option(0.01, "Fraction of frames and scans that are lost.")
    clock_offset_s: float = option(0.0, "How far the radar's stamps are ahead of the camera's clock [s].")
    click_sigma_px: float = option(0.7, "Standard deviation of the example clicks, per axis [px].")
    start_s: int = option(1_760_000_000, "Start of the recording [s since 1970].")
    seed: int = option(1, "Seed of the random generator.")
    rig: RigOptions = option(RigOptions(), "How the sensors are mounted.")

    def __post_init__(self) -> None:
        _require(self.placements >= 1, "placements", self.placements, "at least 1")
        _require(self.dwell_s >= 3.5, "dwell_s", self.dwell_s, "at least 3.5 s, for the person to step away and return")
        _require(min(self.camera_rate_hz, self.radar_rate_hz) > 0, "rates", self.camera_rate_hz, "more than 0 Hz")
        _require(1 <= self.jpeg_quality <= 100, "jpeg_quality", self.jpeg_quality, "1 to 100")
        _require(0.0 <= self.dropped_share < 0.9, "dropped_share", self.dropped_share, "0 to 0.9")
        _require(min(self.width_px, self.height_px) >= 64, "image size", self.width_px, "at least 64 px")


def _require(good: bool, name: str, value: object, wanted: str) -> None:
    if not good:
        raise OptionError(f"simulation option {name} is {value}; it must be {wanted}")
