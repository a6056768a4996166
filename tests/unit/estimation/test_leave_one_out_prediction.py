"""The leave-one-out prediction by one step agrees with a fit without the pair."""

import numpy as np
import pytest
from scipy.stats import chi2, f

from calib_core.estimation.errors_in_variables import fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, associate
from calib_core.estimation.leave_one_out_prediction import noise_parts, predict_left_out, shrunk_scales, tail_chance
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.options import CalibrationOptions
from calib_core.synthetic import simulate_pairs


@pytest.mark.parametrize("estimate_scale", [False, True])
def test_one_step_predicts_what_a_fit_without_the_pair_predicts(estimate_scale: bool) -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), noise="imaging")
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    start = GncSolution(simulated.camera_from_radar, 0.0, 1.0)
    fit = fit_errors_in_variables(measurements, start, estimate_scale=estimate_scale)
    parts = noise_parts(fit.measurements, fit.model, fit.measurements.sigma_polar[fit.rows])
    scale = fit.noise_scale if estimate_scale else None
    one_step = predict_left_out(fit.measurements, fit.camera_from_radar, fit.model, fit.weights, parts, scale)
    for pair in range(0, 20, 4):
        alone = fit_errors_in_variables(
            measurements.some(np.delete(np.arange(20), pair)), start, estimate_scale=estimate_scale
        )
        own = measurements.some(np.array([pair])).scaled(alone.noise_scale)
        model = associate(own.with_errors(alone.measurements.errors.values), alone.camera_from_radar)[1]
        missed = np.linalg.solve(model.whitening[0], model.residual[0])
        predicted = np.linalg.solve(fit.model.whitening[pair], one_step.residual[pair])
        assert np.linalg.norm(predicted - missed) < 0.15 * np.linalg.norm(missed) + 0.5  # pixels


def test_the_noise_components_of_each_pair_add_up_to_its_whitened_covariance() -> None:
    simulated = simulate_pairs(12, rng=np.random.default_rng(4))
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    fit = fit_errors_in_variables(measurements, GncSolution(simulated.camera_from_radar, 0.0, 1.0), estimate_scale=True)
    columns = noise_parts(fit.measurements, fit.model, fit.measurements.sigma_polar[fit.rows]).columns
    np.testing.assert_allclose(columns @ np.swapaxes(columns, 1, 2), np.tile(np.eye(2), (12, 1, 1)), atol=1e-9)


def test_tail_probabilities_are_those_of_chi_square_and_of_f() -> None:
    squared = np.array([0.5, 9.0, 20.0])
    np.testing.assert_allclose(tail_chance(squared, np.full(3, np.inf)), chi2.sf(squared, 2), rtol=1e-6)
    np.testing.assert_allclose(tail_chance(squared, np.full(3, 30.0)), f.sf(squared / 2, 2, 30), rtol=1e-9)


def test_without_data_every_scale_is_the_assumed_one() -> None:
    assert shrunk_scales(np.zeros((3, 4)), np.zeros((3, 4))).tolist() == [[1.0] * 4] * 3
