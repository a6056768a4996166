"""A measured camera position: believed as far as the pairs believe it, and without a jump where they cease to."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, draw_systematic_errors, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.estimation.best_fit import BestFit, best_fit
from calib_core.estimation.measured_position import _level
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.options import HOW_MEASURED, CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.results import Calibration
from calib_core.results.verdict import stated_error
from calib_core.synthetic.rig import RigOptions

CONTRADICTED = "camera-position-contradicted"
NAMED = {CONTRADICTED, "camera-position-doubtful"}


def drawn(seed: int) -> SimulatedPairs:
    rng = np.random.default_rng([290, seed])
    return simulate_pairs(30, rng=rng, noise="imaging", outlier_share=0.1, systematic=draw_systematic_errors(rng))


def solved(simulated: SimulatedPairs, off_m: tuple[float, float, float], **how: float) -> Calibration:
    forward, left, up = (simulated.rig.camera_position_radar_m + np.array(off_m)).tolist()
    prior = CameraPositionPrior((forward, left, up), **how)
    options = CalibrationOptions(solving=SolvingOptions(camera_position=prior))
    return calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()


def off_m(answer: Calibration, simulated: SimulatedPairs) -> float:
    centre_m = answer.camera_from_radar.inverse().translation_m
    return float(np.linalg.norm(centre_m - simulated.rig.camera_position_radar_m))


def codes(answer: Calibration) -> set[str]:
    return {warning.code for warning in answer.warnings}


@pytest.mark.slow
@pytest.mark.parametrize("slip_m", [(0.0, 0.0, 0.05), (0.05, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_a_position_a_few_centimetres_off_is_within_the_stated_error_or_contradicted(
    slip_m,
):
    for seed in range(4):
        simulated = drawn(seed)
        answer = solved(simulated, slip_m)
        inside = 100.0 * off_m(answer, simulated) <= stated_error(answer).position_cm
        assert inside or (any(slip_m) and codes(answer) & NAMED)


@pytest.mark.slow
@pytest.mark.parametrize("slip_m", [(0.3, 0.0, 0.0), (0.0, -0.3, 0.0), (0.0, 0.0, -0.3)])
def test_a_contradicted_position_is_named_and_has_hardly_any_weight(slip_m):
    for seed in range(4):
        simulated = drawn(seed)
        for sigma_m in (0.005, 0.03):
            answer = solved(simulated, slip_m, sigma_m=sigma_m)
            assert codes(answer) & NAMED
            assert 100.0 * off_m(answer, simulated) < stated_error(answer).position_cm
            part = np.diag(answer.covariance_parts.camera_position) / np.diag(answer.covariance)
            assert part[:3].max() < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("count", [6, 20])
@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_a_position_metres_off_is_named_and_the_pose_is_that_of_the_pairs_alone(noise, count):
    rng = np.random.default_rng([291, count])
    on_a_car = RigOptions(camera_offset_m=(-1.9, 0.4, 0.8))
    simulated = simulate_pairs(
        count, rng=rng, noise=noise, rig_options=on_a_car, systematic=draw_systematic_errors(rng)
    )
    alone = calibrate_pairs(simulated.pairs, simulated.camera).unwrap()
    right_m = simulated.rig.camera_position_radar_m
    forward, left, up = right_m
    slips_m = [(3.0, 0.0, 0.0), (0.0, -11.0, 0.0), (0.0, 0.0, 30.0), (-8.0, 8.0, -5.0), (-20.0, 0.0, 0.0)]
    other_axes_m = [np.array([-left, -up, forward]), np.array([left, forward, up])]
    for slip_m in (*slips_m, *(other - right_m for other in (*other_axes_m, -right_m, 12.0 * right_m))):
        answer = solved(simulated, tuple(slip_m))
        assert CONTRADICTED in codes(answer)
        assert step(alone, answer) < 1.0


def step(before: Calibration, after: Calibration) -> float:
    error = after.camera_from_radar.error_from(before.camera_from_radar)
    return float(np.sqrt(error @ np.linalg.solve(before.covariance, error)))


@pytest.mark.slow
@pytest.mark.parametrize(("direction", "sigma_m"), [((1.0, 0.0, 0.0), 0.03), ((0.0, -0.6, 0.8), 0.01)])
def test_pose_and_covariance_follow_a_position_that_is_farther_and_farther_off(
    direction: tuple[float, float, float], sigma_m: float
) -> None:
    simulated = drawn(1)
    answers = [solved(simulated, tuple(0.01 * k * np.array(direction)), sigma_m=sigma_m) for k in range(41)]  # type: ignore[arg-type]
    assert CONTRADICTED not in codes(answers[0])
    assert CONTRADICTED in codes(answers[-1])
    assert max(step(a, b) for a, b in pairwise(answers)) < 1.0
    sizes = [np.sqrt(np.trace(answer.covariance[:3, :3])) for answer in answers]
    assert max(abs(np.log(b / a)) for a, b in pairwise(sizes)) < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_a_dragged_click_moves_the_pose_by_less_than_a_sigma_a_step_or_changes_sides(noise):
    simulated = simulate_pairs(12, rng=np.random.default_rng([2035, 0]), noise=noise)
    nearest = int(np.linalg.norm(simulated.points_radar_m, axis=1).argmin())
    answers = []
    for k in range(14):
        pairs = list(simulated.pairs)
        pixel_px = pairs[nearest].pixel_px + np.array([3.0 * k, 0.0])
        pairs[nearest] = replace(pairs[nearest], pixel_px=pixel_px)
        answers.append(solved(replace(simulated, pairs=tuple(pairs)), (0.0, 0.0, 0.0), sigma_m=0.01))
    for before, after in pairwise(answers):
        sides = [[pair.inlier for pair in answer.pairs] for answer in (before, after)]
        assert step(before, after) < 1.0 or sides[0] != sides[1]


@pytest.mark.slow
def test_a_scale_of_the_angles_is_not_blamed_without_the_measured_position():
    blamed = [
        warning.facts["measured"]
        for seed in range(6)
        for warning in solved(drawn(seed), (0.0, 0.0, 0.0)).warnings
        if warning.code == "angle-scale"
    ]
    assert blamed
    assert all(blamed)


def test_the_ways_to_measure_have_their_standard_deviations():
    assert CameraPositionPrior((0.1, 0.2, 0.3)).sigma_m == 0.03
    sigmas_m = [CameraPositionPrior.measured((0.1, 0.2, 0.3), how).sigma_m for how in HOW_MEASURED]
    assert sigmas_m == [0.05, 0.02, 0.005]


def test_level_axes_are_along_the_ground_and_look_ahead():
    rig = RigOptions(radar_tilt_deg=15.0)
    simulated = simulate_pairs(20, rng=np.random.default_rng(9), noise="imaging", rig_options=rig)
    options = CalibrationOptions()
    best = best_fit(pair_measurements(simulated.pairs, simulated.camera, options), options)
    assert isinstance(best, BestFit)
    up = simulated.rig.radar_from_world.rotation @ np.array([0.0, 0.0, 1.0])
    radar_from_level = _level(best.refined)
    assert np.linalg.det(radar_from_level) == pytest.approx(1.0)
    assert radar_from_level[:, 2] == pytest.approx(up, abs=0.03)
    assert radar_from_level[0, 0] > 0.9
    assert radar_from_level[1, 1] > 0.9
