"""`cocalib solve --pairs` on pairs that other people measured, converted to our format here."""

import json
from pathlib import Path

import numpy as np
import pytest

from calib_core.geometry import rotation_angle_rad
from cocalib.cli import run

pytestmark = pytest.mark.real

SIZES_PX = {"acfr_lidar_chessboard_40": (1920, 1208), "heethesh_lidar_clicks_16": (964, 724)}
SIGMAS = {
    "acfr_lidar_chessboard_40": {"sigma_range_m": 0.015, "sigma_azimuth_rad": 0.005, "sigma_elevation_rad": 0.005},
    "heethesh_lidar_clicks_16": {"sigma_range_m": 0.03, "sigma_azimuth_rad": 0.02, "sigma_elevation_rad": 0.02},
}


def converted(folder: Path, name: str) -> tuple[dict, dict]:
    """Return the pairs as a pairs-1 document, and the file as it was published."""
    source = json.loads((folder / "real_pairs" / f"{name}.json").read_text(encoding="utf-8"))
    width_px, height_px = SIZES_PX[name]
    document = {
        "schema": "cocalib/pairs-1",
        "camera": {
            "model": "plumb_bob",
            "width_px": width_px,
            "height_px": height_px,
            "matrix_px": source["camera"]["K"],
            "distortion": source["camera"]["D"],
        },
        "radar": SIGMAS[name],
        "pairs": [{"id": row["id"], "radar_m": row["xyz"], "pixel_px": row["uv"]} for row in source["pairs"]],
    }
    return document, source


@pytest.mark.parametrize("method", ["default", "paper"])
@pytest.mark.parametrize("name", list(SIZES_PX))
def test_solve_runs_on_real_pairs(shared_data: Path, tmp_path: Path, name: str, method: str) -> None:
    document, source = converted(shared_data, name)
    pairs, out = tmp_path / "pairs.json", tmp_path / "calibration.json"
    pairs.write_text(json.dumps(document))
    assert run(["solve", "--pairs", str(pairs), "--out", str(out), "--method", method]) == 0
    solved = json.loads(out.read_text())
    assert solved["schema"] == "cocalib/calibration-1"
    assert [pair["id"] for pair in solved["pairs"]] == [row["id"] for row in source["pairs"]]
    published = np.array(source["published_T_camera_from_sensor"]["R"])
    turned = np.array(solved["camera_from_radar"]["rotation"]) @ published.T
    assert np.rad2deg(rotation_angle_rad(turned)) < 8.0
    if method == "default" and name == "acfr_lidar_chessboard_40":
        assert np.rad2deg(rotation_angle_rad(turned)) < 0.5
        (outlier,) = (pair for pair in solved["pairs"] if not pair["inlier"])
        assert outlier["distance_px"] == pytest.approx(53.0, abs=5.0)
