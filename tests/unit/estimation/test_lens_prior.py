"""The prior of the lens: correlated intrinsics as independent errors along the axes of their covariance."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera, CameraCovariance
from calib_core.estimation.lens_prior import LensPrior, lens_prior, shared_out
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.estimation.systematic_errors import systematic_errors
from calib_core.options import CalibrationOptions, LensOptions, RefiningOptions
from calib_core.results import Calibration
from calib_core.synthetic import simulate_pairs
from calib_core.synthetic.simulated_pairs import study_camera

REFINING = CalibrationOptions(refining=RefiningOptions(intrinsics=True))
TIED = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 4.0]])
"""Of fx, fy and cx: no full rank."""


def prior_of(camera: Camera, options: CalibrationOptions = REFINING) -> LensPrior:
    found = lens_prior(options, camera)
    assert found is not None
    return found


def known(camera: Camera, order: tuple[str, ...], matrix: np.ndarray) -> Camera:
    return replace(camera, covariance=CameraCovariance(order, matrix))


def test_a_covariance_without_full_rank_has_fewer_axes_and_comes_back_from_them() -> None:
    prior = prior_of(known(study_camera(), ("fx_px", "fy_px", "cx_px"), TIED))
    assert prior.axes.shape == (3, 2)
    np.testing.assert_allclose(prior.axes @ prior.axes.T, TIED, atol=1e-12)
    np.testing.assert_allclose(prior.sigma, [1.0, 1.0, 2.0])
    assert prior.names == ("lens_fx_px", "lens_fy_px", "lens_cx_px")


def test_without_a_covariance_both_focal_lengths_are_refined_by_one_share() -> None:
    camera = study_camera()
    prior = prior_of(camera)
    assert prior.names == ("focal_length", "principal_right_px", "principal_down_px", "distortion")
    moved = prior.camera_at(np.linalg.solve(prior.axes, [0.02, 3.0, -4.0, 0.01]))
    np.testing.assert_allclose(moved.matrix_px[[0, 1], [0, 1]], 1.02 * camera.matrix_px[[0, 1], [0, 1]])
    np.testing.assert_allclose(moved.matrix_px[:2, 2] - camera.matrix_px[:2, 2], [3.0, -4.0])
    np.testing.assert_allclose(moved.distortion - camera.distortion, [0.01, 0.0, 0.0, 0.0])


def test_nobody_said_and_nobody_refines_means_no_prior_of_the_lens() -> None:
    assert lens_prior(CalibrationOptions(), study_camera()) is None


def test_a_pinhole_has_no_distortion_to_refine_and_keeps_its_default() -> None:
    camera = Camera("pinhole", 1920, 1080, study_camera().matrix_px)
    assert "distortion" not in prior_of(camera).names
    errors = systematic_errors(REFINING, camera, flat=False)
    assert "distortion" in {one.name for one in errors.widening}
    assert "focal_length" not in {one.name for one in errors.widening}


def test_a_focal_length_stays_positive_whatever_the_pairs_say() -> None:
    prior = prior_of(study_camera())
    moved = prior.camera_at(np.linalg.solve(prior.axes, [-5.0, 0.0, 0.0, 0.0]))
    assert (np.diag(moved.matrix_px) > 0.0).all()


def test_a_covariance_replaces_the_default_errors_of_the_lens() -> None:
    camera = known(study_camera(), ("fx_px", "fy_px", "cx_px"), TIED)
    errors = systematic_errors(CalibrationOptions(), camera, flat=False)
    by_name = {one.name: one for one in errors.widening}
    assert sum(one.of_lens for one in errors.widening) == 2
    assert not {"focal_length", "distortion"} & set(by_name)
    assert by_name["click_right_px"].sigma == CalibrationOptions().reflector.click_offset_sigma_px


def test_the_default_errors_stated_as_a_covariance_give_the_same_pose_and_covariance() -> None:
    simulated = simulate_pairs(15, rng=np.random.default_rng(5), noise="imaging")
    lens = LensOptions(distortion_sigma=0.0)
    options = CalibrationOptions(lens=lens)
    focal_px, centre_px = lens.focal_length_sigma * simulated.camera.matrix_px[0, 0], lens.principal_point_sigma_px
    matrix = np.zeros((4, 4))
    matrix[:2, :2] = focal_px**2
    matrix[2, 2] = matrix[3, 3] = centre_px**2
    stated = known(simulated.camera, ("fx_px", "fy_px", "cx_px", "cy_px"), matrix)
    one, other = (calibrate_pairs(simulated.pairs, camera, options) for camera in (simulated.camera, stated))
    assert isinstance(one, Calibration)
    assert isinstance(other, Calibration)
    np.testing.assert_allclose(other.camera_from_radar.error_from(one.camera_from_radar), np.zeros(6), atol=1e-9)
    np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("rank", [2, 4])
def test_shares_of_correlated_errors_add_up_and_none_is_negative(rank: int) -> None:
    rng = np.random.default_rng(rank)
    root, mixed = rng.normal(size=(4, rank)), rng.normal(size=(6, rank))
    covariance = root @ root.T
    shares = shared_out(mixed @ root.T, covariance)
    assert (shares >= 0.0).all()
    np.testing.assert_allclose(shares.sum(axis=1), (mixed**2).sum(axis=1))


def test_uncorrelated_errors_keep_their_own_share() -> None:
    mixed = np.arange(12.0).reshape(6, 2)
    np.testing.assert_allclose(shared_out(mixed, np.diag([4.0, 9.0])), mixed**2 / [4.0, 9.0])


def test_the_derivative_along_each_axis_is_that_of_the_projection() -> None:
    simulated = simulate_pairs(8, rng=np.random.default_rng(2), noise="imaging")
    measurements = pair_measurements(simulated.pairs, simulated.camera, REFINING)
    errors, pose = measurements.errors, simulated.camera_from_radar
    rows = np.arange(len(measurements))
    columns = measurements.measured(rows).columns(measurements.camera, pose, errors.estimated, None)
    for place in range(errors.refined.start, errors.refined.stop):
        values = np.zeros(len(errors))
        values[place] = 1e-4
        projected = []
        for sign in (1.0, -1.0):
            moved = measurements.with_errors(sign * values)
            planes = moved.measured(rows).linearize(moved.camera, pose.rotation, pose.translation_m)
            unwhitened = np.linalg.solve(planes.whitening, planes.residual[:, :, None])[:, :, 0]
            projected.append(moved.pixels_px - unwhitened)
        slope = (projected[0] - projected[1]) / 2e-4
        np.testing.assert_allclose(columns[place].T, slope, rtol=1e-4, atol=1e-4)
