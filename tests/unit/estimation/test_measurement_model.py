"""The arrays of the measurement model, and the linear model shared by every stage."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from benchmarks.simulated_pairs import FIELD, SimulatedPairs, simulate_pairs
from calib_core.calibration import calibrate_pairs, preview_pairs
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution
from calib_core.estimation.measurement_model import (
    CameraPrior,
    Linearization,
    PairMeasurements,
    linearize,
    pair_measurements,
    prior_rows,
)
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions, without_systematic_errors
from calib_core.radar import cartesian_from_polar
from calib_core.results import Calibration
from calib_core.synthetic.rig import RigOptions


def simulated(decoys: int = 0) -> tuple[SimulatedPairs, PairMeasurements]:
    pairs = simulate_pairs(9, rng=np.random.default_rng(1), decoys=decoys)
    return pairs, pair_measurements(pairs.pairs, pairs.camera, CalibrationOptions())


def linearized(measurements: PairMeasurements, pose: RigidTransform, **drawn: np.ndarray) -> Linearization:
    """Linearize at a pose, with drawn clicks or radar positions instead of the measured ones."""
    measured = {name: getattr(measurements, name) for name in ("pixels_px", "sigma_px", "polar", "sigma_polar")}
    return linearize(pose, measurements.camera, **measured | drawn)


def test_the_pose_jacobian_is_the_derivative_of_the_projection():
    pairs, measurements = simulated()
    pose = pairs.camera_from_radar
    model = linearized(measurements, pose)
    points = cartesian_from_polar(measurements.polar)
    for k, step in enumerate(1e-6 * np.eye(6)):
        ahead, behind = (measurements.camera.project(pose.perturbed(sign * step) @ points) for sign in (1, -1))
        slope = (ahead - behind) / 2e-6
        whitened = (model.whitening @ slope[:, :, None])[:, :, 0]
        assert model.pose_jacobian[:, :, k] == pytest.approx(whitened, rel=1e-4, abs=1e-3)


def test_the_rows_of_systematic_errors_pull_each_back_to_none():
    pairs, measurements = simulated()
    errors = replace(measurements.errors, values=np.arange(1.0, 1.0 + len(measurements.errors)))
    residual, rows = prior_rows(replace(measurements, errors=errors), pairs.camera_from_radar)
    pulled = slice(len(residual) - len(errors), None)
    assert len(errors)
    assert rows[pulled, 6:] @ errors.values == pytest.approx(-residual[pulled])


def test_whitening_undoes_the_covariance_of_click_and_radar_noise():
    """S = C + J V J^T, sampled."""
    pairs, measurements = simulated()
    rng = np.random.default_rng(2)
    true_polar = measurements.polar
    pose = pairs.camera_from_radar
    pixels = measurements.camera.project(pose @ cartesian_from_polar(true_polar))
    residuals = []
    for _ in range(2000):
        clicked = pixels + measurements.sigma_px[:, None] * rng.standard_normal(pixels.shape)
        polar = true_polar + measurements.sigma_polar * rng.standard_normal(true_polar.shape)
        residuals.append(linearized(measurements, pose, pixels_px=clicked, polar=polar).residual)
    stacked = np.array(residuals)
    covariance = np.einsum("kni,knj->nij", stacked, stacked) / len(stacked)
    assert covariance == pytest.approx(np.tile(np.eye(2), (len(measurements), 1, 1)), abs=0.12)


def test_a_position_behind_the_camera_has_no_influence():
    pairs, measurements = simulated()
    backwards = RigidTransform(rotation_exp(np.array([0.0, np.pi, 0.0])), np.zeros(3)) @ pairs.camera_from_radar
    model = linearized(measurements, backwards)
    assert (model.squared > 1e10).all()
    assert not model.pose_jacobian.any()


def test_the_prior_rows_are_the_derivative_of_the_camera_centre():
    pairs, _ = simulated()
    pose = pairs.camera_from_radar
    prior = CameraPrior(pose.inverse().translation_m, 0.01, measured=True)  # where its weight does not change
    residual, jacobian = prior.rows(pose)
    for k, step in enumerate(1e-6 * np.eye(6)):
        slope = (prior.rows(pose.perturbed(step))[0] - residual) / 1e-6
        assert -slope == pytest.approx(jacobian[:, k], abs=1e-3)


@pytest.mark.parametrize("measured", [True, False])
@pytest.mark.parametrize("height_sigma_m", [0.0, 0.5])
def test_a_step_by_the_priors_rows_goes_down_its_cost(measured, height_sigma_m):
    """Of a measured position, the gradient of the cost is twice that of the rows: the weight follows from the distance."""
    pose = simulated()[0].camera_from_radar
    away_m = np.array([0.04, -0.02, 0.03])
    prior = CameraPrior(pose.inverse().translation_m + away_m, 0.03, measured, height_sigma_m)
    residual, jacobian = prior.rows(pose)
    gradient = np.zeros(6)
    for k, step in enumerate(1e-6 * np.eye(6)):
        ends = (pose.perturbed(step), pose.perturbed(-step))
        up, down = (float(prior.costs(one.rotation, one.translation_m)) for one in ends)
        gradient[k] = (up - down) / 2e-6
    pull = -2.0 * jacobian.T @ residual
    assert float(gradient @ pull) > 0.0
    if measured and not height_sigma_m:
        assert gradient == pytest.approx(pull, rel=1e-4)


def test_a_weak_camera_prior_has_less_weight_the_farther_it_is_off():
    prior = CameraPrior(np.zeros(3), 1.0, measured=False)
    pulls = []
    for distance_m in (1.0, 10.0):
        residual, jacobian = prior.rows(RigidTransform(np.eye(3), np.array([0.0, 0.0, distance_m])))
        pulls.append(float(np.linalg.norm(jacobian.T @ residual)))
    assert pulls[1] < 0.25 * pulls[0]


def test_a_radar_that_always_reports_elevation_zero_has_a_small_sigma_and_an_unknown_height():
    pairs, _ = simulated()
    flat = [
        type(pair)(
            pair.id,
            pair.pixel_px,
            tuple(
                type(one)(one.position_radar_m * [1, 1, 0], one.sigma_polar, one.covariance_m2)
                for one in pair.candidates
            ),
        )
        for pair in pairs.pairs
    ]
    measurements = pair_measurements(flat, pairs.camera, CalibrationOptions())
    assert measurements.flat
    assert (measurements.sigma_polar[:, 2] == np.deg2rad(0.5)).all()
    assert "squared_height_m2" in {one.name for one in measurements.errors.estimated}


def test_some_pairs_keep_their_candidates():
    _, measurements = simulated(decoys=3)
    few = measurements.some(np.array([2, 5]))
    assert few.first.tolist() == [0, 4, 8]
    assert few.polar[4:].tolist() == measurements.polar[20:24].tolist()
    assert few.owner.tolist() == [0, 0, 0, 0, 1, 1, 1, 1]


LEVEL = RigOptions(radar_tilt_deg=0.0)
FREE = CalibrationOptions()
MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior(LEVEL.camera_offset_m, 0.01)))


def flattened(pair: Pair) -> Pair:
    """Reduce a pair to range and azimuth, as reported by a radar without elevation."""
    (candidate,) = pair.candidates
    x, y, _ = candidate.position_radar_m
    range_m, azimuth_rad = np.linalg.norm(candidate.position_radar_m), np.arctan2(y, x)
    flat = range_m * np.array([np.cos(azimuth_rad), np.sin(azimuth_rad), 0.0])
    return replace(pair, candidates=(replace(candidate, position_radar_m=flat),))


def solved(seed: int, height_m: float, options: CalibrationOptions) -> tuple[Calibration, RigidTransform]:
    layout = replace(FIELD, height_m=height_m)
    simulated = simulate_pairs(20, rng=np.random.default_rng([9, seed]), layout=layout, rig_options=LEVEL)
    outcome = calibrate_pairs([flattened(pair) for pair in simulated.pairs], simulated.camera, options).unwrap()
    return outcome, simulated.camera_from_radar


@pytest.mark.slow
@pytest.mark.parametrize("options", [FREE, MEASURED])
@pytest.mark.parametrize("height_m", [0.025, 1.2])
def test_the_truth_lies_inside_whether_the_reflector_stood_on_the_ground_or_at_the_radars_height(height_m, options):
    inside = 0
    for seed in range(10):
        calibration, truth = solved(seed, height_m, options)
        error = truth.error_from(calibration.camera_from_radar)
        inside += bool(error @ np.linalg.solve(calibration.covariance, error) < calibration.covariance_quantile)
    assert inside >= 8


@pytest.mark.parametrize("reported_z_m", [0.5, 1e-5])
def test_a_radar_that_reports_one_height_or_rounded_zeros_is_flat_too(reported_z_m):
    """Drivers add the mounting height, or convert zeros back and forth: judged as elevations, both are wrong by metres."""
    rng, inside = np.random.default_rng(4), 0
    for seed in range(6):
        simulated = simulate_pairs(15, rng=np.random.default_rng([11, seed]), rig_options=LEVEL)
        pairs = []
        for pair in map(flattened, simulated.pairs):
            (candidate,) = pair.candidates
            z_m = reported_z_m if reported_z_m > 0.1 else reported_z_m * rng.standard_normal()
            raised = candidate.position_radar_m + np.array([0.0, 0.0, z_m])
            pairs.append(replace(pair, candidates=(replace(candidate, position_radar_m=raised),)))
        outcome = calibrate_pairs(pairs, simulated.camera, FREE).unwrap()
        error = simulated.camera_from_radar.error_from(outcome.camera_from_radar)
        inside += bool(error @ np.linalg.solve(outcome.covariance, error) < outcome.covariance_quantile)
        assert "flat-radar" in {one.code for one in outcome.warnings}
    assert inside == 6


def test_the_warning_parts_what_the_pairs_determine_from_what_is_assumed():
    calibration, _ = solved(1, 1.2, FREE)
    (warning,) = (one for one in calibration.warnings if one.code == "flat-radar")
    assert 0.0 < warning.facts["yaw_deg"] < 1.0
    assert 1.0 <= warning.facts["pitch_deg"] < 20.0
    assert warning.facts["up_cm"] > warning.facts["left_cm"]


def test_the_covariance_of_a_radar_with_elevation_is_not_widened():
    simulated = simulate_pairs(20, rng=np.random.default_rng(2))
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, MEASURED).unwrap()
    assert np.sqrt(outcome.covariance[3:, 3:].trace()) < np.deg2rad(1.5)


def test_the_first_preview_of_a_radar_without_elevation_says_so():
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), rig_options=LEVEL)
    preview = preview_pairs([flattened(pair) for pair in simulated.pairs], simulated.camera)
    assert isinstance(preview, Calibration)
    assert preview.checking
    assert not preview.sees_elevation
    assert np.trace(preview.firm_covariance) < np.trace(preview.covariance)


# The final fit is a maximum-likelihood one: SciPy finds the same optimum, and it is not biased towards the camera.


TAPED = without_systematic_errors(
    CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))
)


def fitted(
    simulated: SimulatedPairs,
    options: CalibrationOptions = TAPED,
    *,
    estimate_scale: bool,
    noise_factor: float = 1.0,
) -> ErrorsInVariablesFit:
    """Fit from the true pose, assuming so many times the noise of the radar."""
    measurements = pair_measurements(simulated.pairs, simulated.camera, options).scaled([1.0, *[noise_factor] * 3])
    start = GncSolution(simulated.camera_from_radar, 0.0, 1.0)
    return fit_errors_in_variables(measurements, start, estimate_scale=estimate_scale)


def test_scipy_finds_the_same_optimum_over_pose_and_true_positions():
    simulated = simulate_pairs(10, rng=np.random.default_rng(1))
    measurements = pair_measurements(simulated.pairs, simulated.camera, TAPED)
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


@pytest.mark.slow
def test_the_camera_is_not_pulled_backwards_by_many_noisy_pairs():
    """PnP on noisy points is biased by centimetres however many pairs there are; errors in variables is not."""
    crowded = replace(FIELD, separation_m=0.0)
    backwards_m = []
    for seed in range(4):
        simulated = simulate_pairs(300, rng=np.random.default_rng(seed), noise="ti_aisle", layout=crowded)
        refined = fitted(simulated, without_systematic_errors(CalibrationOptions()), estimate_scale=False)
        centre = refined.camera_from_radar.inverse().translation_m
        backwards_m.append(simulated.rig.camera_position_radar_m[0] - centre[0])
    assert abs(np.mean(backwards_m)) < 0.02


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_the_noise_level_is_found_from_either_side(factor):
    simulated = simulate_pairs(60, rng=np.random.default_rng(2))
    refined = fitted(simulated, estimate_scale=True, noise_factor=factor)
    assert refined.noise_scale[2] == pytest.approx(1.0 / factor, rel=0.3)
    assert refined.noise_scale[3] == pytest.approx(1.0 / factor, rel=0.3)


def test_with_the_scale_fixed_the_noise_stays_as_assumed():
    simulated = simulate_pairs(20, rng=np.random.default_rng(3))
    refined = fitted(simulated, estimate_scale=False)
    assert refined.noise_scale.tolist() == [1.0] * 4
    assert refined.degrees_of_freedom == 0.0


def test_outliers_get_no_weight_and_inliers_nearly_all():
    simulated = simulate_pairs(30, rng=np.random.default_rng(4), noise="imaging", outlier_share=0.3)
    refined = fitted(simulated, estimate_scale=True)
    assert refined.weights[~simulated.outlier].min() > 0.8
    assert np.median(refined.weights[simulated.outlier]) < 1e-3
