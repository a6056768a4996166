"""Every option of a simulated recording: these are the flags of `cocalib simulate`."""

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
    """The options of a simulated recording; the same options give the same bytes."""

    scene: SceneName = option(
        "rooftop",
        "Where it happens: a rooftop, an open field, a narrow aisle between shelves, a yard with a checkerboard wall.",
    )
    radar: RadarName = option("awr1843", "A TI AWR1843 with its bins, or a finer imaging radar.")
    placements: int = option(20, "How often the reflector is put down.")
    dwell_s: float = option(6.0, "How long it stays each time, from being released to being picked up again [s].")
    heights: bool = option(False, "Put it on a tripod of varying height instead of on the ground.")
    clutter: Clutter = option(
        "scene", "Static radar returns: none, what the scene shows, or also strong objects nobody sees."
    )
    person: bool = option(True, "Whether a person carries the reflector; without, it is simply there.")
    camera_model: CameraModel = option("plumb_bob", "Lens model.")
    field_of_view_deg: float | None = option(
        None, "Horizontal field of view before distortion [deg]; without it 75, for equidistant 110."
    )
    width_px: int = option(1280, "Columns of the image.")
    height_px: int = option(720, "Rows of the image.")
    camera_rate_hz: float = option(5.0, "Frames per second.")
    radar_rate_hz: float = option(10.0, "Scans per second.")
    angle_bins: bool = option(
        True, "Report azimuths on the lattice of the radar's angle bins; otherwise the peak is interpolated."
    )
    radar_message: RadarMessage = option(
        "filled",
        'In ROS 1 bags: one RadarScan message per return, all fields filled ("filled") or range, bearing, Doppler bin and '
        'intensity left zero as the stock driver does ("stock"), or one PointCloud2 per scan ("cloud").',
    )
    raw_images: bool = option(False, "Write sensor_msgs/Image instead of JPEG.")
    jpeg_quality: int = option(85, "JPEG quality, 1 to 100.")
    sensor_noise_grey: float = option(
        0.0, "Standard deviation of the camera's noise [grey levels of 255]; costs JPEG bytes."
    )
    stamp_jitter_s: float = option(0.002, "Standard deviation of both sensors' timing [s].")
    dropped_share: float = option(0.01, "Share of frames and of scans that never arrive.")
    clock_offset_s: float = option(0.0, "By how much the radar's stamps are ahead of the camera's clock [s].")
    click_sigma_px: float = option(0.7, "Standard deviation of the example clicks, per axis [px].")
    start_s: int = option(1_760_000_000, "When the recording starts [s since 1970].")
    seed: int = option(1, "Of every random draw.")
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
