"""Algorithm 1 on pairs that people measured: lidar points and pixels, with the published poses beside them."""

import json
from pathlib import Path

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.measurements import Candidate, Pair
from calib_core.options import CalibrationOptions
from calib_core.paper.algorithm_1 import solve_pairs_as_printed
from calib_core.results import Calibration

pytestmark = pytest.mark.real


def solve(shared_data: Path, name: str) -> tuple[Calibration, RigidTransform]:
    """Solve a set of pairs; return the result and the published pose."""
    data = json.loads((shared_data / "real_pairs" / f"{name}.json").read_text(encoding="utf-8"))
    matrix = np.array(data["camera"]["K"])
    camera = Camera("plumb_bob", round(2 * matrix[0, 2]), round(2 * matrix[1, 2]), matrix, data["camera"]["D"])
    unknown = np.full((3, 3), np.nan)
    pairs = [
        Pair(f"{i:03d}", np.array(pair["uv"]), (Candidate(np.array(pair["xyz"]), unknown[0], unknown),))
        for i, pair in enumerate(data["pairs"])
    ]
    outcome = solve_pairs_as_printed(pairs, camera, CalibrationOptions(method="paper"))
    assert isinstance(outcome, Calibration), outcome
    published = data["published_T_camera_from_sensor"]
    return outcome, RigidTransform.from_matrix(np.column_stack([published["R"], published["t"]]))


def test_forty_board_centres_give_about_the_published_pose(shared_data: Path) -> None:
    result, published = solve(shared_data, "acfr_lidar_chessboard_40")
    apart_deg = np.rad2deg(rotation_angle_rad(result.camera_from_radar.rotation @ published.rotation.T))
    assert apart_deg < 1.0
    assert np.linalg.norm(result.camera_from_radar.translation_m - published.translation_m) < 0.15
    assert result.metrics.n == 40
    assert result.metrics.aed_px < 6.0


def test_ransac_marks_the_one_wrong_board_that_the_last_line_uses_all_the_same(shared_data: Path) -> None:
    result, _ = solve(shared_data, "acfr_lidar_chessboard_40")
    worst = max(result.pairs, key=lambda pair: pair.distance_px)
    assert worst.distance_px > 40.0
    assert not worst.inlier


def test_sixteen_human_clicks_with_wrong_ones_among_them_are_not_solved_to_a_click(shared_data: Path) -> None:
    result, _ = solve(shared_data, "heethesh_lidar_clicks_16")
    assert 0 < sum(pair.inlier for pair in result.pairs) < 16
    assert result.metrics.aed_px > 5.0
