"""Errors that all pairs share: their derivatives, their priors, and that the stated uncertainty covers the truth with them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import FIELD, SimulatedPairs, SystematicErrors, simulate_pairs, study_camera
from calib_core.arrays import Points3
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera, CameraCovariance
from calib_core.estimation.covariance import pose_covariance
from calib_core.estimation.errors_in_variables import fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution
from calib_core.estimation.measurement_model import MeasurementPlanes, PairMeasurements, pair_measurements
from calib_core.measurements import DataWarning, Pair
from calib_core.options import (
    CalibrationOptions,
    CameraPositionPrior,
    LensOptions,
    RadarOptions,
    RefiningOptions,
    SolvingOptions,
    without_systematic_errors,
)
from calib_core.radar import RadarErrors, cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration
from calib_core.results.actions import MeasureCameraPosition, SpreadPlacements
from calib_core.results.systematic_errors import (
    LensPrior,
    SystematicError,
    SystematicErrorResult,
    dominant_errors,
    is_determined,
    lens_prior,
    shared_out,
    systematic_errors,
)
from calib_core.synthetic.rig import RigOptions
from calib_core.words.systematic_errors import ERRORS, dominant_sentence, error_words, remedy_of

FREE = CalibrationOptions()
MEASURED = CalibrationOptions(
    solving=SolvingOptions(camera_position=CameraPositionPrior(RigOptions().camera_offset_m, 0.01))
)

KNOWN_ELEVATION = replace(MEASURED, radar=RadarOptions(elevation_scale_sigma=0.0))


def drawn(seed: int, noise: str = "imaging", count: int = 20) -> SimulatedPairs:
    return simulate_pairs(count, rng=np.random.default_rng([9, seed]), noise=noise)


def positions(simulated: SimulatedPairs) -> Points3:
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def with_positions(simulated: SimulatedPairs, points: Points3) -> tuple[Pair, ...]:
    return tuple(
        replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=point),))
        for pair, point in zip(simulated.pairs, points, strict=True)
    )


def scaled(simulated: SimulatedPairs, scale: float) -> tuple[Pair, ...]:
    polar = polar_from_cartesian(positions(simulated)) * np.array([1.0, scale, 1.0])
    return with_positions(simulated, cartesian_from_polar(polar))


def warning(pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions, code: str) -> DataWarning | None:
    outcome = calibrate_pairs(pairs, camera, options).unwrap()
    return next((one for one in outcome.warnings if one.code == code), None)


@pytest.mark.parametrize("options", [FREE, MEASURED])
@pytest.mark.parametrize("scale", [0.04, -0.04])
@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(1, 3), marks=pytest.mark.slow)], ids=["one", "more"])
def test_a_scale_is_named_with_its_amount_and_its_sign(scale, options, seeds):
    for seed in seeds:
        simulated = drawn(seed, count=30)
        found = warning(scaled(simulated, 1.0 + scale), simulated.camera, options, "angle-scale")
        assert found is not None
        assert (found.facts["error"], found.facts["measured"]) == ("azimuth_scale", options is MEASURED)
        assert found.facts["value"] == pytest.approx(scale, abs=3.5 * found.facts["sigma"] + 0.001)


def test_a_wrong_focal_length_looks_like_a_scale_of_the_azimuths():
    for seed in range(3):
        simulated = drawn(seed, count=30)
        matrix_px = simulated.camera.matrix_px * np.array([[1.03, 1, 1], [1, 1.03, 1], [1, 1, 1]])
        found = warning(simulated.pairs, replace(simulated.camera, matrix_px=matrix_px), MEASURED, "angle-scale")
        assert found is not None
        assert found.facts["error"] == "azimuth_scale"
        assert found.facts["value"] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("offset_m", [(0.0, 0.15, 0.0), (0.0, -0.15, 0.0), (0.12, 0.0, 0.0)])
def test_clicks_beside_the_phase_centre_contradict_a_measured_camera(offset_m):
    contradicted = 0
    for seed in range(4):
        simulated = drawn(seed, count=40)
        pose, camera = simulated.camera_from_radar, simulated.camera
        centres = pose @ simulated.points_radar_m
        moved_px = camera.project(centres + np.array(offset_m)) - camera.project(centres)
        pairs = [
            replace(pair, pixel_px=pair.pixel_px + moved) for pair, moved in zip(simulated.pairs, moved_px, strict=True)
        ]
        contradicted += warning(pairs, camera, KNOWN_ELEVATION, "camera-position-contradicted") is not None
        assert warning(pairs, camera, FREE, "camera-position-contradicted") is None
    assert contradicted >= 3


@pytest.mark.parametrize("options", [FREE, MEASURED])
@pytest.mark.parametrize("noise", ["ti", "imaging"])
@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(1, 6), marks=pytest.mark.slow)], ids=["one", "more"])
def test_sound_sets_give_neither_warning(noise, options, seeds):
    for seed in seeds:
        simulated = drawn(seed, noise)
        outcome = calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()
        named = {"angle-scale", "camera-position-contradicted", "shared-error-suspected"}
        assert not named & {one.code for one in outcome.warnings}


@pytest.mark.slow
def test_returns_from_behind_the_reflector_are_beyond_the_range_bias_that_is_assumed():
    """As a camera beside the radar sees them; one in its place sees them where the reflector is, whatever their range."""
    beside, found = RigOptions(camera_offset_m=(0.0, 2.0, 0.5)), []
    for seed in range(5):
        rng = np.random.default_rng([8, seed])
        simulated = simulate_pairs(40, rng=rng, noise="imaging", rig_options=beside)
        assert warning(simulated.pairs, simulated.camera, FREE, "shared-error-suspected") is None
        behind = polar_from_cartesian(positions(simulated)) + np.array([1.0, 0.0, 0.0])
        pairs = with_positions(simulated, cartesian_from_polar(behind))
        found.append(warning(pairs, simulated.camera, FREE, "shared-error-suspected"))
    biases = [one.facts for one in found if one is not None and one.facts.get("error") == "range_bias_m"]
    assert len(biases) >= 2
    assert all(abs(facts["value"] - 1.0) < 3.0 * facts["sigma"] for facts in biases)


TAPED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))


def solved(simulated: SimulatedPairs, options: CalibrationOptions = FREE) -> Calibration:
    return calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()


def distance(simulated: SimulatedPairs, calibration: Calibration) -> float:
    """Return the squared distance of the truth over that of the edge of the stated 95 % ellipsoid."""
    error = simulated.camera_from_radar.error_from(calibration.camera_from_radar)
    return float(error @ np.linalg.solve(calibration.covariance, error)) / calibration.covariance_quantile


def all_errors(simulated: SimulatedPairs, *, flat: bool) -> list[SystematicError]:
    found = systematic_errors(TAPED, simulated.camera, flat=flat)
    return [*found.estimated, *found.widening]


def pixels_with(
    simulated: SimulatedPairs, measurements: PairMeasurements, error: SystematicError, amount: float
) -> np.ndarray:
    """Project the measured positions (2, n) as a radar, lens or person with this error would see them."""
    pose, camera = simulated.camera_from_radar, simulated.camera
    reported = measurements.reported.T
    offset_m, shift_px = np.zeros(3), np.zeros(2)
    if error.of_radar:
        reported = RadarErrors.named({error.name: amount}).corrected_polar(reported)
    elif error.name == "range_scale":
        reported = reported / np.array([[1.0 + amount], [1.0], [1.0]])
    elif error.name == "elevation_lean":
        reported = reported - amount * np.stack([np.zeros_like(reported[1]), np.zeros_like(reported[1]), reported[1]])
    elif error.axis is not None:
        offset_m[error.axis] = amount
    elif error.name.startswith("click"):
        shift_px[["right", "down"].index(error.name.split("_")[1])] = amount
    elif error.name == "focal_length":
        matrix = camera.matrix_px.copy()
        matrix[:2, :2] *= 1.0 + amount
        camera = replace(camera, matrix_px=matrix)
    else:
        camera = replace(camera, distortion=camera.distortion + np.array([amount, 0.0, 0.0, 0.0]))
    return np.asarray((camera.project(pose @ cartesian_from_polar(reported.T) + offset_m) + shift_px).T)


@pytest.mark.parametrize("flat", [False, True])
def test_each_column_is_the_derivative_of_the_projection(flat):
    simulated = simulate_pairs(12, rng=np.random.default_rng(1))
    measurements = pair_measurements(simulated.pairs, simulated.camera, without_systematic_errors(FREE))
    planes: MeasurementPlanes = measurements.measured(np.arange(12))
    for error in all_errors(simulated, flat=flat):
        (column,) = planes.columns(simulated.camera, simulated.camera_from_radar, [error])
        small = 1e-4 * error.sigma
        ends = [pixels_with(simulated, measurements, error, sign * small) for sign in (1.0, -1.0)]
        # the lens's own columns are exact only without distortion
        tolerance = 0.12 if error.name in ("focal_length", "distortion") else 1e-4
        found = (ends[0] - ends[1]) / (2.0 * small)
        assert np.abs(column - found).max() < tolerance * max(np.abs(found).max(), 1e-3), error.name


def test_a_sigma_of_zero_leaves_the_error_out():
    simulated = simulate_pairs(12, rng=np.random.default_rng(1))
    exact = systematic_errors(without_systematic_errors(TAPED), simulated.camera, flat=False)
    assert (len(exact.estimated), len(exact.widening)) == (0, 0)
    one = replace(TAPED, radar=replace(TAPED.radar, azimuth_scale_sigma=0.0))
    assert "azimuth_scale" not in {
        error.name for error in systematic_errors(one, simulated.camera, flat=False).estimated
    }


def test_a_reported_position_corrected_by_the_errors_is_the_true_one():
    points = np.array([[5.0, 1.0, -0.5], [12.0, -4.0, 0.3]])
    polar = polar_from_cartesian(points) * [1.0, 1.03, 0.96] + [0.1, 0.0, 0.0]
    errors = RadarErrors(azimuth_scale=0.03, elevation_scale=-0.04, range_bias_m=0.1)
    np.testing.assert_allclose(errors.corrected(cartesian_from_polar(polar)), points, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("options", [FREE, TAPED], ids=["free", "taped"])
@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_an_azimuth_scale_of_three_percent_is_found_and_the_truth_is_covered(noise, options):
    distances, off = [], []
    for seed in range(6):
        simulated = simulate_pairs(
            20, rng=np.random.default_rng([21, seed]), noise=noise, systematic=SystematicErrors(azimuth_scale=0.03)
        )
        calibration = solved(simulated, options)
        distances.append(distance(simulated, calibration))
        scale = next(one for one in calibration.systematic_errors if one.name == "azimuth_scale")
        off.append((scale.value - 0.03) / scale.sigma)
    assert sum(one < 1.0 for one in distances) >= 5
    assert max(distances) < 2.0
    assert np.abs(off).max() < 4.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "errors",
    [
        SystematicErrors(click_offset_px=(0.0, 6.0)),
        SystematicErrors(reflector_offset_m=(0.0, 0.1, 0.0)),
        SystematicErrors(principal_point_px=(30.0, 0.0)),
        SystematicErrors(focal_length=0.02),
        SystematicErrors(range_bias_m=0.12),
    ],
    ids=["6 px low", "10 cm low", "principal point", "focal length", "range bias"],
)
def test_errors_of_several_sigma_never_leave_the_truth_far_outside(errors):
    for seed in range(3):
        simulated = simulate_pairs(20, rng=np.random.default_rng([22, seed]), noise="imaging", systematic=errors)
        for options in (FREE, TAPED):
            assert distance(simulated, solved(simulated, options)) < 3.5


@pytest.mark.slow
@pytest.mark.parametrize("options", [FREE, TAPED], ids=["free", "taped"])
def test_scales_are_not_biased_by_the_noise_of_the_positions(options):
    """Differentiated at the measured positions instead of the estimated true ones, the elevation scale comes out 7 % off."""
    values, sigmas = [], []
    for seed in range(24):
        calibration = solved(simulate_pairs(20, rng=np.random.default_rng([23, seed])), options)
        found = {one.name: one for one in calibration.systematic_errors}
        values.append([found[name].value for name in ("azimuth_scale", "elevation_scale")])
        sigmas.append([found[name].sigma for name in ("azimuth_scale", "elevation_scale")])
    assert (np.abs(np.mean(values, axis=0)) < 0.5 * np.mean(sigmas, axis=0)).all()


@pytest.mark.slow
def test_many_pairs_on_flat_ground_settle_on_one_elevation_scale():
    """On flat ground an elevation scale is nearly a shift of the camera: plain Newton steps overshot, and never settled."""
    crowded = replace(FIELD, separation_m=0.0)
    simulated = simulate_pairs(800, rng=np.random.default_rng(25), layout=crowded)
    measurements = pair_measurements(simulated.pairs, simulated.camera, FREE)
    truth = simulated.camera_from_radar
    starts = [truth, truth.perturbed(np.array([0.05, 0.1, -0.05, 0.01, -0.01, 0.005]))]
    fits = [fit_errors_in_variables(measurements, GncSolution(one, 0.0, 1.0), estimate_scale=True) for one in starts]
    apart = fits[0].camera_from_radar.error_from(fits[1].camera_from_radar)
    assert apart @ pose_covariance(fits[0]).pose_information @ apart < 1e-4
    assert fits[0].measurements.errors.values == pytest.approx(fits[1].measurements.errors.values, abs=1e-4)


REFINING = CalibrationOptions(refining=RefiningOptions(intrinsics=True))
TIED = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 4.0]])
"""Of fx, fy and cx: no full rank."""


def prior_of(camera: Camera, options: CalibrationOptions = REFINING) -> LensPrior:
    found = lens_prior(options, camera)
    assert found is not None
    return found


def known(camera: Camera, order: tuple[str, ...], matrix: np.ndarray) -> Camera:
    return replace(camera, covariance=CameraCovariance(order, matrix))


def test_a_covariance_without_full_rank_has_fewer_axes_and_comes_back_from_them():
    prior = prior_of(known(study_camera(), ("fx_px", "fy_px", "cx_px"), TIED))
    assert prior.axes.shape == (3, 2)
    np.testing.assert_allclose(prior.axes @ prior.axes.T, TIED, atol=1e-12)
    np.testing.assert_allclose(prior.sigma, [1.0, 1.0, 2.0])
    assert prior.names == ("lens_fx_px", "lens_fy_px", "lens_cx_px")


def test_without_a_covariance_both_focal_lengths_are_refined_by_one_share():
    camera = study_camera()
    prior = prior_of(camera)
    assert prior.names == ("focal_length", "principal_right_px", "principal_down_px", "distortion")
    moved = prior.camera_at(np.linalg.solve(prior.axes, [0.02, 3.0, -4.0, 0.01]))
    np.testing.assert_allclose(moved.matrix_px[[0, 1], [0, 1]], 1.02 * camera.matrix_px[[0, 1], [0, 1]])
    np.testing.assert_allclose(moved.matrix_px[:2, 2] - camera.matrix_px[:2, 2], [3.0, -4.0])
    np.testing.assert_allclose(moved.distortion - camera.distortion, [0.01, 0.0, 0.0, 0.0])


def test_nobody_said_and_nobody_refines_means_no_prior_of_the_lens():
    assert lens_prior(CalibrationOptions(), study_camera()) is None


def test_a_pinhole_has_no_distortion_to_refine_and_keeps_its_default():
    camera = Camera("pinhole", 1920, 1080, study_camera().matrix_px)
    assert "distortion" not in prior_of(camera).names
    errors = systematic_errors(REFINING, camera, flat=False)
    assert "distortion" in {one.name for one in errors.widening}
    assert "focal_length" not in {one.name for one in errors.widening}


def test_a_focal_length_stays_positive_whatever_the_pairs_say():
    prior = prior_of(study_camera())
    moved = prior.camera_at(np.linalg.solve(prior.axes, [-5.0, 0.0, 0.0, 0.0]))
    assert (np.diag(moved.matrix_px) > 0.0).all()


def test_a_covariance_replaces_the_default_errors_of_the_lens():
    camera = known(study_camera(), ("fx_px", "fy_px", "cx_px"), TIED)
    errors = systematic_errors(CalibrationOptions(), camera, flat=False)
    by_name = {one.name: one for one in errors.widening}
    assert sum(one.of_lens for one in errors.widening) == 2
    assert not {"focal_length", "distortion"} & set(by_name)
    assert by_name["click_right_px"].sigma == CalibrationOptions().reflector.click_offset_sigma_px


def test_the_default_errors_stated_as_a_covariance_give_the_same_pose_and_covariance():
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
    np.testing.assert_allclose(other.camera_from_radar.error_from(one.camera_from_radar), np.zeros(6), atol=1e-9)
    np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("rank", [2, 4])
def test_shares_of_correlated_errors_add_up_and_none_is_negative(rank):
    rng = np.random.default_rng(rank)
    root, mixed = rng.normal(size=(4, rank)), rng.normal(size=(6, rank))
    covariance = root @ root.T
    shares = shared_out(mixed @ root.T, covariance)
    assert (shares >= 0.0).all()
    np.testing.assert_allclose(shares.sum(axis=1), (mixed**2).sum(axis=1))


def test_uncorrelated_errors_keep_their_own_share():
    mixed = np.arange(12.0).reshape(6, 2)
    np.testing.assert_allclose(shared_out(mixed, np.diag([4.0, 9.0])), mixed**2 / [4.0, 9.0])


def test_the_derivative_along_each_axis_is_that_of_the_projection():
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


CAMERA = Camera("pinhole", 1920, 1080, np.array([[1000.0, 0, 960], [0, 1000, 540], [0, 0, 1]]))
COVARIANCE = np.diag([0.03, 0.06, 0.06, 0.004, 0.004, 0.002]) ** 2
AZIMUTH = SystematicErrorResult("azimuth_scale", 0.012, 0.009, 0.02, True, 0.51, 0.05)
DOWN = SystematicErrorResult("click_down_px", 0.5, 5.38, 5.385, False, 0.0, 0.25)
RIGHT = replace(DOWN, name="click_right_px", rotation_share=0.20)


@pytest.mark.parametrize("taped", [True, False])
@pytest.mark.parametrize("flat", [True, False])
def test_every_error_of_the_estimate_has_words(flat, taped):
    position = CameraPositionPrior() if taped else None
    options = CalibrationOptions(solving=SolvingOptions(camera_position=position))
    errors = systematic_errors(options, CAMERA, flat=flat)
    assert {one.name for one in (*errors.estimated, *errors.widening)} <= set(ERRORS)


def test_the_error_with_most_of_the_variance_has_a_remedy():
    (found,) = dominant_errors([AZIMUTH, DOWN], COVARIANCE)
    assert found.largest == AZIMUTH
    assert (found.position_share, found.rotation_share) == (0.51, 0.0)
    assert found.position_cm == pytest.approx(9.0)
    assert found.rotation_deg == pytest.approx(np.rad2deg(0.006))
    assert remedy_of("azimuth_scale", measured=False).action == MeasureCameraPosition()
    assert remedy_of("azimuth_scale", measured=True).action == SpreadPlacements("edges")
    assert dominant_errors([replace(AZIMUTH, position_share=0.3), DOWN], COVARIANCE) == ()


def test_errors_along_several_axes_count_together():
    position, rotation = dominant_errors([AZIMUTH, RIGHT, DOWN], COVARIANCE)
    assert (position.position_share, position.rotation_share) == (0.51, 0.0)
    assert (rotation.position_share, rotation.rotation_share) == (0.0, pytest.approx(0.45))
    assert rotation.largest == DOWN
    assert not is_determined(rotation.largest)


def test_the_parameter_of_a_lens_with_a_covariance_is_named():
    fx = replace(AZIMUTH, name="lens_fx_px", value=-11.0, sigma=30.0, prior_sigma=140.0)
    cx = replace(fx, name="lens_cx_px", position_share=0.2)
    (found,) = dominant_errors([cx, fx], 100.0 * COVARIANCE)
    assert found.largest == fx
    assert found.position_share == pytest.approx(0.71)
    assert error_words("lens_fx_px").unit == "px"


def test_one_error_behind_both_is_named_once():
    (found,) = dominant_errors([replace(AZIMUTH, rotation_share=0.95)], COVARIANCE)
    assert (found.position_share, found.rotation_share) == (0.51, 0.95)


@pytest.mark.parametrize("name", ["azimuth_scale", "click_down_px", "lens_fx_px", "warp_rad"])
def test_each_dominant_error_is_said_with_what_would_reduce_it(name):
    (found,) = dominant_errors([replace(AZIMUTH, name=name)], COVARIANCE)
    known, whole = (str(dominant_sentence(found, measured=False, with_remedy=one)) for one in (False, True))
    assert whole.startswith(known)
    assert str(remedy_of(name, measured=False).phrase) in whole


def test_an_error_of_a_later_version_goes_by_its_name():
    assert error_words("warp_rad").text == "warp_rad"
    assert remedy_of("warp_rad", measured=False).action == SpreadPlacements("")
