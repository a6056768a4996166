"""The stated uncertainty matches the actual errors."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions, without_systematic_errors
from calib_core.results import Calibration
from calib_core.synthetic import SimulatedPairs, simulate_pairs

MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))
EXACT = without_systematic_errors(MEASURED)


def solved(simulated: SimulatedPairs, options: CalibrationOptions = MEASURED) -> Calibration:
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, options)
    assert isinstance(outcome, Calibration)
    return outcome


@pytest.mark.slow
def test_the_ellipsoid_contains_the_truth_about_as_often_as_stated() -> None:
    inside, squared = 0, []
    for seed in range(60):
        simulated = simulate_pairs(14, rng=np.random.default_rng(seed), outlier_share=0.2)
        calibration = solved(simulated)
        error = simulated.camera_from_radar.error_from(calibration.camera_from_radar)
        squared.append(float(error @ np.linalg.solve(calibration.covariance, error)))
        inside += squared[-1] < calibration.covariance_quantile
    assert 52 <= inside <= 60  # 95 % of 60 is 57; fewer than 52 happens once in 100 suites
    assert 0.75 < np.mean(squared) / 6 < 1.4


def test_pixel_covariance_is_that_of_projections_under_drawn_poses() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), noise="imaging")
    calibration = solved(simulated, EXACT)
    points = np.array([[8.0, 1.0, 0.2], [4.0, -1.0, -0.5]])
    rng = np.random.default_rng(1)
    drawn = rng.multivariate_normal(np.zeros(6), calibration.covariance, 1500)
    pixels = np.array([calibration.camera.project(calibration.camera_from_radar.perturbed(d) @ points) for d in drawn])
    for k in range(2):
        assert np.cov(pixels[:, k].T) == pytest.approx(calibration.pixel_covariance(points)[k], rel=0.25, abs=0.3)


def test_pixel_covariance_of_what_the_lens_does_not_see_is_not_a_number() -> None:
    calibration = solved(simulate_pairs(12, rng=np.random.default_rng(3)))
    assert np.isnan(calibration.pixel_covariance(np.array([[-5.0, 0.0, 0.0]]))).all()


def test_a_measured_camera_position_shrinks_rotation_and_position_uncertainty() -> None:
    simulated = simulate_pairs(15, rng=np.random.default_rng(4))
    measured, free = (np.diag(solved(simulated, options).covariance) for options in (MEASURED, CalibrationOptions()))
    assert measured[:3].sum() < 0.2 * free[:3].sum()
    assert measured[3:].sum() < 0.8 * free[3:].sum()


def test_leave_one_out_by_one_step_agrees_with_solving_without_the_pair() -> None:
    simulated = simulate_pairs(16, rng=np.random.default_rng(5), noise="imaging")
    fixed = replace(EXACT, noise=replace(MEASURED.noise, estimate_scale=False))
    whole = solved(simulated, fixed)
    moved = []
    for name in ("p3", "p9"):
        without = calibrate_pairs(simulated.pairs, simulated.camera, fixed, frozenset({name}))
        assert isinstance(without, Calibration)
        error = without.camera_from_radar.error_from(whole.camera_from_radar)
        influence = float(np.sqrt(error @ np.linalg.solve(whole.covariance, error)))
        stated = next(pair.influence for pair in whole.pairs if pair.id == name)
        moved.append((stated, influence))
    for stated, influence in moved:
        assert stated == pytest.approx(influence, rel=0.15, abs=0.02)


def test_a_known_noise_level_takes_the_chi_square_quantile() -> None:
    simulated = simulate_pairs(12, rng=np.random.default_rng(6))
    fixed = replace(MEASURED, noise=replace(MEASURED.noise, estimate_scale=False))
    assert solved(simulated, fixed).covariance_quantile == pytest.approx(12.5916, abs=1e-3)
    assert solved(simulated).covariance_quantile > 12.6
