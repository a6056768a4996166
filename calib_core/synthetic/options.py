"""Every option of a simulated recording: these are the flags of `cocalib simulate`."""

from dataclasses import dataclass, field
from typing import Literal

from calib_core.camera import CameraModel
from calib_core.errors import OptionError
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

    scene: SceneName = "rooftop"
    """The scene: a rooftop, an open field, a narrow aisle between shelves, or a yard with a checkerboard wall."""
    radar: RadarName = "awr1843"
    """A TI AWR1843 with its bins, or a finer imaging radar."""
    placements: int = 20
    """Number of placements of the reflector."""
    dwell_s: float = 6.0
    """How long the reflector stays at each placement, from release to pick-up [s]."""
    heights: bool = False
    """Put the reflector on a tripod of varying height instead of on the ground."""
    clutter: Clutter = "scene"
    """Static radar returns: none, those of the scene, or also strong objects that the camera does not see."""
    person: bool = True
    """Whether a person carries the reflector; otherwise it appears by itself."""
    camera_model: CameraModel = "plumb_bob"
    """Lens model."""
    field_of_view_deg: float | None = None
    """Horizontal field of view before distortion [deg]; 75 by default, 110 for equidistant."""
    width_px: int = 1280
    """Columns of the image."""
    height_px: int = 720
    """Rows of the image."""
    camera_rate_hz: float = 5.0
    """Frames per second."""
    radar_rate_hz: float = 10.0
    """Scans per second."""
    angle_bins: bool = True
    """Report azimuths on the radar's angle bins; otherwise the peak is interpolated."""
    radar_message: RadarMessage = "filled"
    """In ROS 1 bags: one RadarScan message per return, all fields filled ("filled") or range, bearing, Doppler bin and
    intensity left zero as the stock driver does ("stock"), or one PointCloud2 per scan ("cloud")."""
    raw_images: bool = False
    """Write sensor_msgs/Image instead of JPEG."""
    jpeg_quality: int = 85
    """JPEG quality, 1 to 100."""
    sensor_noise_grey: float = 0.0
    """Standard deviation of the camera's noise [grey levels of 255]; costs JPEG bytes."""
    stamp_jitter_s: float = 0.002
    """Standard deviation of both sensors' timing [s]."""
    dropped_share: float = 0.01
    """Share of frames and of scans that are lost."""
    clock_offset_s: float = 0.0
    """By how much the radar's stamps are ahead of the camera's clock [s]."""
    click_sigma_px: float = 0.7
    """Standard deviation of the example clicks, per axis [px]."""
    start_s: int = 1_760_000_000
    """When the recording starts [s since 1970]."""
    seed: int = 1
    """Seed of every random draw."""
    rig: RigOptions = field(default_factory=RigOptions)
    """How the sensors are mounted."""

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
