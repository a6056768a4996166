"""Layouts of recordings with ROS: vendors' messages and clouds."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from calib_core.recordings import RecordingOptions
from tests.corpus_layouts.bags import Bag, Kind
from tests.corpus_layouts.truth import Returns, Truth, mirrored, picture_times, polar, scene


def _each_scan(
    folder: Path, kind: Kind, returns: Returns, prepare: Callable[[Bag], Callable[[Bag, Returns, int], None]]
) -> Path:
    with Bag(folder, kind) as bag:
        write = prepare(bag)
        for scan in returns.scans():
            write(bag, scan, int(scan.times_ns[0]))
        bag.write_camera(picture_times())
    return bag.path


def vendor_structs(folder: Path) -> Truth:
    """ROS 1: RadarDetectionPacket, an array of structs with f_ and s_ prefixes, Cartesian, no comment anywhere."""
    returns = scene(1)
    names = ("f_PosX", "f_PosY", "f_PosZ", "f_VelRad", "f_Rcs", "f_VarX", "f_VarY", "f_AzimuthAngle", "f_Range")
    text = "uint16 u_Id\n" + "".join(f"float32 {name}\n" for name in names) + "uint8 u_Quality\n"

    def prepare(bag: Bag) -> Callable[[Bag, Returns, int], None]:
        bag.define(
            "vendor_radar/msg/RadarDetectionPacket",
            "Header header\nuint32 u_Cycle\nuint16 u_Count\nDetection[] s_Detections\n",
            Detection=text,
        )
        return write

    def write(bag: Bag, scan: Returns, time_ns: int) -> None:
        angles = polar(scan.points_m)
        detections = [
            bag.make(
                "vendor_radar/msg/Detection",
                u_Id=number,
                **dict(zip(names, (*point, doppler, snr - 20, 0.04, 0.09, angle, range_m), strict=True)),
                u_Quality=90,
            )
            for number, (point, doppler, snr, (range_m, angle, _)) in enumerate(
                zip(scan.points_m.tolist(), scan.doppler_mps, scan.snr_db, angles.tolist(), strict=True)
            )
        ]
        message = bag.make(
            "vendor_radar/msg/RadarDetectionPacket",
            header=bag.header(time_ns, "radar_front"),
            u_Cycle=7,
            u_Count=len(detections),
            s_Detections=detections,
        )
        bag.write("/radar_front/detections", "vendor_radar/msg/RadarDetectionPacket", message, time_ns)

    return Truth((_each_scan(folder, "bag", returns, prepare),), returns, picture_times())


def target_list(
    folder: Path, kind: Kind, returns: Returns, name: str, text: str, rows: Callable[[Returns], dict[str, np.ndarray]]
) -> Path:
    """Write a message with a header and a list of targets whose fields are the columns of rows."""
    package = name.split("/")[0]
    list_text = "std_msgs/Header header\nuint32 sequence\nTarget[] targets\n"

    def prepare(bag: Bag) -> Callable[[Bag, Returns, int], None]:
        bag.define(name, list_text, Target=text)
        return write

    def write(bag: Bag, scan: Returns, time_ns: int) -> None:
        columns = {field: column.tolist() for field, column in rows(scan).items()}
        targets = [
            bag.make(f"{package}/msg/Target", **{field: column[number] for field, column in columns.items()})
            for number in range(len(scan.times_ns))
        ]
        message = bag.make(name, header=bag.header(time_ns, "radar"), sequence=1, targets=targets)
        bag.write("/radar/targets", name, message, time_ns)

    return _each_scan(folder, kind, returns, prepare)


def packets_with_comments(folder: Path) -> Truth:
    """ROS 2 mcap: RadarPackets with decoded polar values; degrees and signs are in the comments."""
    returns = scene(2)
    text = (
        "float32 range        # [m]\n"
        "float32 azimuth      # [deg], positive to the right\n"
        "float32 elevation    # [deg], positive upwards\n"
        "float32 range_rate   # [m/s], positive = moving away\n"
        "float32 rcs          # [dBsm]\n"
    )

    def rows(scan: Returns) -> dict[str, np.ndarray]:
        values = polar(scan.points_m)
        angles_deg = np.degrees(values[:, 1:])
        return {
            "range": values[:, 0],
            "azimuth": -angles_deg[:, 0],
            "elevation": angles_deg[:, 1],
            "range_rate": scan.doppler_mps,
            "rcs": scan.snr_db - 20,
        }

    path = target_list(folder, "mcap", returns, "acme_radar/msg/RadarPackets", text, rows)
    return Truth((path,), returns, picture_times())


def polar_without_comments(folder: Path) -> Truth:
    """ROS 2 db3: polar degrees, azimuth to the right, and nothing that says so."""
    returns = scene(3)
    text = "float32 range\nfloat32 angle_az\nfloat32 angle_el\nfloat32 velocity\nfloat32 snr\n"

    def rows(scan: Returns) -> dict[str, np.ndarray]:
        values = polar(scan.points_m)
        return {
            "range": values[:, 0],
            "angle_az": -np.degrees(values[:, 1]),
            "angle_el": np.degrees(values[:, 2]),
            "velocity": scan.doppler_mps,
            "snr": scan.snr_db,
        }

    path = target_list(folder, "db3", returns, "corner_radar/msg/TargetList", text, rows)
    stated = RecordingOptions(
        map=("range=range:m", "azimuth=-angle_az:deg", "elevation=angle_el:deg", "doppler=velocity:mps")
    )
    return Truth((path,), returns, picture_times(), stated=stated, as_assumed_m=mirrored(returns.points_m))


def scaled_integers(folder: Path) -> Truth:
    """ROS 2 mcap: range in cm as uint16 and angles in 0.01 deg as int16, said by comments."""
    returns = scene(4)
    text = (
        "uint16 u16_range    # radial distance in cm\n"
        "int16 s16_azimuth   # 0.01 deg, positive to the left\n"
        "int16 s16_elevation # 0.01 deg, positive up\n"
        "int16 s16_velocity  # radial velocity, 0.01 m/s, negative when approaching\n"
        "uint8 u8_snr        # dB\n"
    )

    def rows(scan: Returns) -> dict[str, np.ndarray]:
        values = polar(scan.points_m)
        return {
            "u16_range": np.rint(values[:, 0] * 100).astype(int),
            "s16_azimuth": np.rint(np.degrees(values[:, 1]) * 100).astype(int),
            "s16_elevation": np.rint(np.degrees(values[:, 2]) * 100).astype(int),
            "s16_velocity": np.rint(scan.doppler_mps * 100).astype(int),
            "u8_snr": np.rint(scan.snr_db).astype(int),
        }

    path = target_list(folder, "mcap", returns, "imaging_radar/msg/DetectionList", text, rows)
    return Truth((path,), returns, picture_times(), position_tolerance_m=0.02)


def right_forward_comment(folder: Path) -> Truth:
    """ROS 2 mcap: x to the right and y forward, as a comment above the fields says."""
    returns = scene(5)
    text = (
        "# Position of the target in the sensor frame: x right, y forward, z up [m]\n"
        "float32 x\nfloat32 y\nfloat32 z\n"
        "# Doppler speed [m/s], positive when the target moves away\n"
        "float32 speed\n"
        "float32 power # dB\n"
    )

    def rows(scan: Returns) -> dict[str, np.ndarray]:
        return {
            "x": -scan.points_m[:, 1],
            "y": scan.points_m[:, 0],
            "z": scan.points_m[:, 2],
            "speed": scan.doppler_mps,
            "power": scan.snr_db,
        }

    path = target_list(folder, "mcap", returns, "mmwave_driver/msg/Targets", text, rows)
    return Truth((path,), returns, picture_times())


def integers_with_a_least_bit(folder: Path) -> Truth:
    """ROS 1: x, y, z as int16 with the size of the least bit in a comment."""
    returns = scene(9)
    text = (
        "int16 x        # LSB = 0.01 m, forward\n"
        "int16 y        # LSB = 0.01 m, left\n"
        "int16 z        # LSB = 0.01 m, up\n"
        "int16 doppler  # LSB = 0.05 m/s, positive: receding\n"
        "uint16 snr     # LSB = 0.1 dB\n"
    )

    def rows(scan: Returns) -> dict[str, np.ndarray]:
        points_lsb = np.rint(scan.points_m * 100).astype(int)
        return {
            "x": points_lsb[:, 0],
            "y": points_lsb[:, 1],
            "z": points_lsb[:, 2],
            "doppler": np.rint(scan.doppler_mps / 0.05).astype(int),
            "snr": np.rint(scan.snr_db * 10).astype(int),
        }

    path = target_list(folder, "bag", returns, "can_radar/msg/ObjectFrame", text, rows)
    return Truth((path,), returns, picture_times(), position_tolerance_m=0.01)


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

    return Truth((_each_scan(folder, "db3", returns, prepare),), returns, picture_times())


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

    return Truth((_each_scan(folder, "bag", returns, prepare),), returns, picture_times())
