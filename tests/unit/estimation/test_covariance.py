"""The stated uncertainty matches the actual errors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import FIELD, SimulatedPairs, SystematicErrors, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.measurements import Pair
from calib_core.options import (
    CalibrationOptions,
    CameraPositionPrior,
    LensOptions,
    RadarOptions,
    ReflectorOptions,
    SolvingOptions,
    without_systematic_errors,
)
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration
from calib_core.results.calibration import CovarianceParts

MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))
EXACT = without_systematic_errors(MEASURED)


def solved(simulated: SimulatedPairs, options: CalibrationOptions = MEASURED) -> Calibration:
    return calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()


@pytest.mark.slow
def test_pixel_covariance_is_that_of_projections_under_drawn_poses():
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), noise="imaging")
    calibration = solved(simulated, EXACT)
    points = np.array([[8.0, 1.0, 0.2], [4.0, -1.0, -0.5]])
    rng = np.random.default_rng(1)
    drawn = rng.multivariate_normal(np.zeros(6), calibration.covariance, 6000)
    pixels = np.array([calibration.camera.project(calibration.camera_from_radar.perturbed(d) @ points) for d in drawn])
    for k in range(2):
        assert np.cov(pixels[:, k].T) == pytest.approx(calibration.pixel_covariance(points)[k], rel=0.25, abs=0.3)


def test_pixel_covariance_of_what_the_lens_does_not_see_is_not_a_number():
    calibration = solved(simulate_pairs(12, rng=np.random.default_rng(3)))
    assert np.isnan(calibration.pixel_covariance(np.array([[-5.0, 0.0, 0.0]]))).all()


def test_a_measured_camera_position_shrinks_rotation_and_position_uncertainty():
    simulated = simulate_pairs(15, rng=np.random.default_rng(4))
    measured, free = (np.diag(solved(simulated, options).covariance) for options in (MEASURED, CalibrationOptions()))
    assert measured[:3].sum() < 0.2 * free[:3].sum()
    assert measured[3:].sum() < 0.8 * free[3:].sum()


def test_leave_one_out_by_one_step_agrees_with_solving_without_the_pair():
    simulated = simulate_pairs(16, rng=np.random.default_rng(5), noise="imaging")
    prior = CameraPositionPrior((0.0, 0.0, 0.045), 0.1)  # so wide that its weight does not change
    fixed = replace(EXACT, noise=replace(MEASURED.noise, estimate_scale=False), solving=SolvingOptions(prior))
    whole = solved(simulated, fixed)
    moved = []
    for name in ("p3", "p9"):
        without = calibrate_pairs(simulated.pairs, simulated.camera, fixed, frozenset({name})).unwrap()
        error = without.camera_from_radar.error_from(whole.camera_from_radar)
        influence = float(np.sqrt(error @ np.linalg.solve(whole.covariance, error)))
        stated = next(pair.influence for pair in whole.pairs if pair.id == name)
        moved.append((stated, influence))
    for stated, influence in moved:
        assert stated == pytest.approx(influence, rel=0.15, abs=0.02)


@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_a_held_out_residual_is_that_of_solving_without_the_pair(noise):
    """The outermost pair says most of the azimuths' scale, which moves it when it is left out."""
    systematic = SystematicErrors(azimuth_scale=0.1)
    simulated = simulate_pairs(10, rng=np.random.default_rng(5), noise=noise, systematic=systematic)
    radar = replace(EXACT.radar, azimuth_scale_sigma=0.1)
    fixed = replace(EXACT, radar=radar, noise=replace(MEASURED.noise, estimate_scale=False))
    whole = solved(simulated, fixed)
    outermost = max(whole.pairs, key=lambda pair: abs(float(np.arctan2(pair.point_radar_m[1], pair.point_radar_m[0]))))
    without = calibrate_pairs(simulated.pairs, simulated.camera, fixed, frozenset({outermost.id})).unwrap()
    away_px = without.reproject(outermost.point_radar_m[None])[0] - outermost.pixel_px
    assert outermost.held_out_px == pytest.approx(float(np.linalg.norm(away_px)), rel=0.03)


def test_a_known_noise_level_takes_the_chi_square_quantile():
    simulated = simulate_pairs(12, rng=np.random.default_rng(6))
    fixed = replace(MEASURED, noise=replace(MEASURED.noise, estimate_scale=False))
    assert solved(simulated, fixed).covariance_quantile == pytest.approx(12.5916, abs=1e-3)
    assert solved(simulated).covariance_quantile > 12.6


# What of a covariance rests on stated sigmas is what the pose moves by if these errors are there.


_SIGMA_M = 1.0
_STEP = 0.02
"""Share of a sigma by which each error is changed: the pose follows in proportion."""
_RADAR = RadarOptions(range_scale_sigma=0.0, elevation_lean_sigma=0.0)


def moved_by(pairs: Sequence[Pair], change: Callable[[np.ndarray], np.ndarray]) -> tuple[Pair, ...]:
    """Change what the radar reports: range, azimuth and elevation of every position."""

    def changed(pair: Pair) -> Pair:
        candidates = tuple(
            replace(one, position_radar_m=cartesian_from_polar(change(polar_from_cartesian(one.position_radar_m))))
            for one in pair.candidates
        )
        return replace(pair, candidates=candidates)

    return tuple(changed(pair) for pair in pairs)


@dataclass(frozen=True)
class Drawn:
    """Pairs with a tape that is right, and their answer."""

    pairs: tuple[Pair, ...]
    camera: Camera
    tape_m: np.ndarray
    answer: Calibration

    @classmethod
    def of(cls, seed: int) -> "Drawn":
        simulated = simulate_pairs(20, rng=np.random.default_rng(seed), noise="imaging")
        tape_m = simulated.camera_from_radar.inverse().translation_m
        answer = calibrate_pairs(simulated.pairs, simulated.camera, with_tape(tape_m)).unwrap()
        return cls(simulated.pairs, simulated.camera, tape_m, answer)

    def moves(self, pairs: Sequence[Pair], tape_m: np.ndarray) -> np.ndarray:
        """Return what the pose moves by (6,), for a whole sigma."""
        other = calibrate_pairs(pairs, self.camera, with_tape(tape_m)).unwrap()
        return other.camera_from_radar.error_from(self.answer.camera_from_radar) / _STEP


def with_tape(position_m: np.ndarray) -> CalibrationOptions:
    """Return options with a measured camera position, and no error that is not estimated."""
    forward, left, up = position_m.tolist()
    solving = SolvingOptions(camera_position=CameraPositionPrior((forward, left, up), _SIGMA_M))
    return CalibrationOptions(
        radar=_RADAR, lens=LensOptions(0.0, 0.0, 0.0), reflector=ReflectorOptions(0.0, 0.0), solving=solving
    )


@pytest.fixture(scope="module")
def drawn() -> tuple[Drawn, ...]:
    return tuple(Drawn.of(seed) for seed in range(8))


@pytest.mark.slow
def test_the_systematic_part_is_what_errors_of_the_radar_move_the_pose_by(drawn):
    bias_m, *scales = (
        _STEP * sigma for sigma in (_RADAR.range_bias_sigma_m, _RADAR.azimuth_scale_sigma, _RADAR.elevation_scale_sigma)
    )
    changes = (
        lambda polar: polar + np.array([bias_m, 0.0, 0.0]),
        lambda polar: polar * np.array([1.0, 1.0 + scales[0], 1.0]),
        lambda polar: polar * np.array([1.0, 1.0, 1.0 + scales[1]]),
    )
    expected = sum(one.moves(moved_by(one.pairs, change), one.tape_m) ** 2 for one in drawn for change in changes)
    np.testing.assert_allclose(sum(diagonal(one, "systematic") for one in drawn), expected, rtol=0.2)


@pytest.mark.slow
def test_the_part_of_the_tape_is_what_another_reading_moves_the_pose_by(drawn):
    readings = (
        _STEP * np.sqrt(2.0) * _SIGMA_M * np.eye(3)
    )  # the standard deviation of Student's t with 4 degrees of freedom
    expected = sum(one.moves(one.pairs, one.tape_m + reading) ** 2 for one in drawn for reading in readings)
    np.testing.assert_allclose(sum(diagonal(one, "camera_position") for one in drawn), expected, rtol=0.1)


def diagonal(drawn: Drawn, part: str) -> np.ndarray:
    """Return the variances (6,) of a part."""
    return np.diag(getattr(drawn.answer.covariance_parts, part))


@pytest.mark.slow
def test_errors_that_only_widen_count_as_systematic_and_the_parts_never_exceed_the_whole():
    for seed in range(4):
        simulated = simulate_pairs(12, rng=np.random.default_rng(seed), noise="ti")
        prior = CameraPositionPrior((0.05, -0.1, 0.12), 0.05)
        options = CalibrationOptions(solving=SolvingOptions(camera_position=prior))
        whole = calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()
        narrow = calibrate_pairs(simulated.pairs, simulated.camera, replace(options, lens=LensOptions(0.0, 0.0, 0.0)))
        parts, fewer = whole.covariance_parts, narrow.unwrap().covariance_parts
        assert np.trace(parts.systematic) > np.trace(fewer.systematic)
        scale = np.sqrt(np.diag(whole.covariance))
        rest = (whole.covariance - parts.systematic - parts.camera_position) / np.outer(scale, scale)
        assert np.linalg.eigvalsh(rest)[0] > -1e-9
        for part in (parts.systematic, parts.camera_position):
            assert np.linalg.eigvalsh(part / np.outer(scale, scale))[0] > -1e-9


def test_without_a_tape_its_part_is_nothing():
    simulated = simulate_pairs(12, rng=np.random.default_rng(1), noise="ti")
    parts = calibrate_pairs(simulated.pairs, simulated.camera).unwrap().covariance_parts
    assert not parts.camera_position.any()
    assert parts.systematic.any()


def test_of_few_pairs_with_a_posterior_that_is_not_normal_they_are_made_to_fit():
    rng = np.random.default_rng(1926)
    noise, count = str(rng.choice(["ti", "imaging", "ti_aisle"])), int(rng.integers(4, 16))
    made = simulate_pairs(count, rng=rng, noise=noise, outlier_share=float(rng.choice([0, 0, 0.2, 0.4])))
    found = calibrate_pairs(made.pairs, made.camera).unwrap()
    parts, scale = found.covariance_parts, np.sqrt(np.diag(found.covariance))
    rest = (found.covariance - parts.systematic - parts.camera_position) / np.outer(scale, scale)
    assert np.linalg.eigvalsh(rest)[0] > -1e-6
    assert np.trace(parts.systematic) > 0.0


def test_parts_that_fit_stay_and_others_shrink_by_one_factor():
    whole = np.diag([1e-4] * 3 + [1e-6] * 3)
    parts = CovarianceParts(0.5 * whole, 0.25 * whole)
    assert parts.within(whole) is parts
    smaller = parts.within(0.5 * whole)
    np.testing.assert_allclose(smaller.systematic, whole / 3.0, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(smaller.camera_position, whole / 6.0, rtol=1e-12, atol=1e-20)


# Angle errors that neighbouring placements share are detected and included in the stated uncertainty.

CROWDED = replace(FIELD, separation_m=0.05)


def smooth(rng: np.random.Generator, directions: np.ndarray, rms_rad: float) -> np.ndarray:
    """Draw a smooth function of azimuth and elevation (n, 2), about 14 deg from hill to valley."""
    waves, phases = rng.standard_normal((200, 2)) / 0.25, rng.uniform(0.0, 2.0 * np.pi, 200)
    return rms_rad * np.sqrt(2.0 / 200.0) * np.cos(directions @ waves.T + phases) @ rng.standard_normal(200)


def with_smooth_errors(seed: int, count: int) -> SimulatedPairs:
    """Replace independent noise by 0.3 and 0.8 deg of smooth errors and a quarter as much of independent ones."""
    rng = np.random.default_rng(seed)
    simulated = simulate_pairs(count, rng=rng, layout=CROWDED)
    polar = polar_from_cartesian(simulated.points_radar_m)
    off = np.deg2rad([0.08, 0.22]) * rng.standard_normal((count, 2))
    off += np.stack([smooth(rng, polar[:, 1:], np.deg2rad(rms_deg)) for rms_deg in (0.3, 0.8)], axis=1)
    polar[:, 0] += 0.005 * rng.standard_normal(count)
    polar[:, 1:] += off
    pairs = tuple(
        replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=point),))
        for pair, point in zip(simulated.pairs, cartesian_from_polar(polar), strict=True)
    )
    return replace(simulated, pairs=pairs)


def solved_with_tape(simulated: SimulatedPairs) -> Calibration:
    return calibrate_pairs(simulated.pairs, simulated.camera, MEASURED).unwrap()


@pytest.mark.slow
def test_the_ellipsoid_contains_the_truth_despite_smooth_errors():
    """If the errors were taken as independent, it would contain the truth in fewer than 3 of 24 sets."""
    inside = 0
    for seed in range(8):
        simulated = with_smooth_errors(seed, 80)
        calibration = solved_with_tape(simulated)
        error = simulated.camera_from_radar.error_from(calibration.camera_from_radar)
        inside += bool(error @ np.linalg.solve(calibration.covariance, error) < calibration.covariance_quantile)
    assert inside >= 7


def test_smooth_errors_raise_a_warning_and_independent_ones_do_not():
    smooth_one = solved_with_tape(with_smooth_errors(1, 60))
    plain = solved_with_tape(simulate_pairs(60, rng=np.random.default_rng(1), layout=CROWDED))
    assert "smooth-angle-errors" in {warning.code for warning in smooth_one.warnings}
    assert "smooth-angle-errors" not in {warning.code for warning in plain.warnings}


def test_a_radar_better_than_stated_shows_no_smooth_errors():
    """Its residuals are quieter than the stated noise everywhere, not alike where placements are neighbors."""
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), noise="imaging")
    camera, pose = simulated.camera, simulated.camera_from_radar
    exact = [
        replace(pair, pixel_px=tuple(pixel), candidates=(replace(pair.candidates[0], position_radar_m=point),))
        for pair, pixel, point in zip(
            simulated.pairs, camera.project(pose @ simulated.points_radar_m), simulated.points_radar_m, strict=True
        )
    ]
    found = calibrate_pairs(exact, camera).unwrap()
    assert "smooth-angle-errors" not in {warning.code for warning in found.warnings}


def test_under_smooth_errors_the_stated_uncertainty_turns_with_the_camera():
    upright = with_smooth_errors(1, 60)
    centre_px = upright.camera.matrix_px[:2, 2]
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # a quarter about the optical axis
    matrix_px = upright.camera.matrix_px.copy()
    matrix_px[:2, 2] = centre_px[::-1]
    camera = Camera("plumb_bob", 1080, 1920, matrix_px, upright.camera.distortion)
    pairs = tuple(
        replace(pair, pixel_px=turn[:2, :2] @ (pair.pixel_px - centre_px) + centre_px[::-1]) for pair in upright.pairs
    )
    before, after = solved(upright, EXACT), calibrate_pairs(pairs, camera, EXACT).unwrap()
    np.testing.assert_allclose(after.camera_from_radar.rotation, turn @ before.camera_from_radar.rotation, atol=1e-6)
    of_both = np.kron(np.eye(2), turn)
    scale = np.sqrt(np.diag(after.covariance))
    turned = of_both @ before.covariance @ of_both.T
    np.testing.assert_allclose(turned / np.outer(scale, scale), after.covariance / np.outer(scale, scale), atol=1e-3)


def test_more_pairs_do_not_average_smooth_errors_out():
    few, many = (np.trace(solved_with_tape(with_smooth_errors(2, count)).covariance[3:, 3:]) for count in (40, 160))
    assert many > 0.4 * few
