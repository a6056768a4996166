"""The arrays of the measurement model, and the linear model shared by every stage."""

import numpy as np
import pytest

from calib_core.estimation.linearization import linearize
from calib_core.estimation.measurement_model import CameraPrior, PairMeasurements, pair_measurements
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.options import CalibrationOptions
from calib_core.radar import cartesian_from_polar
from calib_core.synthetic import SimulatedPairs, simulate_pairs


def simulated(decoys: int = 0) -> tuple[SimulatedPairs, PairMeasurements]:
    pairs = simulate_pairs(9, rng=np.random.default_rng(1), decoys=decoys)
    return pairs, pair_measurements(pairs.pairs, pairs.camera, CalibrationOptions())


def test_the_pose_jacobian_is_the_derivative_of_the_projection() -> None:
    pairs, measurements = simulated()
    pose = pairs.camera_from_radar
    model = linearize(
        pose,
        measurements.camera,
        pixels_px=measurements.pixels_px,
        sigma_px=measurements.sigma_px,
        polar=measurements.polar,
        sigma_polar=measurements.sigma_polar,
    )
    points = cartesian_from_polar(measurements.polar)
    for k in range(6):
        step = np.zeros(6)
        step[k] = 1e-6
        ahead, behind = (measurements.camera.project(pose.perturbed(sign * step) @ points) for sign in (1, -1))
        slope = (ahead - behind) / 2e-6
        whitened = (model.whitening @ slope[:, :, None])[:, :, 0]
        assert model.pose_jacobian[:, :, k] == pytest.approx(whitened, rel=1e-4, abs=1e-3)


def test_whitening_undoes_the_covariance_of_click_and_radar_noise() -> None:
    """S = C + J V J^T, sampled."""
    pairs, measurements = simulated()
    rng = np.random.default_rng(2)
    true_polar = measurements.polar
    pose = pairs.camera_from_radar
    pixels = measurements.camera.project(pose @ cartesian_from_polar(true_polar))
    residuals = []
    for _ in range(2000):
        model = linearize(
            pose,
            measurements.camera,
            pixels_px=pixels + measurements.sigma_px[:, None] * rng.standard_normal(pixels.shape),
            sigma_px=measurements.sigma_px,
            polar=true_polar + measurements.sigma_polar * rng.standard_normal(true_polar.shape),
            sigma_polar=measurements.sigma_polar,
        )
        residuals.append(model.residual)
    stacked = np.array(residuals)
    covariance = np.einsum("kni,knj->nij", stacked, stacked) / len(stacked)
    assert covariance == pytest.approx(np.tile(np.eye(2), (len(measurements), 1, 1)), abs=0.12)


def test_a_position_behind_the_camera_has_no_influence() -> None:
    pairs, measurements = simulated()
    backwards = RigidTransform(rotation_exp(np.array([0.0, np.pi, 0.0])), np.zeros(3)) @ pairs.camera_from_radar
    model = linearize(
        backwards,
        measurements.camera,
        pixels_px=measurements.pixels_px,
        sigma_px=measurements.sigma_px,
        polar=measurements.polar,
        sigma_polar=measurements.sigma_polar,
    )
    assert (model.squared > 1e10).all()
    assert not model.pose_jacobian.any()


def test_the_prior_rows_are_the_derivative_of_the_camera_centre() -> None:
    pairs, _ = simulated()
    prior = CameraPrior(np.array([0.1, -0.2, 0.3]), 0.01, measured=True)
    residual, jacobian = prior.rows(pairs.camera_from_radar)
    for k in range(6):
        step = np.zeros(6)
        step[k] = 1e-6
        slope = (prior.rows(pairs.camera_from_radar.perturbed(step))[0] - residual) / 1e-6
        assert -slope == pytest.approx(jacobian[:, k], abs=1e-3)


def test_a_weak_camera_prior_has_less_weight_the_farther_it_is_off() -> None:
    prior = CameraPrior(np.zeros(3), 1.0, measured=False)
    pulls = []
    for distance_m in (1.0, 10.0):
        residual, jacobian = prior.rows(RigidTransform(np.eye(3), np.array([0.0, 0.0, distance_m])))
        pulls.append(float(np.linalg.norm(jacobian.T @ residual)))
    assert pulls[1] < 0.25 * pulls[0]


def test_a_radar_that_always_reports_elevation_zero_has_a_small_sigma_and_an_unknown_height() -> None:
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


def test_some_pairs_keep_their_candidates() -> None:
    _, measurements = simulated(decoys=3)
    few = measurements.some(np.array([2, 5]))
    assert few.first.tolist() == [0, 4, 8]
    assert few.polar[4:].tolist() == measurements.polar[20:24].tolist()
    assert few.owner.tolist() == [0, 0, 0, 0, 1, 1, 1, 1]
