"""Initialization: poses to start from."""

import numpy as np
import pytest

from calib_core.estimation.initialization import Hypotheses, hypothesis_costs, initial_poses
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.geometry import rotation_angle_rad
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.synthetic import RigOptions, simulate_pairs

MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))


@pytest.mark.parametrize("options", [CalibrationOptions(), MEASURED])
def test_one_start_is_near_the_truth_despite_wrong_pairs(options: CalibrationOptions) -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), outlier_share=0.4)
    measurements = pair_measurements(simulated.pairs, simulated.camera, options)
    starts = initial_poses(measurements, most=4, rng=np.random.default_rng(1))
    angles = [rotation_angle_rad(start.rotation @ simulated.camera_from_radar.rotation.T) for start in starts]
    assert min(angles) < np.deg2rad(5.0)


def test_a_camera_three_metres_away_is_found_by_three_points() -> None:
    rig_options = RigOptions(camera_offset_m=(0.0, 3.0, 0.5))
    simulated = simulate_pairs(20, rng=np.random.default_rng(4), noise="ti_fine", rig_options=rig_options)
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    starts = initial_poses(measurements, most=6, rng=np.random.default_rng(1))
    centres = [start.inverse().translation_m for start in starts]
    assert min(np.linalg.norm(centre - simulated.rig.camera_position_radar_m) for centre in centres) < 0.8


def test_exact_pairs_give_an_exact_three_point_start() -> None:
    simulated = simulate_pairs(8, rng=np.random.default_rng(5), noise="none")
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    best = initial_poses(measurements, most=1, rng=np.random.default_rng(1))[0]
    assert np.linalg.norm(simulated.camera_from_radar.error_from(best)) < 0.05


def test_the_true_pose_costs_less_than_one_turned_by_ten_degrees() -> None:
    simulated = simulate_pairs(12, rng=np.random.default_rng(6))
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    truth = simulated.camera_from_radar
    turned = truth.perturbed(np.array([0, 0, 0, 0.17, 0, 0]))
    centre = simulated.rig.camera_position_radar_m
    costs = hypothesis_costs(
        Hypotheses(np.stack([truth.rotation, turned.rotation]), np.stack([centre] * 2)), measurements
    )
    assert costs[0] < 0.3 * costs[1]


def test_the_same_seed_draws_the_same_starts() -> None:
    simulated = simulate_pairs(30, rng=np.random.default_rng(7), decoys=2)
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    first, second = (initial_poses(measurements, most=3, rng=np.random.default_rng(9)) for _ in range(2))
    assert [one.as_matrix().tobytes() for one in first] == [one.as_matrix().tobytes() for one in second]
