"""Graduated non-convexity: the pose that most pairs agree on."""

import numpy as np

from calib_core.estimation.gnc import associate, mixture_cost, solve_gnc
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.synthetic import simulate_pairs

MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))


def test_candidates_are_associated_with_their_clicks_at_the_true_pose() -> None:
    simulated = simulate_pairs(15, rng=np.random.default_rng(1), noise="ti_fine", decoys=4)
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    rows, _ = associate(measurements, simulated.camera_from_radar)
    assert tuple(rows - measurements.first[:-1]) == simulated.true_candidate


def test_the_true_pose_is_found_with_half_of_the_pairs_wrong() -> None:
    simulated = simulate_pairs(24, rng=np.random.default_rng(2), outlier_share=0.5)
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    starts = initial_poses(measurements, most=3, rng=np.random.default_rng(1))
    best = solve_gnc(measurements, starts, estimate_scale=False)[0]
    assert np.linalg.norm(simulated.camera_from_radar.error_from(best.camera_from_radar)[3:]) < np.deg2rad(3.0)


def test_starts_that_end_in_the_same_pose_count_once() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(3))
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    truth = simulated.camera_from_radar
    starts = [truth.perturbed(0.02 * np.eye(6)[k]) for k in range(6)]
    assert len(solve_gnc(measurements, starts, estimate_scale=False)) == 1


def test_noise_three_times_larger_than_assumed_is_detected() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(4))
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED).scaled([1.0, 0.3, 0.3, 0.3])
    starts = initial_poses(measurements, most=3, rng=np.random.default_rng(1))
    assert solve_gnc(measurements, starts, estimate_scale=True)[0].noise_scale > 1.5


def test_the_true_pose_is_more_likely_than_a_wrong_one() -> None:
    simulated = simulate_pairs(12, rng=np.random.default_rng(5), outlier_share=0.25)
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    wrong = simulated.camera_from_radar.perturbed(np.array([0, 0, 0, 0, 0.1, 0]))
    assert mixture_cost(measurements, simulated.camera_from_radar) < mixture_cost(measurements, wrong) - 10.0
