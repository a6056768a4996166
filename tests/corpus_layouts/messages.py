"""Layouts of recordings with ROS: vendors' messages and clouds."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.recordings import RecordingOptions
from tests.corpus_layouts.bags import Bag, Kind
from tests.corpus_layouts.truth import Returns, Truth, image_times, mirrored, polar, scene

Layout = Callable[[Path], Truth]


def _each_scan(
    folder: Path, kind: Kind, returns: Returns, prepare: Callable[[Bag], Callable[[Bag, Returns, int], None]]
) -> Path:
    with Bag(folder, kind) as bag:
        write = prepare(bag)
        for scan in returns.scans():
            write(bag, scan, int(scan.times_ns[0]))
        bag.write_camera(image_times())
    return bag.path


_FIELD = re.compile(r"^ *(\w+ +\w+) *= *(?:(-?[\d.]+) )?(\w+)(.*)$", re.MULTILINE)
"""A field of a target: type and name, a factor, the quantity that fills it, a comment."""
_TARGETS = "std_msgs/Header header\nuint32 sequence\nTarget[] targets\n"


def _quantities(scan: Returns) -> dict[str, np.ndarray]:
    """Return all that a target's field may hold, by a short name; lengths in m, angles in rad unless they say deg."""
    x, y, z = scan.points_m.T
    r, az, el = polar(scan.points_m).T
    return {
        "x": x, "y": y, "z": z, "r": r, "az": az, "el": el, "az_deg": np.degrees(az), "el_deg": np.degrees(el),
        "from_zenith": np.pi / 2 - el, "level": np.hypot(x, y), "v": scan.doppler_mps, "snr": scan.snr_db,
        "rcs": scan.snr_db - 20, "id": np.arange(len(x)), "one": np.ones(len(x)),
    }  # fmt: skip


def _target_list(
    about: str, kind: Kind, seed: int, name: str, listing: str, *, message: str = _TARGETS,
    as_assumed: Callable[[np.ndarray], np.ndarray] | None = None, **truth: Any,
) -> Layout:  # fmt: skip
    """Return what writes a message with a header and a list of targets.

    Args:
        about: what is particular to it.
        kind: of the bag.
        seed: of the scene.
        name: the message's type.
        listing: a target's fields, as a definition has them, each with "= QUANTITY" behind its name.
        message: the definition around the list; its numbers are the list's length.
        as_assumed: what becomes of the positions where they are assumed to be something else.
        truth: further fields of Truth.
    """
    element, of_list = next(line.split("[] ") for line in message.splitlines() if "[]" in line)
    scalars = [line.split()[1] for line in message.splitlines()[1:] if "[]" not in line]
    fields = [(left.split(), float(factor or 1), what) for left, factor, what, _ in _FIELD.findall(listing)]
    package = name.split("/")[0]

    def prepare(bag: Bag) -> Callable[[Bag, Returns, int], None]:
        bag.define(name, message, **{element: _FIELD.sub(r"\1 \4", listing).lstrip("\n")})
        return write

    def write(bag: Bag, scan: Returns, time_ns: int) -> None:
        quantities, columns = _quantities(scan), {}
        for (number, field), factor, what in fields:
            column = factor * quantities[what]
            columns[field] = (column if number.startswith("float") else np.rint(column).astype(int)).tolist()
        targets = [
            bag.make(f"{package}/msg/{element}", **{field: column[row] for field, column in columns.items()})
            for row in range(len(scan.times_ns))
        ]
        counts = dict.fromkeys(scalars, len(targets))
        bag.write(
            "/radar/targets", name,
            bag.make(name, header=bag.header(time_ns, "radar"), **counts, **{of_list: targets}), time_ns,
        )  # fmt: skip

    def layout(folder: Path) -> Truth:
        returns = scene(seed)
        path = _each_scan(folder, kind, returns, prepare)
        assumed_m = None if as_assumed is None else as_assumed(returns.points_m)
        return Truth((path,), returns, image_times(), as_assumed_m=assumed_m, **truth)

    layout.__doc__ = about
    return layout


def _level(points_m: np.ndarray) -> np.ndarray:
    """Return positions (n, 3) at their range and azimuth, without elevation."""
    r, az, _ = polar(points_m).T
    return np.column_stack([r * np.cos(az), r * np.sin(az), np.zeros(len(r))])


TARGET_LISTS: dict[str, Layout] = {
    "vendor_structs": _target_list(
        "RadarDetectionPacket, an array of structs with f_ and s_ prefixes, Cartesian, no comment anywhere.",
        "bag", 1, "vendor_radar/msg/RadarDetectionPacket",
        """
        uint16 u_Id = id
        float32 f_PosX = x
        float32 f_PosY = y
        float32 f_PosZ = z
        float32 f_VelRad = v
        float32 f_Rcs = rcs
        float32 f_VarX = 0.04 one
        float32 f_VarY = 0.09 one
        float32 f_AzimuthAngle = az
        float32 f_Range = r
        uint8 u_Quality = 90 one
        """,
        message="Header header\nuint32 u_Cycle\nuint16 u_Count\nDetection[] s_Detections\n",
    ),
    "packets_with_comments": _target_list(
        "RadarPackets with decoded polar values; degrees and signs are in the comments.",
        "mcap", 2, "acme_radar/msg/RadarPackets",
        """
        float32 range = r # [m]
        float32 azimuth = -1 az_deg # [deg], positive to the right
        float32 elevation = el_deg # [deg], positive upwards
        float32 range_rate = v # [m/s], positive = moving away
        float32 rcs = rcs # [dBsm]
        """,
    ),
    "polar_without_comments": _target_list(
        "Polar degrees, azimuth to the right, and nothing that says so.",
        "db3", 3, "corner_radar/msg/TargetList",
        """
        float32 range = r
        float32 angle_az = -1 az_deg
        float32 angle_el = el_deg
        float32 velocity = v
        float32 snr = snr
        """,
        as_assumed=mirrored,
        stated=RecordingOptions(
            map=("range=range:m", "azimuth=-angle_az:deg", "elevation=angle_el:deg", "doppler=velocity:mps")
        ),
    ),
    "scaled_integers": _target_list(
        "Range in cm as uint16 and angles in 0.01 deg as int16, said by comments.",
        "mcap", 4, "imaging_radar/msg/DetectionList",
        """
        uint16 u16_range = 100 r # radial distance in cm
        int16 s16_azimuth = 100 az_deg # 0.01 deg, positive to the left
        int16 s16_elevation = 100 el_deg # 0.01 deg, positive up
        int16 s16_velocity = 100 v # radial velocity, 0.01 m/s, negative when approaching
        uint8 u8_snr = snr # dB
        """,
        position_tolerance_m=0.02,
    ),
    "right_forward_comment": _target_list(
        "x to the right and y forward, as a comment above the fields says.",
        "mcap", 5, "mmwave_driver/msg/Targets",
        """
        # Position of the target in the sensor frame: x right, y forward, z up [m]
        float32 x = -1 y
        float32 y = x
        float32 z = z
        # Doppler speed [m/s], positive when the target moves away
        float32 speed = v
        float32 power = snr # dB
        """,
    ),
    "integers_with_a_least_bit": _target_list(
        "x, y, z as int16 with the size of the least bit in a comment.",
        "bag", 9, "can_radar/msg/ObjectFrame",
        """
        int16 x = 100 x # LSB = 0.01 m, forward
        int16 y = 100 y # LSB = 0.01 m, left
        int16 z = 100 z # LSB = 0.01 m, up
        int16 doppler = 20 v # LSB = 0.05 m/s, positive: receding
        uint16 snr = 10 snr # LSB = 0.1 dB
        """,
        position_tolerance_m=0.01,
    ),
    "angle_from_the_zenith": _target_list(
        "Spherical coordinates of physics, whose theta is no elevation; it may be left out, but not silently.",
        "mcap", 15, "physics_radar/msg/Frame",
        """
        float32 r = r # m
        float32 phi = az # azimuth, rad, positive to the left
        float32 theta = from_zenith # polar angle from the zenith, rad
        float32 v = v # m/s, positive away
        """,
        as_assumed=_level,
    ),
    "bare_millimetres": _target_list(
        "x, y, z and v as int32 in millimetres, and nothing that says so.",
        "db3", 16, "tiny_radar/msg/Points",
        """
        int32 x = 1000 x
        int32 y = 1000 y
        int32 z = 1000 z
        int32 v = 1000 v
        """,
        has_doppler=False,
    ),
    "elevation_downwards": _target_list(
        "A comment says that the elevation grows downwards.",
        "mcap", 18, "low_radar/msg/Frame",
        """
        float32 range = r # m
        float32 azimuth = az # rad, positive to the left
        float32 elevation = -1 el # rad, positive downwards
        float32 range_rate = v # m/s, positive away
        """,
    ),
    "cylindrical": _target_list(
        "A horizontal distance, an azimuth and a height; the height may be left out, but not silently.",
        "mcap", 19, "drum_radar/msg/Frame",
        """
        float32 range = level # horizontal distance [m]
        float32 azimuth = az # rad, positive to the left
        float32 z = z # m
        float32 range_rate = v # m/s, positive away
        """,
        as_assumed=lambda points_m: points_m * [1.0, 1.0, 0.0],
    ),
}  # fmt: skip


def nested_twice(folder: Path) -> Truth:
    """ROS 2 db3: a frame holds sectors, each sector holds targets with a geometry_msgs/Point."""
    returns = scene(6)
    name = "sector_radar/msg/Frame"

    def prepare(bag: Bag) -> Callable[[Bag, Returns, int], None]:
        bag.define(
            name,
            "std_msgs/Header header\nuint8 mode\nSector[] sectors\n",
            Target="uint16 target_id\ngeometry_msgs/Point position\nfloat32 radial_speed # m/s, positive away\nfloat32 snr_db\n",
            Sector="uint8 sector_id\nfloat32 temperature\nTarget[] targets\n",
        )
        return write

    def write(bag: Bag, scan: Returns, time_ns: int) -> None:
        targets = [
            bag.make(
                "sector_radar/msg/Target",
                target_id=number,
                position=bag.make("geometry_msgs/msg/Point", x=point[0], y=point[1], z=point[2]),
                radial_speed=doppler,
                snr_db=snr,
            )
            for number, (point, doppler, snr) in enumerate(
                zip(scan.points_m.tolist(), scan.doppler_mps, scan.snr_db, strict=True)
            )
        ]
        cuts = (targets[:5], [], targets[5:])
        sectors = [
            bag.make("sector_radar/msg/Sector", sector_id=number, temperature=41.5, targets=part)
            for number, part in enumerate(cuts)
        ]
        message = bag.make(name, header=bag.header(time_ns, "radar"), mode=2, sectors=sectors)
        bag.write("/sector_radar/frame", name, message, time_ns)

    return Truth((_each_scan(folder, "db3", returns, prepare),), returns, image_times())


def arrays_side_by_side(folder: Path) -> Truth:
    """ROS 1: fixed arrays of 64 figures side by side, of which a count says how many are filled."""
    returns = scene(7)
    name = "array_radar/msg/RadarFrame"
    columns = ("pos_x", "pos_y", "pos_z", "doppler", "snr")

    def prepare(bag: Bag) -> Callable[[Bag, Returns, int], None]:
        bag.define(
            name, "Header header\nuint32 num_targets\n" + "".join(f"float32[64] {column}\n" for column in columns)
        )
        return write

    def write(bag: Bag, scan: Returns, time_ns: int) -> None:
        values = np.zeros((64, 5), dtype=np.float32)
        values[: len(scan.times_ns)] = np.column_stack([scan.points_m, scan.doppler_mps, scan.snr_db])
        arrays = {column: np.ascontiguousarray(values[:, number]) for number, column in enumerate(columns)}
        message = bag.make(name, header=bag.header(time_ns, "radar"), num_targets=len(scan.times_ns), **arrays)
        bag.write("/radar/frame", name, message, time_ns)

    return Truth((_each_scan(folder, "bag", returns, prepare),), returns, image_times())
