"""The final fit is a maximum-likelihood one: SciPy finds the same optimum, and it is not biased towards the camera."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from calib_core.estimation.errors_in_variables import fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions, without_systematic_errors
from calib_core.radar import cartesian_from_polar
from calib_core.synthetic import FIELD, simulate_pairs

MEASURED = without_systematic_errors(
    CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))
)


def test_scipy_finds_the_same_optimum_over_pose_and_true_positions() -> None:
    simulated = simulate_pairs(10, rng=np.random.default_rng(1))
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    truth = simulated.camera_from_radar
    refined = fit_errors_in_variables(measurements, GncSolution(truth, 0.0, 1.0), estimate_scale=False)

    def residuals(x: np.ndarray) -> np.ndarray:
        pose = truth.perturbed(x[:6])
        polar = measurements.polar + x[6:].reshape(-1, 3) * measurements.sigma_polar
        click = (
            measurements.camera.project(pose @ cartesian_from_polar(polar)) - measurements.pixels_px
        ) / measurements.sigma_px[:, None]
        weight = np.sqrt(refined.weights)[:, None]
        prior = measurements.prior.rows(pose)[0]
        return np.concatenate([(weight * click).ravel(), (weight * x[6:].reshape(-1, 3)).ravel(), prior])

    joint = least_squares(residuals, np.zeros(6 + 30), x_scale="jac", xtol=1e-13, ftol=1e-13, gtol=1e-13)
    apart = truth.perturbed(joint.x[:6]).error_from(refined.camera_from_radar)
    # eliminating the true positions and fitting them are the same, except for the curvature of the lens model
    assert np.linalg.norm(apart[3:]) < 2e-4
    assert np.linalg.norm(apart[:3]) < 2e-4


def test_the_camera_is_not_pulled_backwards_by_many_noisy_pairs() -> None:
    """PnP on noisy points is biased by centimetres however many pairs there are; errors in variables is not."""
    crowded = replace(FIELD, separation_m=0.0)
    backwards_m = []
    for seed in range(4):
        simulated = simulate_pairs(300, rng=np.random.default_rng(seed), noise="ti_aisle", layout=crowded)
        measurements = pair_measurements(
            simulated.pairs, simulated.camera, without_systematic_errors(CalibrationOptions())
        )
        refined = fit_errors_in_variables(
            measurements, GncSolution(simulated.camera_from_radar, 0.0, 1.0), estimate_scale=False
        )
        centre = refined.camera_from_radar.inverse().translation_m
        backwards_m.append(simulated.rig.camera_position_radar_m[0] - centre[0])
    assert abs(np.mean(backwards_m)) < 0.02


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_the_noise_level_is_found_from_either_side(factor: float) -> None:
    simulated = simulate_pairs(60, rng=np.random.default_rng(2))
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    assumed = measurements.scaled([1.0, factor, factor, factor])
    refined = fit_errors_in_variables(assumed, GncSolution(simulated.camera_from_radar, 0.0, 1.0), estimate_scale=True)
    assert refined.noise_scale[2] == pytest.approx(1.0 / factor, rel=0.3)
    assert refined.noise_scale[3] == pytest.approx(1.0 / factor, rel=0.3)


def test_with_the_scale_fixed_the_noise_stays_as_assumed() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(3))
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    refined = fit_errors_in_variables(
        measurements, GncSolution(simulated.camera_from_radar, 0.0, 1.0), estimate_scale=False
    )
    assert refined.noise_scale.tolist() == [1.0] * 4
    assert refined.degrees_of_freedom == 0.0


def test_outliers_get_no_weight_and_inliers_nearly_all() -> None:
    simulated = simulate_pairs(30, rng=np.random.default_rng(4), noise="imaging", outlier_share=0.3)
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    refined = fit_errors_in_variables(
        measurements, GncSolution(simulated.camera_from_radar, 0.0, 1.0), estimate_scale=True
    )
    assert refined.weights[~simulated.outlier].min() > 0.8
    assert np.median(refined.weights[simulated.outlier]) < 1e-3
