"""Messages to be written to recordings, as values. For simulated recordings and for tests."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from calib_core.arrays import frozen_array
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import TimeNs


@dataclass(frozen=True, slots=True)
class CompressedImageMessage:
    """A sensor_msgs/CompressedImage: the bytes of a JPEG or PNG file."""

    stamp: TimeNs
    frame_id: str
    data: bytes
    format: str = "jpeg"


@dataclass(frozen=True, slots=True, eq=False)
class ImageMessage:
    """A sensor_msgs/Image of encoding bgr8: pixels are (h, w, 3) uint8, blue first."""

    stamp: TimeNs
    frame_id: str
    pixels: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "pixels", frozen_array(self.pixels, (None, None, 3), dtype=np.uint8))


@dataclass(frozen=True, slots=True, eq=False)
class CameraInfoMessage:
    """A sensor_msgs/CameraInfo."""

    stamp: TimeNs
    frame_id: str
    camera: Camera


@dataclass(frozen=True, slots=True, eq=False)
class CloudMessage:
    """A sensor_msgs/PointCloud2 of little-endian float32 fields without padding: values are (n, k) for k names."""

    stamp: TimeNs
    frame_id: str
    names: tuple[str, ...]
    values: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen_array(self.values, (None, len(self.names)), dtype=np.float32))


@dataclass(frozen=True, slots=True)
class RadarReturnMessage:
    """A ti_mmwave_rospkg/RadarScan: one return; point_id 0 begins a scan.

    Attributes:
        stamp: when the driver parsed the return.
        frame_id: of the radar.
        point_id: index in its scan.
        x_m: forward.
        y_m: left.
        z_m: up.
        range_m: 0 in the stock driver, which never sets it; likewise doppler_bin, bearing and intensity.
        velocity_mps: positive moving away.
        doppler_bin: 0 to the number of bins minus 1; zero speed is at half the number of bins.
        bearing_deg: positive to the left.
        intensity_db: SNR.
    """

    stamp: TimeNs
    frame_id: str
    point_id: int
    x_m: float
    y_m: float
    z_m: float
    range_m: float
    velocity_mps: float
    doppler_bin: int
    bearing_deg: float
    intensity_db: float


@dataclass(frozen=True, slots=True, eq=False)
class VendorScanMessage:
    """A scan in a vendor's own message: a packet with an array of structs, whose fields have prefixes.

    Attributes:
        stamp: of the scan.
        frame_id: of the radar.
        polar: (n, 3) range [m], azimuth to the left and elevation upwards [rad].
        doppler_mps: (n,) positive moving away.
        rcs_dbsm: (n,).
    """

    stamp: TimeNs
    frame_id: str
    polar: np.ndarray
    doppler_mps: np.ndarray
    rcs_dbsm: np.ndarray

    def __post_init__(self) -> None:
        count = len(self.polar)
        object.__setattr__(self, "polar", frozen_array(self.polar, (count, 3)))
        for name in ("doppler_mps", "rcs_dbsm"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (count,)))


@dataclass(frozen=True, slots=True, eq=False)
class TransformMessage:
    """A tf2_msgs/TFMessage of one transform.

    Attributes:
        stamp: of the transform.
        frame_id: of the parent.
        child_frame_id: of the child.
        parent_from_child: the pose of the child in the parent.
    """

    stamp: TimeNs
    frame_id: str
    child_frame_id: str
    parent_from_child: RigidTransform


MessageBody: TypeAlias = (
    CompressedImageMessage
    | ImageMessage
    | CameraInfoMessage
    | CloudMessage
    | RadarReturnMessage
    | TransformMessage
    | VendorScanMessage
)


@dataclass(frozen=True, slots=True, eq=False)
class RecordedMessage:
    """A message as received by the recorder."""

    topic: str
    receive_time: TimeNs
    body: MessageBody
