"""Layouts of recordings with ROS: positions that are not what radars usually send."""

from pathlib import Path

import numpy as np

from tests.corpus_layouts.messages import target_list
from tests.corpus_layouts.truth import Returns, Truth, picture_times, polar, scene


def angle_from_the_zenith(folder: Path) -> Truth:
    """ROS 2 mcap: spherical coordinates of physics, whose theta is no elevation; it may be left out, but not silently."""
    returns = scene(15)
    text = (
        "float32 r      # m\n"
        "float32 phi    # azimuth, rad, positive to the left\n"
        "float32 theta  # polar angle from the zenith, rad\n"
        "float32 v      # m/s, positive away\n"
    )
    angles = polar(returns.points_m)

    def rows(scan: Returns) -> dict[str, np.ndarray]:
        values = polar(scan.points_m)
        return {"r": values[:, 0], "phi": values[:, 1], "theta": np.pi / 2 - values[:, 2], "v": scan.doppler_mps}

    path = target_list(folder, "mcap", returns, "physics_radar/msg/Frame", text, rows)
    level_m = angles[:, :1] * np.column_stack([np.cos(angles[:, 1]), np.sin(angles[:, 1]), np.zeros(len(angles))])
    return Truth((path,), returns, picture_times(), as_assumed_m=level_m)


def bare_millimetres(folder: Path) -> Truth:
    """ROS 2 db3: x, y, z and v as int32 in millimetres, and nothing that says so."""
    returns = scene(16)

    def rows(scan: Returns) -> dict[str, np.ndarray]:
        points_mm = np.rint(scan.points_m * 1000).astype(int)
        speed = np.rint(scan.doppler_mps * 1000).astype(int)
        return {"x": points_mm[:, 0], "y": points_mm[:, 1], "z": points_mm[:, 2], "v": speed}

    text = "int32 x\nint32 y\nint32 z\nint32 v\n"
    path = target_list(folder, "db3", returns, "tiny_radar/msg/Points", text, rows)
    return Truth((path,), returns, picture_times(), has_doppler=False)


def elevation_downwards(folder: Path) -> Truth:
    """ROS 2 mcap: a comment says that the elevation grows downwards."""
    returns = scene(18)
    text = (
        "float32 range      # m\n"
        "float32 azimuth    # rad, positive to the left\n"
        "float32 elevation  # rad, positive downwards\n"
        "float32 range_rate # m/s, positive away\n"
    )

    def rows(scan: Returns) -> dict[str, np.ndarray]:
        values = polar(scan.points_m)
        return {
            "range": values[:, 0],
            "azimuth": values[:, 1],
            "elevation": -values[:, 2],
            "range_rate": scan.doppler_mps,
        }

    path = target_list(folder, "mcap", returns, "low_radar/msg/Frame", text, rows)
    return Truth((path,), returns, picture_times())


def cylindrical(folder: Path) -> Truth:
    """ROS 2 mcap: a horizontal distance, an azimuth and a height; the height may be left out, but not silently."""
    returns = scene(19)
    text = (
        "float32 range      # horizontal distance [m]\n"
        "float32 azimuth    # rad, positive to the left\n"
        "float32 z          # m\n"
        "float32 range_rate # m/s, positive away\n"
    )

    def rows(scan: Returns) -> dict[str, np.ndarray]:
        distance_m = np.hypot(scan.points_m[:, 0], scan.points_m[:, 1])
        azimuth = polar(scan.points_m)[:, 1]
        return {"range": distance_m, "azimuth": azimuth, "z": scan.points_m[:, 2], "range_rate": scan.doppler_mps}

    path = target_list(folder, "mcap", returns, "drum_radar/msg/Frame", text, rows)
    return Truth((path,), returns, picture_times(), as_assumed_m=returns.points_m * [1.0, 1.0, 0.0])
