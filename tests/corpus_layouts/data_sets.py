"""Layouts of folders as public data sets have them."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.recordings import RecordingOptions
from tests.corpus_layouts.files import date_text
from tests.corpus_layouts.truth import CAMERA, HEIGHT_PX, START_NS, WIDTH_PX, Returns, Truth, jpeg, polar, scene

_LENGTH_M, _WIDTH_M, _HEIGHT_M = 4.0, 1.8, 1.5
_TURN_RAD = 0.3  # of a car's length from straight ahead, to the left


def cars(scan: Returns) -> np.ndarray:
    """Return the middles (n, 3) in the radar frame of cars around some returns of a scan, far enough apart."""
    azimuth = np.arctan2(scan.points_m[:, 1], scan.points_m[:, 0])
    range_m = np.linalg.norm(scan.points_m, axis=1)
    found: list[np.ndarray] = []
    for point in scan.points_m[(np.abs(azimuth) < 0.4) & (range_m > 7.0) & (range_m < 40.0)]:
        if all(np.linalg.norm(point - other) > 8.0 for other in found):
            found.append(point)
    return np.array(found).reshape(-1, 3)


def _kitti_labels(scan: Returns, camera_from_radar: np.ndarray) -> str:
    """Write the cars as KITTI's objects."""
    lines = []
    for middle in cars(scan):
        corners = middle + _corners()
        corners_camera = corners @ camera_from_radar[:, :3].T + camera_from_radar[:, 3]
        pixels = (corners_camera @ CAMERA.T)[:, :2] / corners_camera[:, 2:]
        edges = np.clip([*pixels.min(axis=0), *pixels.max(axis=0)], 0, [WIDTH_PX - 1, HEIGHT_PX - 1] * 2)
        x, y, z = camera_from_radar[:, :3] @ middle + camera_from_radar[:, 3]
        size = f"{_HEIGHT_M} {_WIDTH_M} {_LENGTH_M} {x:.3f} {y + _HEIGHT_M / 2:.3f} {z:.3f} {np.pi / 2 - _TURN_RAD:.3f}"
        lines.append(f"Car 0 0 0.0 {' '.join(f'{edge:.2f}' for edge in edges)} {size}\n")
    return "".join(lines)


def _corners() -> np.ndarray:
    corner = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    cosine, sine = np.cos(_TURN_RAD), np.sin(_TURN_RAD)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return corner * [_LENGTH_M, _WIDTH_M, _HEIGHT_M] @ turn.T


def _matrix_text(matrix: np.ndarray) -> str:
    return " ".join(f"{value:.12e}" for value in matrix.reshape(-1))


def view_of_delft(folder: Path) -> Truth:
    """View-of-Delft: numbered frames, radar as .bin of seven floats, sums of five scans beside it, P2 in calib."""
    root = folder / "view_of_delft_PUBLIC"
    frames = 30
    returns = scene(30, scans=frames)
    projection = np.hstack([CAMERA, np.zeros((3, 1))])
    pose = np.array([[0.0, -1.0, 0.0, 0.05], [0.0, 0.0, -1.0, 1.2], [1.0, 0.0, 0.0, -0.4]])
    calibration = "".join(f"P{number}: {_matrix_text(projection)}\n" for number in range(4))
    calibration += f"R0_rect: {_matrix_text(np.eye(3))}\nTr_velo_to_cam: {_matrix_text(pose)}\n"
    scans = returns.scans()
    for sensor in ("lidar", "radar", "radar_5frames"):
        for part in ("calib", "velodyne"):
            (root / sensor / "training" / part).mkdir(parents=True)
    for part in ("image_2", "label_2"):
        (root / "lidar" / "training" / part).mkdir()
    rng = np.random.default_rng(3)
    for number in range(frames):
        name = f"{number + 100:05d}"
        for sensor in ("lidar", "radar", "radar_5frames"):
            (root / sensor / "training" / "calib" / f"{name}.txt").write_text(calibration)
        (root / "lidar" / "training" / "velodyne" / f"{name}.bin").write_bytes(
            (rng.normal(0, 9, (500, 4)) * [1, 1, 1, 0] + [0, 0, 0, 0.4]).astype("<f4").tobytes()
        )
        (root / "radar" / "training" / "velodyne" / f"{name}.bin").write_bytes(_delft(scans[number : number + 1]))
        (root / "lidar" / "training" / "label_2" / f"{name}.txt").write_text(_kitti_labels(scans[number], pose))
        recent = scans[max(0, number - 4) : number + 1]
        (root / "radar_5frames" / "training" / "velodyne" / f"{name}.bin").write_bytes(_delft(recent))
        (root / "lidar" / "training" / "image_2" / f"{name}.jpg").write_bytes(jpeg(number))
    times_ns = START_NS + np.arange(frames) * 100_000_000
    return Truth((root,), returns, times_ns, times_are_relative=True)


def _delft(scans: list[Returns]) -> bytes:
    """Pack scans, the newest last: x y z rcs v_r v_r_compensated time."""
    rows = [
        np.column_stack(
            [
                scan.points_m,
                scan.snr_db - 20,
                scan.doppler_mps,
                scan.doppler_mps * 0.5,
                np.full(len(scan.times_ns), 0.0 - age),
            ]
        )
        for age, scan in enumerate(reversed(scans))
    ]
    return np.concatenate(rows).astype("<f4").tobytes()


def kitti_raw_drive(folder: Path) -> Truth:
    """A KITTI raw drive with a radar's table added: x, y, z and velocity without units, dates of the images in a list."""
    day = folder / "2011_09_26"
    drive = day / "2011_09_26_drive_0001_sync"
    start_ns = 1_317_042_145_964_389_000
    returns = scene(31, start_ns=start_ns)
    frames = 40
    times_ns = start_ns + 7_000_000 + np.arange(frames) * 103_000_000
    for part in ("image_02", "velodyne_points"):
        (drive / part / "data").mkdir(parents=True)
        lines = [date_text(time, "%Y-%m-%d %H:%M:%S.%f") + "000" for time in times_ns.tolist()]
        (drive / part / "timestamps.txt").write_text("\n".join(lines) + "\n")
    rng = np.random.default_rng(4)
    for number in range(frames):
        (drive / "image_02" / "data" / f"{number:010d}.png").write_bytes(jpeg(number, ".png"))
        (drive / "velodyne_points" / "data" / f"{number:010d}.bin").write_bytes(
            (rng.normal(0, 9, (300, 4)) * [1, 1, 1, 0] + [0, 0, 0, 0.4]).astype("<f4").tobytes()
        )
    size = f"{WIDTH_PX:.6e} {HEIGHT_PX:.6e}"
    raw_size, raw = (
        f"{WIDTH_PX + 18:.6e} {HEIGHT_PX + 22:.6e}",
        CAMERA * [[1.1, 1.0, 1.1], [1.0, 1.1, 1.1], [1.0, 1.0, 1.0]],
    )
    lines = ["calib_time: 09-Jan-2012 13:57:47", "corner_dist: 9.950000e-02"]
    for camera in ("00", "01", "02", "03"):
        lines += [
            f"S_{camera}: {raw_size}",
            f"K_{camera}: {_matrix_text(raw)}",
            f"D_{camera}: {_matrix_text(np.full(5, -0.1))}",
        ]
        lines += [f"R_{camera}: {_matrix_text(np.eye(3))}", f"T_{camera}: {_matrix_text(np.zeros(3))}"]
        lines += [f"S_rect_{camera}: {size}", f"R_rect_{camera}: {_matrix_text(np.eye(3))}"]
        lines += [f"P_rect_{camera}: {_matrix_text(np.hstack([CAMERA, np.zeros((3, 1))]))}"]
    (day / "calib_cam_to_cam.txt").write_text("\n".join(lines) + "\n")
    (drive / "radar").mkdir()
    rows = [
        f"{time / 1e9:.6f},{x:.4f},{y:.4f},{z:.4f},{doppler:.3f},{snr:.1f}"
        for time, (x, y, z), doppler, snr in zip(
            returns.times_ns.tolist(), returns.points_m.tolist(), returns.doppler_mps, returns.snr_db, strict=True
        )
    ]
    (drive / "radar" / "radar.csv").write_text("\n".join(["timestamp,x,y,z,velocity,power", *rows]) + "\n")
    stated = RecordingOptions(map=("x=x:m", "y=y:m", "z=z:m", "doppler=velocity:mps"), time_zone="+00:00")
    return Truth((drive,), returns, times_ns, time_tolerance_ns=1000, stated=stated)


_PCD_FIELDS = (
    "x y z dyn_prop id rcs vx vy vx_comp vy_comp is_quality_valid ambig_state x_rms y_rms invalid_state pdh0 "
    "vx_rms vy_rms"
)
_PCD_SIZES = "4 4 4 1 2 4 4 4 4 4 1 1 1 1 1 1 1 1"
_PCD_TYPES = "F F F I I F F F F F I I I I I I I I"


def nuscenes_mini(folder: Path) -> Truth:
    """nuScenes mini: two radars, the camera in the tables; annotated frames in samples, the others, not read, in sweeps."""
    root = folder / "v1.0-mini-download"
    start_us = 1_532_402_927_612_460
    start_ns, period_ns = start_us * 1000, 77_000_000
    front = scene(32, scans=58, start_ns=start_ns, period_ns=period_ns)
    front = front.with_points(front.points_m * [1.0, 1.0, 0.0])
    times_ns = start_ns + 5_000_000 + np.arange(54) * 83_000_000
    keyframes: list[tuple[int, Returns, str]] = []
    for number, scan in enumerate(front.scans()):
        part = "samples" if number % 6 == 0 else "sweeps"
        _write_pcd(root / part / "RADAR_FRONT", "RADAR_FRONT", int(scan.times_ns[0]) // 1000, scan)
        _write_pcd(
            root / part / "RADAR_FRONT_LEFT",
            "RADAR_FRONT_LEFT",
            int(scan.times_ns[0]) // 1000 + 11,
            scan.where(np.arange(len(scan.times_ns)) < 6),
        )
    for number, time_ns in enumerate(times_ns.tolist()):
        target = root / ("samples" if number % 6 == 0 else "sweeps") / "CAM_FRONT"
        target.mkdir(parents=True, exist_ok=True)
        name = f"n015-2018-07-24-11-22-45+0800__CAM_FRONT__{time_ns // 1000}.jpg"
        (target / name).write_bytes(jpeg(number))
        if number % 6 == 0:
            annotated_ns = np.unique(front.times_ns)[::6]
            scan = front.of_time(annotated_ns[np.abs(annotated_ns - time_ns).argmin()])
            keyframes.append((time_ns // 1000, scan, f"samples/CAM_FRONT/{name}"))
    _write_tables(root / "v1.0-mini", keyframes)
    annotated = np.isin(front.times_ns, np.unique(front.times_ns)[::6])
    return Truth((root,), front.where(annotated), times_ns[::6], has_doppler=False, frame_step=6)


def _write_pcd(folder: Path, channel: str, time_us: int, scan: Returns) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    count = len(scan.times_ns)
    letters = dict(zip("FI", ("f", "i"), strict=True))
    kinds = [f"<{letters[kind]}{size}" for kind, size in zip(_PCD_TYPES.split(), _PCD_SIZES.split(), strict=True)]
    rows = np.zeros(count, dtype=np.dtype(list(zip(_PCD_FIELDS.split(), kinds, strict=True))))
    rows["x"], rows["y"], rows["rcs"] = scan.points_m[:, 0], scan.points_m[:, 1], scan.snr_db - 20
    rows["vx"], rows["vy"], rows["is_quality_valid"], rows["ambig_state"] = scan.doppler_mps, 0.0, 1, 3
    header = (
        f"# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {_PCD_FIELDS}\nSIZE {_PCD_SIZES}\n"
        f"TYPE {_PCD_TYPES}\nCOUNT {' '.join('1' * 18)}\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS {count}\nDATA binary\n"
    )
    name = f"n015-2018-07-24-11-22-45+0800__{channel}__{time_us}.pcd"
    (folder / name).write_bytes(header.encode() + rows.tobytes())


def _write_tables(folder: Path, keyframes: list[tuple[int, Returns, str]]) -> None:
    folder.mkdir()
    channels = (("CAM_FRONT", "camera"), ("RADAR_FRONT", "radar"), ("RADAR_FRONT_LEFT", "radar"))
    sensors = [{"token": f"s{name}", "channel": name, "modality": kind} for name, kind in channels]
    calibrated = [
        {
            "token": f"c{name}",
            "sensor_token": f"s{name}",
            "translation": [1.7, 0.0, 1.5] if kind == "camera" else [3.4, 0.0, 0.5],
            "rotation": [0.5, -0.5, 0.5, -0.5] if kind == "camera" else [1.0, 0.0, 0.0, 0.0],
            "camera_intrinsic": CAMERA.tolist() if kind == "camera" else [],
        }
        for name, kind in channels
    ]
    tables: dict[str, list[dict[str, Any]]] = {"sensor": sensors, "calibrated_sensor": calibrated, "ego_pose": []}
    tables |= {
        "sample_data": [],
        "sample_annotation": [],
        "instance": [],
        "category": [{"token": "kc", "name": "vehicle.car"}],
    }
    for number, (time_us, scan, filename) in enumerate(keyframes):
        east_m = 400.0 + 3.0 * number  # the vehicle drives north
        keys = {"sample_token": f"k{number}", "ego_pose_token": f"e{number}", "calibrated_sensor_token": "cCAM_FRONT"}
        size = {"width": WIDTH_PX, "height": HEIGHT_PX, "is_key_frame": True}
        tables["sample_data"].append(
            {"token": f"d{number}", "timestamp": time_us, "filename": filename, **keys, **size}
        )
        half = float(np.sqrt(0.5))
        pose = {"translation": [1100.0, east_m, 0.0], "rotation": [half, 0.0, 0.0, half]}
        tables["ego_pose"].append({"token": f"e{number}", "timestamp": time_us, **pose})
        for at, middle in enumerate(cars(scan)):
            x, y, z = (middle + np.array([3.4, 0.0, 0.5])).tolist()
            yaw = np.pi / 2 + _TURN_RAD
            car = {"token": f"a{number}-{at}", "sample_token": f"k{number}", "instance_token": f"i{number}-{at}"}
            car |= {
                "translation": [1100.0 - y, east_m + x, z],
                "rotation": [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)],
            }
            tables["sample_annotation"].append({**car, "size": [_WIDTH_M, _LENGTH_M, _HEIGHT_M]})
            tables["instance"].append({"token": f"i{number}-{at}", "category_token": "kc"})
    for name, rows in tables.items():
        (folder / f"{name}.json").write_text(json.dumps(rows, indent=0))


def tj4dradset(folder: Path) -> Truth:
    """TJ4DRadSet: numbered frames, `velodyne` is the radar with eight floats a return, images of the same numbers."""
    training = folder / "TJ4DRadSet_4DRadar" / "training"
    frames = 24
    returns = scene(33, scans=frames)
    for part in ("velodyne", "image_2", "calib", "label_2"):
        (training / part).mkdir(parents=True)
    pose = np.array([[0.0, -1.0, 0.0, 0.02], [0.0, 0.0, -1.0, 0.6], [1.0, 0.0, 0.0, -0.1]])
    calibration = f"P2: {_matrix_text(np.hstack([CAMERA, np.zeros((3, 1))]))}\nR0_rect: {_matrix_text(np.eye(3))}\n"
    for number, scan in enumerate(returns.scans()):
        name = f"{20 * 1000 + number:06d}"
        range_m, azimuth, elevation = polar(scan.points_m).T
        columns = [scan.points_m, scan.doppler_mps, range_m, scan.snr_db, azimuth, elevation]
        (training / "velodyne" / f"{name}.bin").write_bytes(np.column_stack(columns).astype("<f4").tobytes())
        (training / "image_2" / f"{name}.png").write_bytes(jpeg(number, ".png"))
        (training / "label_2" / f"{name}.txt").write_text(_kitti_labels(scan, pose))
        (training / "calib" / f"{name}.txt").write_text(f"{calibration}Tr_velo_to_cam: {_matrix_text(pose)}\n")
    times_ns = START_NS + np.arange(frames) * 100_000_000
    return Truth((training,), returns, times_ns, times_are_relative=True)


def radiate(folder: Path) -> Truth:
    """RADIATE: the radar is images of echoes and has no returns, the lidar is tables; times are beside the folders."""
    root = folder / "city_1_0"
    start_s, frames = 1_574_859_771, 12
    rng = np.random.default_rng(5)
    for part, suffix, rate_hz in (
        ("Navtech_Polar", ".png", 4),
        ("Navtech_Cartesian", ".png", 4),
        ("zed_left", ".png", 15),
        ("zed_right", ".png", 15),
        ("velo_lidar", ".csv", 10),
        ("GPS_IMU_Twist", ".txt", 10),
    ):
        (root / part).mkdir(parents=True)
        lines = [
            f"Frame: {n + 1:06d} Time: {start_s + n // rate_hz}.{n % rate_hz * 10**9 // rate_hz:09d}"
            for n in range(frames)
        ]
        (root / f"{part}.txt").write_text("\n".join(lines) + "\n")
        for number in range(frames):
            target = root / part / f"{number + 1:06d}{suffix}"
            if suffix == ".png":
                target.write_bytes(jpeg(number, ".png"))
            elif suffix == ".csv":
                points = np.column_stack([rng.normal(0, 9, (60, 3)), rng.integers(0, 99, 60), rng.integers(0, 32, 60)])
                target.write_text("\n".join(",".join(f"{value:.6f}" for value in row) for row in points) + "\n")
            else:
                target.write_text("55.911,-3.321,94.2\n0,0,0.7,0.7\n0.1,0.2,0.0\n")
    (root / "meta.json").write_text(json.dumps({"set": "train_good", "type": "city"}))
    (root / "annotations").mkdir()
    place = [{"position": [580.1, 512.7, 20.3, 44.9], "rotation": 12.0}] * 4 + [[]]
    objects = [{"id": 1, "class_name": "car", "bboxes": place}]
    (root / "annotations" / "annotations.json").write_text(json.dumps(objects))
    return Truth((root,), scene(34, scans=1), np.zeros(0, dtype=np.int64))


def astyx(folder: Path) -> Truth:
    """Astyx HiRes 2019: single frames, radar and lidar as text with a heading, K in a JSON file of each frame."""
    root = folder / "dataset_astyx_hires2019"
    frames = 16
    returns = scene(35, scans=frames)
    for part in ("camera_front", "radar_6455", "lidar_vlp16", "calibration", "groundtruth_obj3d"):
        (root / part).mkdir(parents=True)
    camera_pose = [[0.0, 0.0, 1.0, 1.2], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0]]
    sensors = [
        {"sensor_uid": "camera_front", "calib_data": {"T_to_ref_COS": camera_pose, "K": CAMERA.tolist()}},
        {"sensor_uid": "lidar_vlp16", "calib_data": {"T_to_ref_COS": np.eye(4).tolist()}},
        {"sensor_uid": "radar_6455", "calib_data": {"T_to_ref_COS": np.eye(4).tolist()}},
    ]
    car = {"object_id": 0, "classname": "Car", "center3d": [12.0, 1.0, 0.3], "orientation_quat": [1.0, 0.0, 0.0, 0.0]}
    car |= {"dimension3d": [4.2, 1.8, 1.5], "occlusion": 0, "score": 0.9, "measurement_type": 2}
    rng = np.random.default_rng(6)
    for number, scan in enumerate(returns.scans()):
        name = f"{number:06d}"
        rows = np.column_stack([scan.points_m, scan.doppler_mps, scan.snr_db])
        radar = ["# X Y Z V_r Mag", *(" ".join(f"{value:.4f}" for value in row) for row in rows)]
        (root / "radar_6455" / f"{name}.txt").write_text("\n".join(radar) + "\n")
        points = rng.normal(0, 9, (60, 3))
        lidar = ["# X Y Z Reflectance Ring", *(" ".join(f"{value:.4f}" for value in row) + " 7 3" for row in points)]
        (root / "lidar_vlp16" / f"{name}.txt").write_text("\n".join(lidar) + "\n")
        (root / "camera_front" / f"{name}.jpg").write_bytes(jpeg(number))
        (root / "calibration" / f"{name}.json").write_text(json.dumps({"sensors": sensors}))
        (root / "groundtruth_obj3d" / f"{name}.json").write_text(json.dumps({"objects": [car]}))
    times_ns = START_NS + np.arange(frames) * 100_000_000
    return Truth((root,), returns, times_ns, times_are_relative=True)


def k_radar(folder: Path) -> Truth:
    """K-Radar's text form: labels and calibration as text, the radar as cubes of power, a lidar as PCD."""
    root = folder / "1"
    rng = np.random.default_rng(7)
    for part in ("cam-front", "os2-64", "radar_zyx_cube", "info_label", "info_calib", "time_info"):
        (root / part).mkdir(parents=True)
    (root / "info_calib" / "calib_radar_lidar.txt").write_text("frame difference,x,y\n32,-2.54,0.3\n")
    fields = "# .PCD v.7\nVERSION .7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 60\nHEIGHT 1\n"
    times = []
    for number in range(1, 11):
        lidar, cube = f"{number:05d}", f"{number + 32:05d}"
        (root / "cam-front" / f"cam-front_{lidar}.png").write_bytes(jpeg(number, ".png"))
        points = rng.normal(0, 9, (60, 4)).astype("<f4").tobytes()
        (root / "os2-64" / f"os2-64_{lidar}.pcd").write_bytes(f"{fields}POINTS 60\nDATA binary\n".encode() + points)
        (root / "radar_zyx_cube" / f"cube_{cube}.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(128) + bytes(512))
        head = f"* idx(tesseract_os2-64_cam-front_os1-128_cam-lrr)={cube}_{lidar}_{lidar}_{lidar}_{lidar}"
        stamp = f"{1_643_119_212 + 0.1 * number:.9f}"
        label = f"{head}, timestamp={stamp}\n*, 0, 0, Sedan, 30.44, -4.2, -0.3, 1.15, 4.4, 1.9, 1.5\n"
        (root / "info_label" / f"{cube}_{lidar}.txt").write_text(label)
        times.append(f"cam-front_{lidar}.png, {stamp}")
    (root / "time_info" / "cam-front.txt").write_text("\n".join(times) + "\n")
    return Truth((root,), scene(36, scans=1), np.zeros(0, dtype=np.int64))
