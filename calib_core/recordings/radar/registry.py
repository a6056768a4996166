"""The registry of radar layouts: how each is recognized, and what its values mean.

A layout is recognized by the names of its fields, as the recording itself declares them, never by the name of a
package: three packages are called radar_msgs. If several match, the one with the most fields is used; a message
that matches none is read by its columns alone (column_guess.py).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

MessageKind = Literal["cloud", "channels", "list", "arrays", "point"]
"""sensor_msgs/PointCloud2, sensor_msgs/PointCloud, a header with one list, arrays side by side, or one return each."""

_RADIANS = "rad, azimuth positive to the left, elevation upwards"
_UNUSED = "not used, since the message has positions"
NO_QUANTITY = "none"
_AWAY = "positive moving away"


@dataclass(frozen=True, slots=True)
class Decoder:
    """One layout: how it is recognized, its units and signs, and where its names mislead.

    Attributes:
        name: name for display.
        source: the packages or data sets that use it, with the message's name.
        kind: what the fields are fields of.
        fields: all are required; case does not matter. For lists, the fields of an element; nested ones dotted.
        angles: unit and signs of azimuth and elevation.
        speed: sign of the radial speed [m/s], or how it comes about.
        amplitude: unit of the amplitude.
        noise: what the message says about its own noise.
        note: anything else the user should know.
        assumed: what no document of the layout states, as a sentence; it becomes an assumption.
        confirm: the options that state what is assumed.
        polar: range, azimuth and perhaps elevation where their names do not say so.
        doppler: the radial speed where its name does not say so.
        amplitude_field: likewise.
        degrees: the angles are in degrees, which the message does not say.
        azimuth_sign: 1 where azimuth is positive to the left, -1 to the right.
        amplitude_scale: unit of the amplitude in dB.
        covariance: the array with the position's covariance.
        needed: flags that are zero where there is no return.
        point_number: the field that numbers returns within a scan.
        count_field: how many elements of arrays hold returns.
        shared_with_lidars: lidars have the same fields.
    """

    name: str
    source: str
    kind: MessageKind
    fields: tuple[str, ...]
    angles: str = NO_QUANTITY
    speed: str = _AWAY
    amplitude: str = "dB"
    noise: str = NO_QUANTITY
    note: str = ""
    assumed: str = ""
    confirm: str = "--radar-axes forward,left,up"
    polar: tuple[str, ...] = ()
    doppler: str | None = None
    amplitude_field: str | None = None
    degrees: bool = False
    azimuth_sign: Literal[1, -1] = 1
    amplitude_scale: float = 1.0
    covariance: str | None = None
    needed: tuple[str, ...] = ()
    point_number: str | None = None
    count_field: str | None = None
    shared_with_lidars: bool = False

    @property
    def columns(self) -> Mapping[str, str]:
        """The columns whose names do not say what they are, by quantity."""
        others = {"doppler": self.doppler, "amplitude": self.amplitude_field}
        polar = dict(zip(("range", "azimuth", "elevation"), self.polar, strict=False))
        return polar | {quantity: name for quantity, name in others.items() if name}


def _f(words: str) -> tuple[str, ...]:
    return tuple(words.split())


_CLOUDS = (
    Decoder(
        "positions and intensity", "ti_mmwave_rospkg of radar-lab, radar_scan_pcl; any XYZI cloud", "cloud",
        _f("x y z intensity"), speed=NO_QUANTITY, amplitude="of the driver's choice", shared_with_lidars=True,
        note="a lidar's cloud looks the same: choose it with --radar-topic",
    ),
    Decoder(
        "positions, intensity and speed", "ti_mmwave_rospkg, radar_scan_pcl with speed; RIO's ti_mmwave", "cloud",
        _f("x y z intensity velocity"), note="several forks leave the stamp 0: receive times are then used",
    ),
    Decoder(
        "TI mmWave cloud with bearing", "ti_mmwave_rospkg of leicheng5 and its forks, radar_scan_pcl", "cloud",
        _f("x y z intensity velocity range bearing doppler_bin"), angles=f"deg, positive to the left; {_UNUSED}",
        note="range and bearing may be left at 0",
    ),
    Decoder(
        "RIO cloud", "rio (radar inertial odometry), filtered and raw clouds", "cloud",
        _f("x y z snr_db v_doppler_mps noise_db range"),
    ),
    Decoder(
        "ARS548 detections, 8 fields", "ars548_driver of robotics-upo, DetectionList", "cloud",
        _f("x y z v r RCS azimuth elevation"), angles=f"{_RADIANS}; {_UNUSED}", amplitude="dBsm",
    ),
    Decoder(
        "ARS548 detections, 18 fields", "nebula, continental_ars548 detections", "cloud",
        _f("x y z azimuth azimuth_std elevation elevation_std range range_std range_rate range_rate_std rcs measurement_id "
           "positive_predictive_value classification multi_target_probability object_id ambiguity_flag"),
        angles=f"{_RADIANS}; {_UNUSED}", amplitude="dBsm", noise="standard deviations of range, azimuth and elevation",
    ),
    Decoder(
        "positions and velocities", "ars548_driver of robotics-upo, ObjectList; other trackers", "cloud", _f("x y z vx vy"),
        speed="from vx, vy along the line of sight", amplitude=NO_QUANTITY, note="tracked extents, not reflections",
    ),
    Decoder(
        "smartmicro targets", "smartmicro_ros2_radars (UMRR), targets", "cloud",
        _f("x y z radial_speed power rcs noise snr azimuth_angle elevation_angle range"),
        angles=f"{_RADIANS}; {_UNUSED}", note="stamps are the sensor's own clock, in microseconds",
    ),
    Decoder(
        "smartmicro objects", "smartmicro_ros2_radars (UMRR), objects", "cloud",
        _f("x y z speed_absolute heading length quality acceleration object_id"),
        speed="none: speed_absolute is along the heading", amplitude=NO_QUANTITY, note="tracked extents, not reflections",
    ),
    Decoder(
        "CARLA radar", "carla_ros_bridge, radar", "cloud",
        _f("x y z Range Velocity AzimuthAngle ElevationAngle"),
        angles=f"rad, azimuth positive to the right, against y; {_UNUSED}", amplitude=NO_QUANTITY,
        note="ElevationAngle is at byte 28, not 24: offsets are read as declared",
    ),
    Decoder(
        "nuScenes radar", "nuScenes samples/RADAR_*, .pcd (binary, version 0.7)", "cloud",
        _f("x y z dyn_prop id rcs vx vy vx_comp vy_comp is_quality_valid ambig_state x_rms y_rms invalid_state pdh0"),
        speed="from vx, vy along the line of sight", amplitude="dBsm",
        note="z is always 0; the data set's default filters are off; x_rms and y_rms are classes, not meters",
    ),
    Decoder(
        "View-of-Delft radar", "View-of-Delft radar/*.bin (7 float32 each)", "cloud",
        _f("x y z rcs v_r v_r_compensated time"), amplitude="dBsm", note="files are numbered, not stamped",
    ),
    Decoder(
        "TJ4DRadSet radar", "TJ4DRadSet velodyne/*.bin (8 float32 each)", "cloud",
        _f("x y z v_r range power alpha beta"), angles=f"alpha and beta, {_UNUSED}", note="files are numbered, not stamped",
    ),
)  # fmt: skip

_CHANNELS = (
    Decoder(
        "Oculii cloud", "Oculii Eagle, radar_enhanced_pcl, sensor_msgs/PointCloud", "channels", _f("x y z Doppler Power"),
    ),
    Decoder(
        "Oculii cloud, unnamed channels", "the same from drivers that name no channel", "channels",
        _f("x y z channel0 channel1 channel2"), doppler="channel0", amplitude_field="channel2",
        assumed="the channels have no names; the first is assumed to be the speed and the third the power, as in Oculii's order",
        confirm="--map doppler=channel0:mps --map amplitude=channel2:db",
    ),
)  # fmt: skip

_LISTS = (
    Decoder(
        "radar_msgs scan", "ros-perception radar_msgs/RadarScan", "list",
        _f("range azimuth elevation doppler_velocity amplitude"), angles=_RADIANS,
    ),
    Decoder(
        "radar_msgs tracks", "ros-perception radar_msgs/RadarTracks", "list",
        _f("position.x position.y position.z velocity.x velocity.y velocity.z position_covariance"),
        speed="from velocity along the line of sight", amplitude=NO_QUANTITY, covariance="position_covariance",
        noise="covariance of the position, six figures; 0 means unknown", note="tracked objects, not reflections",
    ),
    Decoder(
        "AutonomouStuff detections", "AutonomouStuff radar_msgs/RadarDetectionArray", "list",
        _f("detection_id position.x position.y position.z velocity.x velocity.y velocity.z amplitude"),
        speed="from velocity along the line of sight", note="only x and y are measured",
    ),
    Decoder(
        "UniBw detections", "UniBw radar_msgs/DetectionRecord", "list",
        _f("range.value azimuth.value elevation.value radial_speed.value"), angles=_RADIANS, amplitude=NO_QUANTITY,
        polar=_f("range.value azimuth.value elevation.value"), doppler="radial_speed.value",
        assumed="the definition states neither the unit nor the sign of the angles; "
        "assumed radians, azimuth positive to the left and elevation upwards",
        confirm="--radar-axes forward,left,up,radians",
    ),
    Decoder(
        "Ainstein targets", "ainstein_radar_msgs/RadarTargetArray", "list",
        _f("target_id snr range speed azimuth elevation"), angles=_RADIANS.replace("rad", "deg", 1), degrees=True,
        note="the definition gives no unit; Ainstein's own tools use degrees",
    ),
    Decoder(
        "Continental detections", "continental_msgs and nebula detection lists with validity flags", "list",
        _f("azimuth_angle invalid_azimuth range range_rate"), angles=_RADIANS, amplitude="dBsm where there is an rcs",
        note="values flagged as invalid are skipped",
    ),
    Decoder(
        "derived objects", "AutonomouStuff derived_object_msgs/ObjectArray", "list",
        _f("detection_level pose.position.x pose.position.y pose.position.z twist.linear.x twist.linear.y"),
        speed="from twist along the line of sight", amplitude=NO_QUANTITY, note="tracked objects, not reflections",
    ),
    Decoder(
        "derived objects with covariance", "AutonomouStuff derived_object_msgs/ObjectWithCovarianceArray", "list",
        _f("detection_level pose.pose.position.x pose.pose.position.y pose.pose.position.z pose.covariance"),
        speed="from twist along the line of sight", amplitude=NO_QUANTITY, covariance="pose.covariance",
        noise="covariance of the position; 0 means unknown", note="tracked objects, not reflections",
    ),
)  # fmt: skip

_CLOCKWISE = "azimuth positive to the right, as on the sensor's bus"
_POINTS = (
    Decoder(
        "TI mmWave returns", "ti_mmwave_rospkg of radar-lab, radar_scan", "point",
        _f("point_id x y z range velocity doppler_bin bearing intensity"),
        angles=f"deg, positive to the left; {_UNUSED}", amplitude="dB; 0 means unknown",
        note="range, bearing and intensity are left at 0 by the stock driver; point_id drops where a scan begins",
    ),
    Decoder(
        "TI mmWave returns with frame numbers", "ti_mmwave_rospkg of leicheng5 and its forks, radar_scan", "point",
        _f("radar_frame_idx point_id x y z range velocity bearing intensity noise"), amplitude_scale=0.1,
        angles=f"deg, positive to the left; {_UNUSED}", amplitude="0.1 dB, read as dB; 0 means unknown",
        note="radar_frame_idx separates the scans",
    ),
    Decoder(
        "Delphi ESR tracks", "AutonomouStuff delphi_esr_msgs/EsrTrack", "point",
        _f("canmsg id lat_rate status angle range range_accel range_rate"), polar=_f("range angle"), doppler="range_rate",
        degrees=True,
        azimuth_sign=-1, angles="deg, azimuth positive to the right (assumed); no elevation", amplitude=NO_QUANTITY,
        needed=("status",), point_number="id", note="tracks of status 0 are skipped",
        assumed=f"the definition states neither the unit nor the sign of angle; assumed degrees, {_CLOCKWISE}",
        confirm="--radar-axes forward,left,up,degrees",
    ),
    Decoder(
        "Delphi SRR detections", "AutonomouStuff delphi_srr_msgs/SrrTrack", "point",
        _f("can_tx_detect_status can_tx_detect_range_rate can_tx_detect_range can_tx_detect_angle can_tx_detect_amplitude"),
        polar=_f("can_tx_detect_range can_tx_detect_angle"), doppler="can_tx_detect_range_rate",
        amplitude_field="can_tx_detect_amplitude", degrees=True, azimuth_sign=-1, needed=("can_tx_detect_status",),
        angles="deg, azimuth positive to the right (assumed); no elevation", amplitude="dBsm",
        assumed=f"the definition does not state the sign of the angle; assumed {_CLOCKWISE}",
    ),
    Decoder(
        "Delphi MRR detections", "AutonomouStuff delphi_mrr_msgs/MrrDetection", "point",
        _f("detection_id confid_azimuth azimuth range range_rate amplitude"), azimuth_sign=-1,
        angles="rad, azimuth positive to the right (assumed); no elevation", amplitude="dBsm",
        assumed=f"the definition states neither the unit nor the sign of azimuth; assumed radians, {_CLOCKWISE}",
        confirm="--radar-axes forward,left,up,radians",
    ),
)  # fmt: skip

_ARRAYS = (
    Decoder(
        "Delphi ESR targets", "AutonomouStuff delphi_esr_msgs/EsrEthTx", "arrays",
        _f("target_report_range target_report_range_rate target_report_theta target_report_amplitude pos_x pos_y"),
        doppler="target_report_range_rate", amplitude_field="target_report_amplitude", count_field="target_report_count",
        assumed="the definition does not state the axes of pos_x and pos_y; assumed x forward and y to the left",
    ),
)  # fmt: skip

DECODERS: tuple[Decoder, ...] = (*_CLOUDS, *_CHANNELS, *_LISTS, *_ARRAYS, *_POINTS)
"""Every layout that is known by name."""


def find_decoder(kind: MessageKind, names: Iterable[str]) -> Decoder | None:
    """Return the layout that requires the most of these fields; None if none matches.

    Args:
        kind: what the fields are fields of.
        names: as the message spells them; nested ones dotted, arrays included.
    """
    have = {name.lower() for name in names}
    fitting = [d for d in DECODERS if d.kind == kind and have.issuperset(field.lower() for field in d.fields)]
    return max(fitting, key=lambda decoder: len(decoder.fields), default=None)
