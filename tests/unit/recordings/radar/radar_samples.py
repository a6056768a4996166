"""One message of every radar layout, built from the definition its drivers publish, with the expected values."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from calib_core.radar import cartesian_from_polar

START_NS = 1_700_000_000_000_000_000


@dataclass(frozen=True)
class Sample:
    """Messages of one scan and what they mean: positions, speed, amplitude, noise."""

    messages: list[Any]
    points: np.ndarray
    doppler: np.ndarray | None = None
    amplitude: np.ndarray | None = None
    sigma: np.ndarray | None = None
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class CloudSpec:
    """A PointCloud2 layout: NumPy format and byte offset of each field."""

    fields: str
    offsets: tuple[int, ...] = ()
    step: int = 0
    doppler: str | None = None
    amplitude: str | None = None
    sigma: tuple[str, ...] = ()
    along: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    change: Callable[[np.ndarray], None] = field(default=lambda points: None)


def true_angles(points: np.ndarray, *, sign: float = 1.0, degrees: bool = False) -> None:
    """Fill in range, azimuth and elevation computed from x, y, z."""
    scale = np.degrees(1.0) if degrees else 1.0
    across = np.hypot(points["x"], points["y"])
    for name in points.dtype.names or ():
        if name.lower() in ("range", "r"):
            points[name] = np.hypot(across, points["z"])
        elif name.lower() in ("azimuth", "azimuthangle", "azimuth_angle", "bearing"):
            points[name] = sign * scale * np.arctan2(points["y"], points["x"])
        elif name.lower() in ("elevation", "elevationangle", "elevation_angle"):
            points[name] = scale * np.arctan2(points["z"], across)


def flat(points: np.ndarray) -> None:
    points["z"] = 0.0


CLOUDS: Mapping[str, CloudSpec] = {
    "positions and intensity": CloudSpec(
        "x:f4 y:f4 z:f4 intensity:f4", (0, 4, 8, 16), 32, None, "intensity", warnings=("looks-like-lidar",)
    ),
    "positions, intensity and speed": CloudSpec(
        "x:f4 y:f4 z:f4 intensity:f4 velocity:f4", (0, 4, 8, 16, 20), 32, "velocity", "intensity"
    ),
    "TI mmWave cloud with bearing": CloudSpec(
        "x:f4 y:f4 z:f4 intensity:f4 velocity:f4 range:f4 bearing:f4 doppler_bin:u2", (0, 4, 8, 16, 20, 24, 28, 32), 48,
        "velocity", "intensity", change=lambda points: true_angles(points, degrees=True),
    ),
    "RIO cloud": CloudSpec(
        "x:f4 y:f4 z:f4 snr_db:f4 v_doppler_mps:f4 noise_db:f4 range:f4", (0, 4, 8, 16, 20, 24, 28), 32,
        "v_doppler_mps", "snr_db", change=true_angles,
    ),
    "ARS548 detections, 8 fields": CloudSpec(
        "x:f4 y:f4 z:f4 v:f4 r:f4 RCS:i1 azimuth:f4 elevation:f4", (0, 4, 8, 12, 16, 20, 21, 25), 29,
        "v", "RCS", change=true_angles,
    ),
    "ARS548 detections, 18 fields": CloudSpec(
        "x:f4 y:f4 z:f4 azimuth:f4 azimuth_std:f4 elevation:f4 elevation_std:f4 range:f4 range_std:f4 range_rate:f4 "
        "range_rate_std:f4 rcs:i1 measurement_id:u2 positive_predictive_value:u1 classification:u1 "
        "multi_target_probability:u1 object_id:u2 ambiguity_flag:u1",
        (0, 4, 8, 16, 20, 24, 28, 32, 36, 40, 44, 48, 50, 52, 53, 54, 56, 58), 64,
        "range_rate", "rcs", ("range_std", "azimuth_std", "elevation_std"), change=true_angles,
    ),
    "positions and velocities": CloudSpec("x:f4 y:f4 z:f4 vx:f4 vy:f4", along=("vx", "vy")),
    "smartmicro targets": CloudSpec(
        "x:f4 y:f4 z:f4 radial_speed:f4 power:f4 rcs:f4 noise:f4 snr:f4 azimuth_angle:f4 elevation_angle:f4 range:f4",
        (), 0, "radial_speed", "snr", change=true_angles,
    ),
    "smartmicro objects": CloudSpec(
        "x:f4 y:f4 z:f4 speed_absolute:f4 heading:f4 length:f4 mileage:f4 quality:f4 acceleration:f4 object_id:i2 "
        "idle_cycles:u2 spline_idx:u2 object_class:u1 status:u2",
    ),
    "CARLA radar": CloudSpec(
        "x:f4 y:f4 z:f4 Range:f4 Velocity:f4 AzimuthAngle:f4 ElevationAngle:f4", (0, 4, 8, 12, 16, 20, 28), 32, "Velocity",
        change=lambda points: true_angles(points, sign=-1.0), warnings=("radar-azimuth-mirrored",),
    ),
    "nuScenes radar": CloudSpec(
        "x:f4 y:f4 z:f4 dyn_prop:i1 id:i2 rcs:f4 vx:f4 vy:f4 vx_comp:f4 vy_comp:f4 is_quality_valid:i1 ambig_state:i1 "
        "x_rms:i1 y_rms:i1 invalid_state:i1 pdh0:i1 vx_rms:i1 vy_rms:i1",
        amplitude="rcs", along=("vx", "vy"), warnings=("flat-radar",), change=flat,
    ),
    "View-of-Delft radar": CloudSpec("x:f4 y:f4 z:f4 rcs:f4 v_r:f4 v_r_compensated:f4 time:f4", (), 0, "v_r", "rcs"),
    "TJ4DRadSet radar": CloudSpec(
        "x:f4 y:f4 z:f4 v_r:f4 range:f4 power:f4 alpha:f4 beta:f4", (), 0, "v_r", "power", change=true_angles,
    ),
}  # fmt: skip


def cloud_sample(ros: Any, name: str) -> Sample:
    """Fill a cloud with numbers of each field's type."""
    spec = CLOUDS[name]
    names, formats = zip(*(words.split(":") for words in spec.fields.split()), strict=True)
    formats = [("<" if code[1] != "1" else "") + code for code in formats]
    if spec.offsets:
        dtype = np.dtype({"names": names, "formats": formats, "offsets": spec.offsets, "itemsize": spec.step})
    else:
        dtype = np.dtype(list(zip(names, formats, strict=True)))
    rng = np.random.default_rng(len(names))
    points = np.zeros(9, dtype=dtype)
    for column in names:
        integer = points.dtype[column].kind != "f"
        points[column] = rng.integers(1, 90, 9) if integer else rng.uniform(0.5, 4.0, 9)
    points["x"] += 4.0
    points["y"] -= 2.0
    spec.change(points)

    def column(wanted: str | None) -> np.ndarray | None:
        return None if wanted is None else points[wanted].astype(np.float64)

    xyz = np.stack([points[axis] for axis in "xyz"], axis=1).astype(np.float64)
    doppler = column(spec.doppler)
    if spec.along:
        total = sum(points[v].astype(np.float64) * xyz[:, axis] for axis, v in enumerate(spec.along))
        doppler = total / np.linalg.norm(xyz, axis=1)
    sigma = np.stack([points[s] for s in spec.sigma], axis=1).astype(np.float64) if spec.sigma else None
    return Sample([ros.cloud(START_NS, points)], xyz, doppler, column(spec.amplitude), sigma, spec.warnings)


def oculii(ros: Any, *, named: bool) -> Sample:
    channel = ros.store.types["sensor_msgs/msg/ChannelFloat32"]
    point = ros.store.types["geometry_msgs/msg/Point32"]
    xyz = np.array([[5.0, 1.0, 0.5], [7.0, -2.0, 0.25]])
    values = {
        "Doppler": [0.5, -0.5],
        "Range": [5.1234, 7.2846],
        "Power": [20.0, 30.0],
        "Alpha": [0.1, 0.2],
        "Beta": [0.3, 0.4],
    }
    message = ros.new(
        "sensor_msgs/msg/PointCloud",
        header=ros.header(START_NS),
        points=[point(x=x, y=y, z=z) for x, y, z in xyz.tolist()],
        channels=[channel(name=n if named else "", values=np.array(v, dtype=np.float32)) for n, v in values.items()],
    )
    told = () if named else ("assumed",)
    return Sample([message], xyz, np.array(values["Doppler"]), np.array(values["Power"]), warnings=told)


def radar_scan(ros: Any) -> Sample:
    element = "float32 range\nfloat32 azimuth\nfloat32 elevation\nfloat32 doppler_velocity\nfloat32 amplitude\n"
    rows = np.array([[5, 0.25, 0.125, -1.5, 12], [7.5, -0.5, 0.25, 0, 3]])
    kind = ros.define("radar_msgs/msg/RadarReturn", element)
    ros.define("radar_msgs/msg/RadarScan", "Header header\nradar_msgs/RadarReturn[] returns\n")
    names = ("range", "azimuth", "elevation", "doppler_velocity", "amplitude")
    returns = [ros.new(kind, **dict(zip(names, row, strict=True))) for row in rows.tolist()]
    message = ros.new("radar_msgs/msg/RadarScan", header=ros.header(START_NS), returns=returns)
    return Sample([message], cartesian_from_polar(rows[:, :3]), rows[:, 3], rows[:, 4])


POSITIONS = np.array([[8.0, 0.0, 0.0], [0.0, 4.0, 0.0], [3.0, 4.0, 12.0]])
COVARIANCE = np.diag([0.04, 0.01, 0.0025])
SIGMA = np.array([[0.2, 0.1 / 8, 0.05 / 8], [0.1, 0.2 / 4, 0.05 / 4], [0.0, 0.0, 0.0]])
_UNITS = np.array([[3, 4, 12], [-4, 3, 0], [-36 / 5, -48 / 5, 5]]) / np.array([[13], [5], [13]])
SIGMA[2] = np.sqrt(np.diag(_UNITS @ COVARIANCE @ _UNITS.T)) / [1, 5, 13]


def vector(ros: Any, kind: str, values: Any) -> Any:
    x, y, z = (float(v) for v in values)
    return ros.new(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)


def tracks(ros: Any) -> Sample:
    ros.define("unique_identifier_msgs/msg/UUID", "uint8[16] uuid\n")
    kind = ros.define(
        "radar_msgs/msg/RadarTrack",
        "unique_identifier_msgs/UUID uuid\ngeometry_msgs/Point position\ngeometry_msgs/Vector3 velocity\n"
        "geometry_msgs/Vector3 acceleration\ngeometry_msgs/Vector3 size\nuint16 classification\n"
        "float32[6] position_covariance\nfloat32[6] velocity_covariance\nfloat32[6] acceleration_covariance\n"
        "float32[6] size_covariance\n",
    )
    ros.define("radar_msgs/msg/RadarTracks", "Header header\nradar_msgs/RadarTrack[] tracks\n")
    uuid = ros.new("unique_identifier_msgs/msg/UUID", uuid=np.arange(16, dtype=np.uint8))
    upper = COVARIANCE[np.triu_indices(3)].astype(np.float32)
    rest = {f"{name}_covariance": np.zeros(6, dtype=np.float32) for name in ("velocity", "acceleration", "size")}
    zero = vector(ros, "Vector3", (0, 0, 0))
    elements = [
        ros.new(
            kind, uuid=uuid, position=vector(ros, "Point", p), velocity=vector(ros, "Vector3", (1, 2, 0)),
            acceleration=zero, size=zero, classification=1, position_covariance=upper, **rest,
        )
        for p in POSITIONS
    ]  # fmt: skip
    message = ros.new("radar_msgs/msg/RadarTracks", header=ros.header(START_NS), tracks=elements)
    return Sample([message], POSITIONS, np.array([1.0, 2.0, 11 / 13]), None, SIGMA)


def detections(ros: Any) -> Sample:
    kind = ros.define(
        "radar_msgs/msg/RadarDetection",
        "uint16 detection_id\ngeometry_msgs/Point position\ngeometry_msgs/Vector3 velocity\nfloat64 amplitude\n",
    )
    ros.define("radar_msgs/msg/RadarDetectionArray", "Header header\nradar_msgs/RadarDetection[] detections\n")
    points = POSITIONS * [1, 1, 0]
    elements = [
        ros.new(
            kind,
            detection_id=i,
            position=vector(ros, "Point", p),
            velocity=vector(ros, "Vector3", p / 8),
            amplitude=3.5,
        )
        for i, p in enumerate(points)
    ]
    message = ros.new("radar_msgs/msg/RadarDetectionArray", header=ros.header(START_NS), detections=elements)
    speed = np.linalg.norm(points, axis=1) / 8
    return Sample([message], points, speed, np.full(3, 3.5), warnings=("flat-radar",))


def unibw(ros: Any) -> Sample:
    value = ros.define("radar_msgs/msg/Measurement", "float64 value\nfloat64 variance\n")
    names = ("range", "azimuth", "elevation", "radial_speed")
    text = "".join(f"radar_msgs/Measurement {name}\n" for name in names)
    kind = ros.define("radar_msgs/msg/Detection", "uint32 id\n" + text)
    ros.define("radar_msgs/msg/DetectionRecord", "Header header\nradar_msgs/Detection[] detections\n")
    rows = np.array([[5, 0.25, 0.125, -1.5], [7.5, -0.5, 0.25, 0.5]])
    elements = [
        ros.new(kind, id=3, **{n: ros.new(value, value=v, variance=0.1) for n, v in zip(names, row, strict=True)})
        for row in rows.tolist()
    ]
    message = ros.new("radar_msgs/msg/DetectionRecord", header=ros.header(START_NS), detections=elements)
    return Sample([message], cartesian_from_polar(rows[:, :3]), rows[:, 3], warnings=("assumed",))


def ainstein(ros: Any) -> Sample:
    names = ("snr", "range", "speed", "azimuth", "elevation")
    kind = ros.define(
        "ainstein_radar_msgs/msg/RadarTarget", "uint16 target_id\n" + "".join(f"float64 {name}\n" for name in names)
    )
    ros.define("ainstein_radar_msgs/msg/RadarTargetArray", "Header header\nainstein_radar_msgs/RadarTarget[] targets\n")
    rows = np.array([[9.0, 2.0, 0.5, 90.0, 0.0], [8.0, 4.0, 0.25, -45.0, 30.0]])
    targets = [ros.new(kind, target_id=1, **dict(zip(names, row, strict=True))) for row in rows.tolist()]
    message = ros.new("ainstein_radar_msgs/msg/RadarTargetArray", header=ros.header(START_NS), targets=targets)
    points = np.array([[0, 2, 0], [4 * np.sqrt(3 / 8), -4 * np.sqrt(3 / 8), 2]])
    return Sample([message], points, rows[:, 2], rows[:, 0])


def continental(ros: Any) -> Sample:
    kind = ros.define(
        "continental_msgs/msg/Detection",
        "float32 azimuth_angle\nbool invalid_azimuth\nfloat32 elevation_angle\nbool invalid_elevation\nfloat32 range\n"
        "bool invalid_distance\nfloat32 range_rate\nbool invalid_range_rate\nint8 rcs\n",
    )
    ros.define("continental_msgs/msg/DetectionList", "Header header\ncontinental_msgs/Detection[] detections\n")
    good = {name: False for name in ("invalid_azimuth", "invalid_elevation", "invalid_distance", "invalid_range_rate")}
    rows = np.array([[0.5, 0.25, 6.0, 0.5], [-0.5, 0.125, 8.0, 0.25], [0.25, 0.0, 4.0, 1.0]])
    elements = [
        ros.new(
            kind,
            azimuth_angle=az,
            elevation_angle=el,
            range=r,
            range_rate=v,
            rcs=-5,
            **{**good, "invalid_azimuth": i == 2, "invalid_range_rate": i == 1},
        )
        for i, (az, el, r, v) in enumerate(rows.tolist())
    ]
    message = ros.new("continental_msgs/msg/DetectionList", header=ros.header(START_NS), detections=elements)
    points = cartesian_from_polar(rows[:, [2, 0, 1]])
    points[2] = np.nan
    return Sample([message], points, np.array([0.5, np.nan, 1.0]), np.full(3, -5.0))


_OBJECT = """\
Header header
uint32 id
uint8 detection_level
bool object_classified
geometry_msgs/{pose} pose
geometry_msgs/{twist} twist
geometry_msgs/{accel} accel
geometry_msgs/Polygon polygon
{shape}uint8 classification
uint8 classification_certainty
uint32 classification_age
"""


def objects(ros: Any, *, covariance: bool) -> Sample:
    package, end = "derived_object_msgs", "WithCovariance" if covariance else ""
    names = {part: f"{part.capitalize()}{end}" for part in ("pose", "twist", "accel")}
    text = _OBJECT.format(**names, shape="uint8 shape_type\nfloat64[] dimensions\n")
    kind = ros.define(f"{package}/msg/Object{end}", text)
    array = ros.define(f"{package}/msg/Object{end}Array", f"Header header\n{package}/Object{end}[] objects\n")
    six = np.zeros((6, 6))
    six[:3, :3] = COVARIANCE

    def wrapped(name: str, value: Any) -> Any:
        full = f"geometry_msgs/msg/{name.capitalize()}WithCovariance"
        return ros.new(full, **{name: value, "covariance": six.reshape(-1)}) if covariance else value

    zero = vector(ros, "Vector3", (0, 0, 0))
    accel = ros.new("geometry_msgs/msg/Accel", linear=zero, angular=zero)
    twist = ros.new("geometry_msgs/msg/Twist", linear=vector(ros, "Vector3", (1, 2, 0)), angular=zero)
    turn = ros.new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    elements = []
    for number, position in enumerate(POSITIONS):
        pose = ros.new("geometry_msgs/msg/Pose", position=vector(ros, "Point", position), orientation=turn)
        elements.append(
            ros.new(
                kind, header=ros.header(START_NS, "map" * number), id=number, detection_level=1, object_classified=False,
                pose=wrapped("pose", pose), twist=wrapped("twist", twist), accel=wrapped("accel", accel),
                polygon=ros.new("geometry_msgs/msg/Polygon", points=[]), shape_type=1,
                dimensions=np.arange(float(number + 1)), classification=0, classification_certainty=0, classification_age=0,
            )
        )  # fmt: skip
    message = ros.new(array, header=ros.header(START_NS), objects=elements)
    return Sample([message], POSITIONS, np.array([1.0, 2.0, 11 / 13]), None, SIGMA if covariance else None)


def singles(ros: Any, kind: str, text: str, rows: list[dict[str, Any]]) -> list[Any]:
    """Build one message per return."""
    ros.define(kind, "Header header\n" + text)
    return [ros.new(kind, header=ros.header(START_NS + 100_000 * i), **row) for i, row in enumerate(rows)]


TI = "uint16 point_id\nfloat32 x\nfloat32 y\nfloat32 z\nfloat32 range\nfloat32 velocity\nuint16 doppler_bin\nfloat32 bearing\n"


def ti(ros: Any, *, fork: bool) -> Sample:
    points = np.array([[3.0, 0.5, 0.25], [4.0, -1.0, 0.5], [6.0, 2.0, 1.0]])
    text = ("uint16 radar_frame_idx\n" if fork else "") + TI + "float32 intensity\n"
    text += "float32 intensity_snr_noise\nfloat32 noise\nstring time_human\n" if fork else ""
    extra = {"radar_frame_idx": 7, "intensity_snr_noise": 1.0, "noise": 2.0} if fork else {}
    rows = [
        {"point_id": i, "x": p[0], "y": p[1], "z": p[2], "range": 0.0, "velocity": 0.5, "doppler_bin": 1, "bearing": 0.0,
         "intensity": 153.0 if fork else 0.0, **extra, **({"time_human": "1" * i} if fork else {})}
        for i, p in enumerate(points.tolist())
    ]  # fmt: skip
    messages = singles(ros, "ti_mmwave_rospkg/msg/RadarScan", text, rows)
    return Sample(messages, points, np.full(3, 0.5), np.full(3, 15.3) if fork else np.full(3, np.nan))


def esr(ros: Any) -> Sample:
    text = (
        "string canmsg\nuint8 id\nfloat32 lat_rate\nbool grouping_changed\nbool oncoming\nuint8 status\nfloat32 angle\n"
        "float32 range\nbool bridge_object\nbool rolling_count\nfloat32 width\nfloat32 range_accel\nuint8 med_range_mode\n"
        "float32 range_rate\n"
    )
    rest = {"lat_rate": 0.0, "grouping_changed": False, "oncoming": True, "bridge_object": False, "rolling_count": True}
    rest |= {"width": 0.5, "range_accel": 0.0, "med_range_mode": 1}
    rows = [
        {
            "canmsg": f"{0x500 + i:X}",
            "id": i,
            "status": status,
            "angle": 30.0 - 60.0 * (i == 1),
            "range": 10.0,
            "range_rate": -2.0,
            **rest,
        }
        for i, status in enumerate([1, 3, 0])
    ]
    rows[1]["canmsg"] = "longer than the first"
    messages = singles(ros, "delphi_esr_msgs/msg/EsrTrack", text, rows)
    points = np.array([[10 * np.cos(np.pi / 6), -5, 0], [10 * np.cos(np.pi / 6), 5, 0], [np.nan] * 3])
    return Sample(messages, points, np.full(3, -2.0), warnings=("flat-radar", "assumed"))


def srr(ros: Any) -> Sample:
    names = ("RANGE_RATE", "RANGE", "ANGLE", "AMPLITUDE")
    text = "uint8 CAN_TX_DETECT_VALID_LEVEL\nbool CAN_TX_DETECT_STATUS\n"
    text += "".join(f"float32 CAN_TX_DETECT_{name}\n" for name in names)
    rows = [
        {
            "CAN_TX_DETECT_VALID_LEVEL": 3,
            "CAN_TX_DETECT_STATUS": status,
            **{f"CAN_TX_DETECT_{n}": v for n, v in zip(names, row, strict=True)},
        }
        for status, row in ((True, (1.5, 10.0, 30.0, -4.0)), (False, (0.0, 3.0, 3.0, 0.5)))
    ]
    messages = singles(ros, "delphi_srr_msgs/msg/SrrTrack", text, rows)
    points = np.array([[10 * np.cos(np.pi / 6), -5, 0], [np.nan] * 3])
    return Sample(messages, points, np.array([1.5, 0.0]), np.array([-4.0, 0.5]), warnings=("assumed",))


def mrr(ros: Any) -> Sample:
    text = (
        "uint8 detection_id\nuint8 confid_azimuth\nbool super_res_target\nbool nd_target\nbool host_veh_clutter\n"
        "bool valid_level\nfloat32 azimuth\nfloat32 range\nfloat32 range_rate\nint8 amplitude\nuint8 index_2lsb\n"
    )
    rest = {
        "confid_azimuth": 3,
        "super_res_target": False,
        "nd_target": False,
        "host_veh_clutter": False,
        "valid_level": True,
    }
    rows = [
        {"detection_id": i, "azimuth": az, "range": 10.0, "range_rate": 0.5, "amplitude": -7, "index_2lsb": 0, **rest}
        for i, az in enumerate([0.5, -0.25])
    ]
    messages = singles(ros, "delphi_mrr_msgs/msg/MrrDetection", text, rows)
    points = cartesian_from_polar(np.array([[10, -0.5, 0], [10, 0.25, 0]]))
    told = ("flat-radar", "assumed")
    return Sample(messages, points, np.full(2, 0.5), np.full(2, -7.0), warnings=told)


def esr_ethernet(ros: Any) -> Sample:
    columns = ("target_report_range", "target_report_range_rate", "target_report_theta", "target_report_amplitude")
    columns += ("pos_x", "pos_y", "vel_x", "vel_y")
    scalars = {
        "xcp_format_version": "uint16", "scan_index": "uint16", "tcp_size": "uint16", "xcp_scan_type": "uint8",
        "look_index": "uint16", "mmr_scan_index": "uint16", "target_report_host_speed": "float32",
        "target_report_host_yaw_rate": "float32", "xcp_timestamp": "uint32", "release_revision": "uint8",
        "promote_revision": "uint8", "field_revision": "uint8", "target_report_count": "uint8",
    }  # fmt: skip
    text = "".join(f"{kind} {name}\n" for name, kind in scalars.items())
    text += "".join(f"float32[64] {name}\n" for name in columns)
    values = {name: np.random.default_rng(len(name)).uniform(1, 9, 64).astype(np.float32) for name in columns}
    values["target_report_range"] = np.hypot(values["pos_x"], values["pos_y"])
    row = {name: 0.0 if kind == "float32" else 1 for name, kind in scalars.items()} | values
    row["target_report_count"] = 5
    messages = singles(ros, "delphi_esr_msgs/msg/EsrEthTx", text, [row])
    points = np.stack([values["pos_x"], values["pos_y"], np.zeros(64)], axis=1)[:5].astype(np.float64)
    speed, amplitude = (values[f"target_report_{name}"][:5].astype(np.float64) for name in ("range_rate", "amplitude"))
    return Sample(messages, points, speed, amplitude, warnings=("flat-radar", "assumed"))


OTHERS: Mapping[str, Callable[[Any], Sample]] = {
    "Oculii cloud": lambda ros: oculii(ros, named=True),
    "Oculii cloud, unnamed channels": lambda ros: oculii(ros, named=False),
    "radar_msgs scan": radar_scan,
    "radar_msgs tracks": tracks,
    "AutonomouStuff detections": detections,
    "UniBw detections": unibw,
    "Ainstein targets": ainstein,
    "Continental detections": continental,
    "derived objects": lambda ros: objects(ros, covariance=False),
    "derived objects with covariance": lambda ros: objects(ros, covariance=True),
    "Delphi ESR targets": esr_ethernet,
    "TI mmWave returns": lambda ros: ti(ros, fork=False),
    "TI mmWave returns with frame numbers": lambda ros: ti(ros, fork=True),
    "Delphi ESR tracks": esr,
    "Delphi SRR detections": srr,
    "Delphi MRR detections": mrr,
}


def sample(ros: Any, name: str) -> Sample:
    """Return the sample of a layout."""
    return cloud_sample(ros, name) if name in CLOUDS else OTHERS[name](ros)
