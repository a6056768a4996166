"""Layouts of recordings with ROS: clouds and several topics."""

from pathlib import Path

import numpy as np

from tests.corpus_layouts.bags import Bag
from tests.corpus_layouts.truth import Returns, Truth, image_times, scene


def odd_big_endian_cloud(folder: Path) -> Truth:
    """ROS 2 mcap: a cloud of two rows, big endian, with gaps between the fields, after the rows, and odd names."""
    returns = scene(8)
    kind = np.dtype(
        {
            "names": ["posX", "posY", "posZ", "vRad", "rcs_dBsm", "flags"],
            "formats": [">f4", ">f4", ">f4", ">f8", ">i2", "u1"],
            "offsets": [4, 8, 16, 24, 34, 37],
            "itemsize": 40,
        }
    )
    filled = np.ones(len(returns.times_ns), dtype=bool)
    with Bag(folder, "mcap") as bag:
        for time_ns in np.unique(returns.times_ns):
            mask = returns.times_ns == time_ns
            if mask.sum() % 2:
                filled[np.flatnonzero(mask)[-1]] = False
                mask &= filled
            scan = returns.where(mask)
            rows = np.zeros(len(scan.times_ns), dtype=kind)
            rows["posX"], rows["posY"], rows["posZ"] = scan.points_m.T
            rows["vRad"], rows["rcs_dBsm"], rows["flags"] = scan.doppler_mps, np.rint(scan.snr_db) - 20, 3
            bag.write_cloud("/radar/detections", "radar", int(time_ns), rows, height=2, row_padding=8)
        bag.write_camera(image_times())
    return Truth((bag.path,), returns.where(filled), image_times())


def cloud_of_integers(folder: Path) -> Truth:
    """ROS 2 mcap: a cloud of int16 in centimetres, against the convention of ROS, and speeds in cm/s."""
    returns = scene(17)
    kind = np.dtype([("x", "<i2"), ("y", "<i2"), ("z", "<i2"), ("intensity", "<u2"), ("velocity", "<i2")])
    with Bag(folder, "mcap") as bag:
        for scan in returns.scans():
            rows = np.zeros(len(scan.times_ns), dtype=kind)
            rows["x"], rows["y"], rows["z"] = np.rint(scan.points_m * 100).T
            rows["velocity"], rows["intensity"] = np.rint(scan.doppler_mps * 100), np.rint(scan.snr_db * 10)
            bag.write_cloud("/radar_cloud", "radar", int(scan.times_ns[0]), rows)
        bag.write_camera(image_times())
    return Truth((bag.path,), returns, image_times(), position_tolerance_m=0.01)


_DOPPLER = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("doppler", "<f4")])
_LIDAR = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("ring", "<u2"), ("time", "<f4")])


def _rows(scan: Returns) -> np.ndarray:
    rows = np.zeros(len(scan.times_ns), dtype=_DOPPLER)
    rows["x"], rows["y"], rows["z"] = scan.points_m.T
    rows["intensity"], rows["doppler"] = scan.snr_db, scan.doppler_mps
    return rows


def points_beside_a_lidar(folder: Path) -> Truth:
    """ROS 1: a radar's cloud with Doppler on /points, beside a lidar's cloud."""
    returns = scene(10)
    rng = np.random.default_rng(0)
    with Bag(folder, "bag") as bag:
        for scan in returns.scans():
            time_ns = int(scan.times_ns[0])
            bag.write_cloud("/points", "base_radar", time_ns, _rows(scan))
            lidar = np.zeros(900, dtype=_LIDAR)
            lidar["x"], lidar["y"], lidar["z"] = rng.normal(0, 15, (3, 900))
            lidar["intensity"], lidar["ring"] = rng.integers(0, 255, 900), rng.integers(0, 16, 900)
            bag.write_cloud("/velodyne_points", "velodyne", time_ns + 3_000_000, lidar)
        bag.write_camera(image_times())
    return Truth((bag.path,), returns, image_times())


def near_and_far(folder: Path) -> Truth:
    """ROS 2 db3: the near and the far scan of one radar on two topics; both report what lies at 12 to 20 m."""
    returns = scene(11)
    range_m = np.linalg.norm(returns.points_m, axis=1)
    with Bag(folder, "db3") as bag:
        for topic, part in (("/radar/far", returns.where(range_m > 12)), ("/radar/near", returns.where(range_m < 20))):
            for scan in part.scans():
                bag.write_cloud(f"{topic}/points", "radar_front", int(scan.times_ns[0]), _rows(scan))
        bag.write_camera(image_times())
    return Truth((bag.path,), returns, image_times())


def front_and_side(folder: Path) -> Truth:
    """ROS 2 mcap: a front radar with many returns and a corner radar with eight; the front one is meant."""
    front, side = scene(13), scene(14)
    with Bag(folder, "mcap") as bag:
        for scan in front.scans():
            bag.write_cloud(
                "/sensing/radar/front_center/points", "radar_front_center", int(scan.times_ns[0]), _rows(scan)
            )
        for scan in side.scans():
            rows = _rows(scan)[:8]
            bag.write_cloud(
                "/sensing/radar/corner_left/points", "radar_corner_left", int(scan.times_ns[0]) + 9_000_000, rows
            )
        bag.write_camera(image_times())
    return Truth((bag.path,), front, image_times())
