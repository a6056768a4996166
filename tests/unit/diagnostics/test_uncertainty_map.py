"""The uncertainty in the image as a map, against poses drawn from the covariance."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.diagnostics.uncertainty_map import pixel_quantile, uncertainty_map
from calib_core.results import Calibration

_CHI2_95_2D, _CHI2_95_6D = 5.991464547107979, 12.591587243743977


@pytest.fixture(scope="module")
def solved() -> Calibration:
    drawn = simulate_pairs(20, rng=np.random.default_rng(7))
    return calibrate_pairs(drawn.pairs, drawn.camera).unwrap()


@pytest.mark.parametrize("distance_m", [5.0, 20.0, 60.0])
def test_the_map_holds_95_percent_of_drawn_poses_along_its_longest_axis(solved, distance_m):
    known_noise = replace(solved, covariance_quantile=_CHI2_95_6D)
    found = uncertainty_map(known_noise, distance_m, columns=5)
    rng = np.random.default_rng(3)
    errors = rng.multivariate_normal(np.zeros(6), solved.covariance, size=1500)
    grid_px = np.stack(np.meshgrid(found.columns_px, found.rows_px), axis=-1).reshape(-1, 2)
    points_radar_m = solved.camera_from_radar.inverse() @ (solved.camera.rays(grid_px) * distance_m)
    moved_px = np.array(
        [solved.camera.project(solved.camera_from_radar.perturbed(error) @ points_radar_m) for error in errors]
    )
    centred = moved_px - moved_px.mean(axis=0)
    for i, semi_major_px in enumerate(found.semi_major_px.ravel().tolist()):
        covariance_px2 = np.cov(centred[:, i].T)
        longest_px = np.sqrt(_CHI2_95_2D * np.linalg.eigvalsh(covariance_px2)[-1])
        assert semi_major_px == pytest.approx(longest_px, rel=0.08)
        assert (np.linalg.norm(moved_px[:, i] - grid_px[i], axis=1) <= semi_major_px).mean() >= 0.93


def test_few_pairs_widen_the_map_as_student_s_distribution_does():
    from scipy.special import fdtri

    assert pixel_quantile(_CHI2_95_6D) == _CHI2_95_2D
    assert pixel_quantile(9.0) == _CHI2_95_2D  # never below what known noise gives
    assert pixel_quantile(float("nan")) == _CHI2_95_2D
    for degrees in (3.0, 10.0, 50.0):
        assert pixel_quantile(6.0 * fdtri(6.0, degrees, 0.95)) == pytest.approx(
            2.0 * fdtri(2.0, degrees, 0.95), rel=1e-6
        )


def test_where_the_lens_has_no_ray_the_map_is_empty(solved):
    matrix = np.array([[300.0, 0, 320], [0, 300, 240], [0, 0, 1]])
    folding = Camera("plumb_bob", 640, 480, matrix, np.array([-0.45, 0.0, 0.0, 0.0]))
    found = uncertainty_map(replace(solved, camera=folding), 20.0)

    assert np.isnan(found.semi_major_px[0, 0])
    assert np.isnan(found.semi_major_px[-1, -1])
    assert np.isfinite(found.semi_major_px[len(found.rows_px) // 2, len(found.columns_px) // 2])


def test_a_method_without_noise_model_has_no_map(solved):
    unknown = replace(solved, covariance=np.full((6, 6), np.nan))

    assert np.isnan(uncertainty_map(unknown, 20.0).semi_major_px).all()


def test_a_radar_without_elevation_is_mapped_by_what_its_pairs_determine():
    from benchmarks.simulated_pairs import SystematicErrors

    drawn = simulate_pairs(20, rng=np.random.default_rng(5), systematic=SystematicErrors(measures_elevation=False))
    flat = calibrate_pairs(drawn.pairs, drawn.camera).unwrap()
    assert not flat.sees_elevation
    firm = uncertainty_map(flat, 20.0).semi_major_px
    whole = uncertainty_map(replace(flat, warnings=()), 20.0).semi_major_px

    assert np.nanmedian(firm) < 0.5 * np.nanmedian(whole)
