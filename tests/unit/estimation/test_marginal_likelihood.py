"""The marginal likelihood: Laplace's method against the integral itself, and which reading of the same clicks it prefers."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.estimation.best_fit import BestFit, best_fit
from calib_core.estimation.gnc import normal_equations
from calib_core.estimation.marginal_likelihood import log_marginal_likelihood, log_pose_prior
from calib_core.estimation.measurement_model import PairMeasurements, pair_measurements
from calib_core.estimation.pose_posterior import pose_posterior
from calib_core.geometry import Poses
from calib_core.options import CalibrationOptions, NoiseOptions, RadarOptions

ALONE = CalibrationOptions(
    radar=RadarOptions(azimuth_scale_sigma=0.0, elevation_scale_sigma=0.0, range_bias_sigma_m=0.0),
    noise=NoiseOptions(estimate_scale=False),
)
"""Nothing is unknown but the pose."""


def fitted(seed: int, options: CalibrationOptions = ALONE) -> tuple[PairMeasurements, BestFit]:
    simulated = simulate_pairs(14, rng=np.random.default_rng([88, seed]), noise="imaging", outlier_share=0.15)
    measurements = pair_measurements(simulated.pairs, simulated.camera, options)
    fit = best_fit(measurements, options)
    assert isinstance(fit, BestFit)
    return measurements, fit


@pytest.mark.parametrize("seed", range(3))
def test_it_is_the_integral_over_the_pose(seed):
    """Importance samples from the parabola about the fit give the same to a fifth in the logarithm."""
    measurements, best = fitted(seed)
    fit = best.refined
    hessian, _ = normal_equations(fit.measurements, fit.camera_from_radar, fit.model, fit.weights)
    root = np.linalg.cholesky(np.linalg.inv(hessian))
    drawn = np.random.default_rng(seed).standard_normal((4000, 6))
    poses = Poses.of([fit.camera_from_radar] * len(drawn)).perturbed(drawn @ root.T)
    costs = pose_posterior(measurements, fit.camera_from_radar).pose_costs(poses, np.zeros((len(drawn), 4)))
    log_weights = 0.5 * (drawn**2).sum(axis=1) - 0.5 * costs
    average = np.logaddexp.reduce(log_weights) - np.log(len(drawn))
    integral = log_pose_prior(measurements.prior) + average + np.linalg.slogdet(root)[1]
    assert log_marginal_likelihood(measurements, fit) == pytest.approx(integral, abs=0.2)


def test_clicks_that_belong_to_other_returns_have_less():
    measurements, best = fitted(0)
    exchanged = replace(measurements, pixels_px=measurements.pixels_px[::-1], rays=measurements.rays[::-1])
    other = best_fit(exchanged, ALONE)
    apart = log_marginal_likelihood(measurements, best.refined) - (
        log_marginal_likelihood(exchanged, other.refined) if isinstance(other, BestFit) else 0.0
    )
    assert apart > 30.0


def test_a_pair_more_that_is_wrong_costs_little_and_one_that_is_right_adds():
    simulated = simulate_pairs(14, rng=np.random.default_rng(90), noise="imaging")
    wrong = replace(simulated.pairs[0], id="wrong", pixel_px=np.array([1800.0, 100.0]))
    few, right, with_wrong = (
        pair_measurements(pairs, simulated.camera, ALONE)
        for pairs in (simulated.pairs[:-1], simulated.pairs, (*simulated.pairs[:-1], wrong))
    )
    base, more, worse = (log_marginal_likelihood(one, best_fit(one, ALONE).refined) for one in (few, right, with_wrong))
    assert more > base + 3.0
    assert base - 5.0 < worse < base
