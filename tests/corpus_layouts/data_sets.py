"""Layouts of folders as public data sets have them."""

import json
from pathlib import Path

import numpy as np

from calib_core.recordings import RecordingOptions
from tests.corpus_layouts.files import date_text
from tests.corpus_layouts.truth import CAMERA, HEIGHT_PX, START_NS, WIDTH_PX, Returns, Truth, jpeg, scene


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
    (root / "lidar" / "training" / "image_2").mkdir()
    rng = np.random.default_rng(3)
    for number in range(frames):
        name = f"{number + 100:05d}"
        for sensor in ("lidar", "radar", "radar_5frames"):
            (root / sensor / "training" / "calib" / f"{name}.txt").write_text(calibration)
        (root / "lidar" / "training" / "velodyne" / f"{name}.bin").write_bytes(
            rng.normal(0, 9, (500, 4)).astype("<f4").tobytes()
        )
        (root / "radar" / "training" / "velodyne" / f"{name}.bin").write_bytes(_delft(scans[number : number + 1]))
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
    """A KITTI raw drive with a radar's table added: x, y, z and velocity without units, dates of the pictures in a list."""
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
            rng.normal(0, 9, (300, 4)).astype("<f4").tobytes()
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
    front = scene(32, start_ns=start_ns, period_ns=period_ns)
    front = front.with_points(front.points_m * [1.0, 1.0, 0.0])
    times_ns = start_ns + 5_000_000 + np.arange(36) * 83_000_000
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
        (target / f"n015-2018-07-24-11-22-45+0800__CAM_FRONT__{time_ns // 1000}.jpg").write_bytes(jpeg(number))
    _write_tables(root / "v1.0-mini")
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


def _write_tables(folder: Path) -> None:
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
    (folder / "sensor.json").write_text(json.dumps(sensors, indent=0))
    (folder / "calibrated_sensor.json").write_text(json.dumps(calibrated, indent=0))
