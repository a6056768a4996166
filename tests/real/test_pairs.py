"""Pairs that other people measured, with the poses they published (lidar instead of radar; sources lie beside the data)."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.special import fdtri

from calib_core.association.clustering import candidate_at
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.measurements import Candidate, Pair
from calib_core.options import CalibrationOptions, NoiseOptions, without_systematic_errors
from calib_core.paper.algorithm_1 import solve_pairs_as_printed
from calib_core.paper.pnp import refine_lm, solve_pnp_ransac
from calib_core.results import Calibration

pytestmark = pytest.mark.real


def load(folder: Path, name: str, size_px: tuple[int, int]) -> tuple[list[dict], Camera, RigidTransform]:
    document = json.loads((folder / "real_pairs" / f"{name}.json").read_text(encoding="utf-8"))
    camera = Camera("plumb_bob", *size_px, np.array(document["camera"]["K"]), np.array(document["camera"]["D"]))
    published = document["published_T_camera_from_sensor"]
    u, _, vt = np.linalg.svd(np.array(published["R"]))
    return document["pairs"], camera, RigidTransform(u @ vt, np.array(published["t"]))


def solve(rows: list[dict], camera: Camera, noise: NoiseOptions, *, exact: bool = False) -> Calibration:
    pairs = [Pair(row["id"], np.array(row["uv"]), (candidate_at(np.array(row["xyz"]), noise),)) for row in rows]
    options = CalibrationOptions(noise=noise)
    return calibrate_pairs(pairs, camera, without_systematic_errors(options) if exact else options).unwrap()


def test_forty_board_centres_give_the_published_pose_and_name_the_outlier(shared_data):
    rows, camera, published = load(shared_data, "acfr_lidar_chessboard_40", (1920, 1208))
    calibration = solve(rows, camera, NoiseOptions(1.0, 0.015, 0.3, 0.3))
    pose = calibration.camera_from_radar
    assert rotation_angle_rad(pose.rotation @ published.rotation.T) < np.deg2rad(0.5)
    assert np.linalg.norm(pose.translation_m - published.translation_m) < 0.07
    (outlier,) = (pair for pair in calibration.pairs if not pair.inlier)
    assert outlier.distance_px == max(pair.distance_px for pair in calibration.pairs)
    assert outlier.distance_px == pytest.approx(53.0, abs=5.0)
    assert outlier.outlier_probability > 0.999
    assert calibration.metrics.aed_px < 2.5


def test_forty_board_centres_solve_with_radar_noise_assumed_as_well(shared_data):
    """Told three to ten times the real noise, the estimator finds the real level and the same pose."""
    rows, camera, published = load(shared_data, "acfr_lidar_chessboard_40", (1920, 1208))
    calibration = solve(rows, camera, NoiseOptions())
    pose = calibration.camera_from_radar
    assert rotation_angle_rad(pose.rotation @ published.rotation.T) < np.deg2rad(0.6)
    assert max(calibration.noise_scale[2:]) < 0.5
    assert [pair.id for pair in calibration.pairs if not pair.inlier] == [
        max(calibration.pairs, key=lambda pair: pair.distance_px).id
    ]


def test_forty_board_centres_hold_the_published_pose_far_inside_what_is_thought_possible(shared_data):
    """Without an azimuth scale in the model the published pose was 10 times farther out than the edge of the ellipsoid."""
    rows, camera, published = load(shared_data, "acfr_lidar_chessboard_40", (1920, 1208))
    calibration = solve(rows, camera, NoiseOptions())
    error = published.error_from(calibration.camera_from_radar)
    assert error @ np.linalg.solve(calibration.covariance, error) < calibration.covariance_quantile
    assert calibration.radar_errors.azimuth_scale == pytest.approx(-0.011, abs=0.01)


def test_sixteen_hasty_clicks_are_no_more_certain_than_they_are(shared_data):
    """The published pose lies 5 deg from every fit to all clicks; with the noise of hasty clicks it is not excluded."""
    rows, camera, published = load(shared_data, "heethesh_lidar_clicks_16", (964, 724))
    hasty = NoiseOptions(6.0, 0.03, 1.15, 1.15, estimate_scale=False)
    calibration = solve(rows, camera, hasty)
    error = published.error_from(calibration.camera_from_radar)
    assert error @ np.linalg.solve(calibration.covariance, error) < calibration.covariance_quantile
    assert np.linalg.norm(error[3:]) > np.deg2rad(3.0)


def test_the_published_pose_of_the_hasty_clicks_is_a_fit_to_nine_of_them(shared_data):
    """It is no truth: RANSAC with OpenCV's default of 8 px keeps nine of these very clicks, and least squares fits those."""
    points, pixels, camera, published = arrays(shared_data)
    found = solve_pnp_ransac(points, pixels, camera)
    assert found is not None
    kept = np.linalg.norm(camera.project(published @ points) - pixels, axis=1) < 8.1
    assert kept.sum() == 9
    again = refine_lm(points[kept], pixels[kept], camera, published)
    error = again.error_from(published)
    assert np.linalg.norm(error[3:]) < np.deg2rad(0.01)
    assert np.linalg.norm(error[:3]) < 1e-4


def test_the_published_fit_differs_from_ours_by_no_more_than_two_fits_to_the_same_noise_may(shared_data):
    """With B_i the linear maps from residuals to poses, the difference has the covariance (B_1 - B_2) S (B_1 - B_2)^T."""
    rows, camera, published = load(shared_data, "heethesh_lidar_clicks_16", (964, 724))
    points, pixels, _, _ = arrays(shared_data)
    calibration = solve(rows, camera, NoiseOptions(), exact=True)
    noise = np.array([pair.expected_covariance_px2 for pair in calibration.pairs])
    jacobian = camera.pose_jacobian(calibration.camera_from_radar, points)
    kept = np.linalg.norm(camera.project(published @ points) - pixels, axis=1) < 8.1
    plain = map_to_pose(jacobian, np.eye(2)[None] * kept[:, None, None])
    believed = np.array([1.0 - pair.outlier_probability for pair in calibration.pairs])
    ours = map_to_pose(jacobian, np.linalg.inv(noise) * believed[:, None, None])
    apart = plain - ours
    covariance = np.einsum("nai,nij,nbj->ab", apart, noise, apart)
    error = published.error_from(calibration.camera_from_radar)
    of_noise = 6.0 * fdtri(6.0, calibration.metrics.degrees_of_freedom, 0.95)
    assert error @ np.linalg.solve(covariance, error) < of_noise
    sigma = np.sqrt(np.diag(np.einsum("nai,nij,nbj->ab", plain, noise, plain)))
    assert np.linalg.norm(sigma[3:]) > np.deg2rad(4.0)  # of the published pose itself


def arrays(folder: Path) -> tuple[np.ndarray, np.ndarray, Camera, RigidTransform]:
    rows, camera, published = load(folder, "heethesh_lidar_clicks_16", (964, 724))
    return np.array([row["xyz"] for row in rows]), np.array([row["uv"] for row in rows]), camera, published


def map_to_pose(jacobian: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return (n, 6, 2): what a pixel's residual does to the pose of a fit with these weights (n, 2, 2)."""
    weighted = np.swapaxes(jacobian, 1, 2) @ weight
    return np.asarray(np.linalg.solve((weighted @ jacobian).sum(axis=0), weighted))


def test_another_robust_fit_to_the_hasty_clicks_lies_inside_the_uncertainty(shared_data):
    rows, camera, _ = load(shared_data, "heethesh_lidar_clicks_16", (964, 724))
    document = json.loads((shared_data / "real_pairs" / "heethesh_lidar_clicks_16.json").read_text(encoding="utf-8"))
    u, _, vt = np.linalg.svd(np.array(document["my_robust_fit"]["R"]))
    other = RigidTransform(u @ vt, np.array(document["my_robust_fit"]["t"]))
    calibration = solve(rows, camera, NoiseOptions())
    error = other.error_from(calibration.camera_from_radar)
    assert error @ np.linalg.solve(calibration.covariance, error) < calibration.covariance_quantile


def as_printed(folder: Path, name: str, size_px: tuple[int, int]) -> tuple[Calibration, RigidTransform]:
    """Solve a set of pairs by Algorithm 1; return the result and the published pose."""
    rows, camera, published = load(folder, name, size_px)
    unknown = np.full((3, 3), np.nan)
    pairs = [
        Pair(row["id"], np.array(row["uv"]), (Candidate(np.array(row["xyz"]), unknown[0], unknown),)) for row in rows
    ]
    return solve_pairs_as_printed(pairs, camera, CalibrationOptions(method="paper")).unwrap(), published


def test_by_the_paper_forty_board_centres_give_about_the_published_pose(shared_data):
    result, published = as_printed(shared_data, "acfr_lidar_chessboard_40", (1920, 1208))
    apart_deg = np.rad2deg(rotation_angle_rad(result.camera_from_radar.rotation @ published.rotation.T))
    assert apart_deg < 1.0
    assert np.linalg.norm(result.camera_from_radar.translation_m - published.translation_m) < 0.15
    assert result.metrics.n == 40
    assert result.metrics.aed_px < 6.0


def test_ransac_marks_the_one_wrong_board_that_the_last_line_uses_all_the_same(shared_data):
    result, _ = as_printed(shared_data, "acfr_lidar_chessboard_40", (1920, 1208))
    worst = max(result.pairs, key=lambda pair: pair.distance_px)
    assert worst.distance_px > 40.0
    assert not worst.inlier


def test_sixteen_human_clicks_with_wrong_ones_among_them_are_not_solved_to_a_click(shared_data):
    result, _ = as_printed(shared_data, "heethesh_lidar_clicks_16", (964, 724))
    assert result.metrics.aed_px > 5.0
