"""Messages as vendors lay them out, with the returns they were made of: none of them is in the registry."""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.radar import cartesian_from_polar
from calib_core.recordings.assembly import assemble
from calib_core.recordings.containers.sources import Channel
from calib_core.recordings.plain_files.source import PlainSource, header_bytes
from calib_core.recordings.recording import Recording
from calib_core.recordings.selection import RecordingOptions

START_NS = 1_700_000_000 * NS_PER_S
SCANS, RETURNS = 10, 20
SEPARATOR = "================================================================================\n"
_CODES = {"float32": "<f4", "float64": "<f8", "uint8": "u1", "bool": "u1", "int8": "i1", "uint16": "<u2", "int16": "<i2",
          "uint32": "<u4", "int32": "<i4"}  # fmt: skip


@dataclass(frozen=True)
class Truth:
    """The returns of one scan: polar in m and rad, azimuth to the left; Cartesian; speed [m/s]; amplitude [dB]."""

    polar: np.ndarray
    points: np.ndarray
    doppler: np.ndarray
    amplitude: np.ndarray

    @classmethod
    def of(cls, scan: int) -> "Truth":
        """Draw the returns of one scan."""
        rng = np.random.default_rng(scan)
        polar = np.stack(
            [rng.uniform(3, 90, RETURNS), rng.uniform(-0.9, 0.9, RETURNS), rng.uniform(-0.2, 0.2, RETURNS)], axis=1
        )
        speed, level = rng.uniform(-20, 20, RETURNS), rng.uniform(-10, 30, RETURNS)
        return cls(polar, cartesian_from_polar(polar), speed, level)

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Every quantity by a short name, and values of no interest."""
        x, y, z = self.points.T
        r, az, el = self.polar.T
        across = self.doppler[:, None] * self.points / self.polar[:, :1]
        return {
            "x": x, "y": y, "z": z, "r": r, "az": az, "el": el, "v": self.doppler, "a": self.amplitude, "-y": -y, "-az": -az,
            "az_deg": np.degrees(az), "-az_deg": -np.degrees(az), "el_deg": np.degrees(el), "vx": across[:, 0], 
            "vy": across[:, 1], "vz": across[:, 2], "id": np.arange(len(r)), "one": np.ones(len(r)), "half": np.full(len(r), 0.5),
            "r_cm": 100 * r, "az_cdeg": 100 * np.degrees(az), "v_cm": 100 * self.doppler, "sensor": np.arange(len(r)) % 2,
        }  # fmt: skip


Fields = tuple[tuple[str, str, str, str], ...]
"""Type, name, comment, and the quantity of Truth that fills it."""


def fields(text: str) -> Fields:
    """Parse one field per line: TYPE NAME = QUANTITY # COMMENT."""
    rows = []
    for line in filter(str.strip, text.splitlines()):
        code, _, comment = line.partition("#")
        left, _, quantity = code.partition("=")
        kind, name = left.split()
        rows.append((kind, name, comment.strip(), quantity.strip()))
    return tuple(rows)


def definition_of(rows: Fields) -> str:
    """Return the fields as a message definition has them."""
    return "".join(f"{kind} {name}{'  # ' + comment if comment else ''}\n" for kind, name, comment, _ in rows)


def elements(rows: Fields, truth: Truth) -> bytes:
    """Return the structs of a list, packed as ROS 1 does."""
    dtype = np.dtype([(name, _CODES[kind]) for kind, name, _, _ in rows])
    values = np.zeros(len(truth.polar), dtype=dtype)
    for kind, name, _, quantity in rows:
        column = truth.columns[quantity]
        values[name] = column if kind.startswith("float") else np.round(column)
    return values.tobytes()


def counted(data: bytes, count: int = RETURNS) -> bytes:
    """Return a list with its length."""
    return struct.pack("<I", count) + data


@dataclass(frozen=True)
class Layout:
    """A topic's messages.

    Attributes:
        definition: with comments.
        body: returns a message without its header.
        assumed: keys of what the message does not state and has to be assumed.
        kind: the message's type.
        tolerance_m: what the message's own resolution costs.
        speed: whether it has one.
        height: what it says about heights: all, nothing beside a range, or nothing beside x and y.
    """

    definition: str
    body: Callable[[Truth], bytes]
    assumed: tuple[str, ...] = ()
    kind: str = "vendor_msgs/Detections"
    tolerance_m: float = 1e-3
    speed: bool = True
    height: Literal["measured", "in the range", "left out"] = "measured"
    notes: tuple[str, ...] = field(default=())

    def positions(self, truth: Truth) -> np.ndarray:
        """Return the positions that can be read."""
        flat = truth.polar * [1, 1, 0] if self.height == "in the range" else truth.polar
        return cartesian_from_polar(flat) * ([1, 1, 0] if self.height == "left out" else [1, 1, 1])

    def recording(self, scans: int = SCANS, **options: Any) -> Recording:
        """Open a recording of these messages."""
        truths = [Truth.of(scan) for scan in range(scans)]
        times = START_NS + 100_000_000 * np.arange(scans)
        messages = [
            header_bytes(TimeNs(int(time)), "radar") + self.body(truth)
            for time, truth in zip(times, truths, strict=True)
        ]
        source = PlainSource(
            Path("drive.bag"), 1000, "bag", Channel(0, "/radar", self.kind, "ros1", self.definition, "msg"),
            times.astype(np.int64), messages.__getitem__,
        )  # fmt: skip
        paths = (Path("drive.bag"),)
        return Recording(paths, (source,), assemble(paths, (source,), RecordingOptions(**options), ("radar",)))


def listed(text: str, *assumed: str, kind: str = "vendor_msgs/Detections", remarks: str = "", **more: Any) -> Layout:
    """Return a header and one list of structs."""
    rows = fields(text)
    definition = (
        f"Header header\nvendor_msgs/Det[] detections\n{SEPARATOR}MSG: vendor_msgs/Det\n{remarks}{definition_of(rows)}"
    )
    return Layout(definition, lambda truth: counted(elements(rows, truth)), assumed, kind, **more)


def fixed_list() -> Layout:
    """Return a fixed list of which a field counts the used elements; the others hold rubbish."""
    rows = fields(
        """
        float32 fRange = r # [m]
        float32 fAz = az_deg # deg, left positive
        float32 fVrel = v # m/s
        float32 fRcs = a # dBsm
        """
    )
    text = f"Header header\nuint8 nofDetections\nvendor_msgs/Det[32] detections\n{SEPARATOR}MSG: vendor_msgs/Det\n"

    def body(truth: Truth) -> bytes:
        rubbish = np.full((32 - RETURNS) * 4, 777.0, dtype="<f4").tobytes()
        return struct.pack("<B", RETURNS) + elements(rows, truth) + rubbish

    return Layout(text + definition_of(rows), body, height="in the range")


def arrays(nested: bool) -> Layout:
    """Return arrays side by side, in the message or in a nested one."""
    names = {"range": "r", "azimuth": "az", "elevation": "el", "radial_velocity": "v", "rcs": "a"}
    comments = {
        "range": "m",
        "azimuth": "rad, positive to the left",
        "elevation": "rad",
        "radial_velocity": "m/s",
        "rcs": "dBsm",
    }
    listing = "".join(f"float32[] {name}  # {comments[name]}\n" for name in names)
    text = f"Header header\nuint32 cycle\nvendor_msgs/Data data\n{SEPARATOR}MSG: vendor_msgs/Data\n{listing}"

    def body(truth: Truth) -> bytes:
        columns = b"".join(counted(truth.columns[quantity].astype("<f4").tobytes()) for quantity in names.values())
        return (struct.pack("<I", 7) if nested else b"") + columns

    return Layout(text if nested else "Header header\n" + listing, body)


POLAR = """
        float32 range = r # m
        float32 azimuth = az # rad, positive left
        float32 elevation = el # rad
        float32 doppler = v # m/s
        float32 snr = a # dB
        """


def nested_lists(sensors: int) -> Layout:
    """Return a list of sensors, each with its list of targets, inside a nested message."""
    rows = fields(POLAR)
    text = (
        f"Header header\nvendor_msgs/Payload payload\n{SEPARATOR}MSG: vendor_msgs/Payload\n"
        "uint8 version\nvendor_msgs/Sensor[] sensors\n"
        f"{SEPARATOR}MSG: vendor_msgs/Sensor\nuint8 sensor_id\nvendor_msgs/Target[] targets\n"
        f"{SEPARATOR}MSG: vendor_msgs/Target\n{definition_of(rows)}"
    )

    def body(truth: Truth) -> bytes:
        share = RETURNS // sensors
        parts = [
            Truth(*(getattr(truth, name)[k * share : (k + 1) * share] for name in Truth.__dataclass_fields__))
            for k in range(sensors)
        ]
        inner = b"".join(struct.pack("<B", k) + counted(elements(rows, part), share) for k, part in enumerate(parts))
        return struct.pack("<B", 1) + struct.pack("<I", sensors) + inner

    return Layout(text, body, ("field-meaning",) if sensors > 1 else ())


def two_lists(first: str, second: str) -> Layout:
    """Return two lists of one message: tracked objects, or another sensor's returns, before or after the detections."""
    rows = fields(POLAR)
    objects = fields(
        """
        uint16 id = id
        float32 x = x
        float32 y = y
        float32 vx = vx
        float32 vy = vy
        float32 width = one
        float32 length = one
        """
    )
    kinds = {"objects": objects, "detections": rows}
    text = f"Header header\nvendor_msgs/A[] {first}\nvendor_msgs/B[] {second}\n"
    text += f"{SEPARATOR}MSG: vendor_msgs/A\n{definition_of(kinds[first])}"
    text += f"{SEPARATOR}MSG: vendor_msgs/B\n{definition_of(kinds[second])}"
    return Layout(
        text,
        lambda truth: counted(elements(kinds[first], truth)) + counted(elements(kinds[second], truth)),
        notes=("only the list 'detections' is read; the message also has objects",),
    )


def cloud(text: str, *assumed: str, **more: Any) -> Layout:
    """Return a PointCloud2 with unusual field names."""
    from calib_core.recordings.messages.definitions import KNOWN_DEFINITIONS
    from calib_core.recordings.plain_files.source import cloud_message

    rows = fields(text)

    def body(truth: Truth) -> bytes:
        points = np.zeros(RETURNS, dtype=[(name, _CODES[kind]) for kind, name, _, _ in rows])
        for _, name, _, quantity in rows:
            points[name] = truth.columns[quantity]
        empty = len(header_bytes(TimeNs(START_NS), "radar"))
        return cloud_message(TimeNs(START_NS), "radar", points)[empty:]

    return Layout(KNOWN_DEFINITIONS["sensor_msgs/PointCloud2"], body, assumed, "sensor_msgs/PointCloud2", **more)


LAYOUTS: Mapping[str, Layout] = {
    "prefixes, comments with units and directions": listed(
        """
        uint16 u_Id = id
        float32 f_PosX = x # [m] forward
        float32 f_PosY = y # [m] left
        float32 f_PosZ = z # [m] up
        float32 f_VRad = v # [m/s]
        float32 s_RCS = a # [dBsm]
        float32 f_PosXVar = half # [m^2]
        """
    ),
    "a decoded message named a packet": listed(
        """
        float32 f_x = x # m
        float32 f_y = y # m
        float32 f_z = z # m
        float32 f_speed_radial = v # m/s
        float32 f_azimuth = az # rad, positive to the left
        int8 s_rcs = a # dBsm
        float32 f_x_var = half
        """,
        kind="vendor_msgs/DetectionPacket",
    ),
    "polar, units in the names": listed(
        """
        float32 Range_m = r
        float32 Azimuth_deg = az_deg
        float32 Elevation_deg = el_deg
        float32 Doppler_mps = v
        float32 RCS_dBsm = a
        """,
        "azimuth-sign",
    ),
    "polar radians without any unit": listed(
        """
        float32 rDist = r
        float32 fAzimuth = az
        float32 fElevation = el
        float32 vRad = v
        float32 fSnr = a
        """,
        "azimuth-sign", "speed-unit",
    ),
    "polar degrees without any unit": listed(
        """
        float32 m_range = r
        float32 m_azimuth = az_deg
        float32 m_elevation = el_deg
        float32 m_rangeRate = v
        float32 m_power = a
        """,
        "azimuth-sign", "speed-unit",
    ),
    "polar, counted to the right by its comment": listed(
        """
        float64 distance = r # distance in metres
        float64 angle_h = -az_deg # horizontal angle in degrees, positive to the right
        float64 angle_v = el_deg # vertical angle in degrees
        float64 velocity = v # radial velocity in m/s
        float64 snr = a # dB
        """
    ),
    "integers with factors in comments": listed(
        """
        uint16 u16Range = r_cm # 0.01 m
        int16 i16Azimuth = az_cdeg # 0.01 deg, left positive
        int16 i16Speed = v_cm # 0.01 m/s
        int8 i8Rcs = a # dBsm
        """,
        tolerance_m=0.03,
        height="in the range",
    ),
    "integers without comments": listed(
        """
        uint16 u16Range = r_cm
        int16 i16Azimuth = az_cdeg
        int16 i16Speed = v_cm
        int8 i8Rcs = a
        """,
        "length-unit", "angle-unit", "azimuth-sign", "speed-unit", tolerance_m=0.03,
        height="in the range",
    ),
    "x to the right, y forward": listed(
        """
        float32 x = -y # [m]
        float32 y = x # [m]
        float32 z = z # [m]
        float32 doppler = v # [m/s]
        float32 intensity = a
        """,
        remarks="# Sensor frame: x right, y forward, z up\n",
    ),
    "y forward by its values": listed(
        """
        float32 px = -y
        float32 py = x
        float32 pz = z
        float32 doppler_speed = v # m/s
        float32 peak_power = a
        """, "axes",
    ),
    "longitudinal and lateral": listed(
        """
        uint8 id = id
        float32 DistLong = x # m
        float32 DistLat = y # m, left positive
        float32 height = z # m
        float32 VrelLong = vx # m/s
        float32 VrelLat = vy # m/s
        float32 rcs = a # dBsm
        """,
        speed=False,
    ),
    "y to the right and z unsaid": listed(
        """
        float32 x = x # [m] forward
        float32 y = -y # [m] right
        float32 z = z # [m]
        float32 radial_velocity = v # [m/s]
        float32 rcs = a # [dBsm]
        """,
        "axes",
    ),
    "two unnamed angles": listed(
        """
        float32 r = r # m
        float32 phi = az
        float32 theta = el
        float32 v = v # m/s
        float32 rcs = a
        """,
        "azimuth-sign",
        "field-meaning",
    ),
    "longitude and latitude of a distance": listed(
        """
        uint8 id = id
        float64 longitude_dist = x
        float64 lateral_dist = y
        float64 longitude_vel = vx
        float64 lateral_vel = vy
        float64 rcs = a
        """,
        "axes",
        "speed-unit",
        speed=False,
        height="left out",
    ),
    "lateral without a sign": listed(
        """
        float32 dx = x # m
        float32 dy = y # m
        float32 dz = z # m
        float32 range_rate = v # m/s
        float32 rcs = a
        """, "axes",
    ),
    "two sensors in one list": listed(POLAR + "\nuint8 sensor_id = sensor", "field-meaning"),
    "a fixed list with a count": fixed_list(),
    "arrays side by side": arrays(nested=False),
    "arrays side by side in a nested message": arrays(nested=True),
    "nested two levels": nested_lists(1),
    "two sensors in nested lists": nested_lists(2),
    "objects before detections": two_lists("objects", "detections"),
    "detections before objects": two_lists("detections", "objects"),
    "fields that look like others": listed(
        """
        float32 range_min = one
        float32 velocity_x_std = half
        uint16 azimuth_bin = id
        float32 x_rms = half
        float32 range_std = half # m
        float32 range = r # m
        float32 range_offset = one
        float32 azimuth = az # rad, positive left
        float32 azimuth_alt = half
        float32 elevation = el # rad
        float32 elevation_confidence = half
        float32 ego_speed = one
        float32 radial_speed = v # m/s
        float32 acceleration_x = half
        float32 snr_threshold = one
        float32 snr = a # dB
        """
    ),
    "a cloud with prefixed positions": cloud(
        """
        float32 pos_x_m = x
        float32 pos_y_m = y
        float32 pos_z_m = z
        float32 v_rad = v
        float32 rcs_dbsm = a
        """
    ),
    "a polar cloud": cloud(
        """
        float32 Rng = r
        float32 Azi_deg = az_deg
        float32 Ele_deg = el_deg
        float32 vDoppler = v
        float32 Pow_dB = a
        """, "azimuth-sign",
    ),
}  # fmt: skip
