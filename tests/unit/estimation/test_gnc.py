"""Graduated non-convexity: the pose that most pairs agree on."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.estimation.gnc import _SCALE_PENALTY, _mixture_costs, associate, mixture_cost, solve_gnc
from calib_core.estimation.initialization import Hypotheses, hypothesis_costs, initial_poses
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.geometry import Poses, rotation_angle_rad
from calib_core.measurements import Candidate, Pair, TimeNs
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.synthetic.rig import RigOptions

MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))


def test_candidates_are_associated_with_their_clicks_at_the_true_pose():
    simulated = simulate_pairs(15, rng=np.random.default_rng(1), noise="ti_fine", decoys=4)
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    rows, _ = associate(measurements, simulated.camera_from_radar)
    assert tuple(rows - measurements.first[:-1]) == simulated.true_candidate


def test_a_click_that_fits_nothing_does_not_take_the_return_of_one_that_fits():
    simulated = simulate_pairs(6, rng=np.random.default_rng(1), noise="imaging")
    lost, fitting, *others = simulated.pairs
    (own,) = fitting.candidates
    polar = polar_from_cartesian(own.position_radar_m[None])

    def beside(azimuth_rad: float) -> Candidate:
        return replace(own, position_radar_m=cartesian_from_polar(polar + np.array([0.0, azimuth_rad, 0.0]))[0])

    lost = replace(lost, pixel_px=fitting.pixel_px + np.array([60.0, 0.0]), candidates=(own, beside(0.4)))
    pairs = [lost, replace(fitting, candidates=(own, beside(0.1))), *others]
    measurements = pair_measurements(pairs, simulated.camera, MEASURED)
    labels = np.full(len(measurements.reported), -1)
    labels[[0, 2]] = 0
    rows, _ = associate(replace(measurements, returns=labels), simulated.camera_from_radar)
    assert rows[:2].tolist() == [1, 2]


def test_the_true_pose_is_found_with_half_of_the_pairs_wrong():
    simulated = simulate_pairs(24, rng=np.random.default_rng(2), outlier_share=0.5)
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    starts = initial_poses(measurements, most=3, rng=np.random.default_rng(1))
    best = solve_gnc(measurements, starts, estimate_scale=False)[0]
    assert np.linalg.norm(simulated.camera_from_radar.error_from(best.camera_from_radar)[3:]) < np.deg2rad(3.0)


def test_starts_that_end_in_the_same_pose_count_once():
    simulated = simulate_pairs(20, rng=np.random.default_rng(3))
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    truth = simulated.camera_from_radar
    starts = [truth.perturbed(0.02 * np.eye(6)[k]) for k in range(6)]
    assert len(solve_gnc(measurements, starts, estimate_scale=False)) == 1


def test_noise_three_times_larger_than_assumed_is_detected():
    simulated = simulate_pairs(20, rng=np.random.default_rng(4))
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED).scaled([1.0, 0.3, 0.3, 0.3])
    starts = initial_poses(measurements, most=3, rng=np.random.default_rng(1))
    assert solve_gnc(measurements, starts, estimate_scale=True)[0].noise_scale > 1.5


def test_the_true_pose_is_more_likely_than_a_wrong_one():
    simulated = simulate_pairs(12, rng=np.random.default_rng(5), outlier_share=0.25)
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED)
    wrong = simulated.camera_from_radar.perturbed(np.array([0, 0, 0, 0, 0.1, 0]))
    assert mixture_cost(measurements, simulated.camera_from_radar) < mixture_cost(measurements, wrong) - 10.0


# Initialization: poses to start from.


@pytest.mark.parametrize("options", [CalibrationOptions(), MEASURED])
def test_one_start_is_near_the_truth_despite_wrong_pairs(options):
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), outlier_share=0.4)
    measurements = pair_measurements(simulated.pairs, simulated.camera, options)
    starts = initial_poses(measurements, most=4, rng=np.random.default_rng(1))
    angles = [rotation_angle_rad(start.rotation @ simulated.camera_from_radar.rotation.T) for start in starts]
    assert min(angles) < np.deg2rad(5.0)


def test_a_camera_three_metres_away_is_found_by_three_points():
    rig_options = RigOptions(camera_offset_m=(0.0, 3.0, 0.5))
    simulated = simulate_pairs(20, rng=np.random.default_rng(4), noise="ti_fine", rig_options=rig_options)
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    starts = initial_poses(measurements, most=6, rng=np.random.default_rng(1))
    centres = [start.inverse().translation_m for start in starts]
    assert min(np.linalg.norm(centre - simulated.rig.camera_position_radar_m) for centre in centres) < 0.8


def test_exact_pairs_give_an_exact_three_point_start():
    simulated = simulate_pairs(8, rng=np.random.default_rng(5), noise="none")
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    best = initial_poses(measurements, most=1, rng=np.random.default_rng(1))[0]
    assert np.linalg.norm(simulated.camera_from_radar.error_from(best)) < 0.05


def test_the_true_pose_costs_less_than_one_turned_by_ten_degrees():
    simulated = simulate_pairs(12, rng=np.random.default_rng(6))
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    truth = simulated.camera_from_radar
    turned = truth.perturbed(np.array([0, 0, 0, 0.17, 0, 0]))
    centre = simulated.rig.camera_position_radar_m
    costs = hypothesis_costs(
        Hypotheses(np.stack([truth.rotation, turned.rotation]), np.stack([centre] * 2)), measurements
    )
    assert costs[0] < 0.3 * costs[1]


def test_the_same_seed_draws_the_same_starts():
    simulated = simulate_pairs(30, rng=np.random.default_rng(7), decoys=2)
    measurements = pair_measurements(simulated.pairs, simulated.camera, CalibrationOptions())
    first, second = (initial_poses(measurements, most=3, rng=np.random.default_rng(9)) for _ in range(2))
    assert [one.as_matrix().tobytes() for one in first] == [one.as_matrix().tobytes() for one in second]


# Ambiguous radar positions: the pose and all pairs together determine which alternative is right.


FREE = CalibrationOptions()
ANYWHERE = CalibrationOptions(solving=SolvingOptions(sensors_above_placements=False))
FROM_ABOVE = CalibrationOptions(
    solving=SolvingOptions(camera_position=CameraPositionPrior(RigOptions().camera_offset_m, 0.01))
)
OTHER_LOBE_RAD = np.deg2rad(25.0)


def with_alternatives(simulated: SimulatedPairs, kind: str, rng: np.random.Generator) -> list[Pair]:
    """Give every pair a second, equally plausible position, in random order."""
    pairs = []
    for pair in simulated.pairs:
        (candidate,) = pair.candidates
        polar = polar_from_cartesian(candidate.position_radar_m)
        if kind == "mirrored elevation":
            polar[2] *= -1.0
        else:
            polar[1] += rng.choice([-OTHER_LOBE_RAD, OTHER_LOBE_RAD])
        either = [
            replace(candidate, score=0.5),
            replace(candidate, score=0.5, position_radar_m=cartesian_from_polar(polar)),
        ]
        pairs.append(replace(pair, candidates=tuple(either if rng.random() < 0.5 else either[::-1])))
    return pairs


@pytest.mark.parametrize(
    ("kind", "options"),
    [("another azimuth", FREE), ("another azimuth", FROM_ABOVE), ("mirrored elevation", FROM_ABOVE)],
)
def test_the_right_one_of_two_positions_is_chosen_for_every_pair(kind, options):
    for seed in range(3):
        rng = np.random.default_rng([61, seed])
        simulated = simulate_pairs(20, rng=rng, noise="imaging")
        outcome = calibrate_pairs(with_alternatives(simulated, kind, rng), simulated.camera, options).unwrap()
        meant = [pair.candidates[0].position_radar_m for pair in simulated.pairs]
        wrong = [
            pair.id for pair, place in zip(outcome.pairs, meant, strict=True) if (pair.point_radar_m != place).any()
        ]
        named = [one.facts["ids"] for one in outcome.warnings if one.code == "uncertain-association"]
        assert len(wrong) <= 1
        assert all(name in ids for name in wrong for ids in named)
        assert len(named) >= bool(wrong)


@pytest.mark.slow
def test_if_all_elevations_may_be_mirrored_the_ground_decides_and_without_it_a_warning_says_so():
    for seed in range(3):
        rng = np.random.default_rng([62, seed])
        simulated = simulate_pairs(20, rng=rng, noise="imaging")
        pairs = with_alternatives(simulated, "mirrored elevation", rng)
        outcome = calibrate_pairs(pairs, simulated.camera, FREE).unwrap()
        error = simulated.camera_from_radar.error_from(outcome.camera_from_radar)
        assert np.linalg.norm(error[3:]) < np.deg2rad(1.0)
        outcome = calibrate_pairs(pairs, simulated.camera, ANYWHERE).unwrap()
        assert {one.code for one in outcome.warnings} & {"handedness-open", "two-poses", "mirrored-axes"}


def test_two_clicks_of_one_moment_do_not_take_the_same_return():
    """Both would explain both clicks well enough; the second reflector's own return is a little worse, and right."""
    simulated = simulate_pairs(12, rng=np.random.default_rng(31), noise="imaging")
    pairs = [replace(pair, image_time=TimeNs(k * 60 * 10**9)) for k, pair in enumerate(simulated.pairs)]
    first, second = pairs[0], pairs[1]
    both = (*first.candidates, *second.candidates)
    wrong_first = replace(
        second, image_time=first.image_time, candidates=both, pixel_px=first.pixel_px + np.array([1.0, 0.0])
    )
    measurements = pair_measurements([replace(first, candidates=both), wrong_first, *pairs[2:]], simulated.camera, FREE)
    assert (measurements.returns[:4] >= 0).all()
    rows, _ = associate(measurements, simulated.camera_from_radar)
    assert sorted(rows[:2] % 2) == [0, 1]


def test_a_larger_noise_level_costs_what_larger_sigmas_cost():
    simulated = simulate_pairs(15, rng=np.random.default_rng(5), noise="imaging")
    measurements = pair_measurements(simulated.pairs, simulated.camera, MEASURED).without_errors()
    pose = Poses.of([simulated.camera_from_radar])
    one, two = _mixture_costs(measurements, pose, (1.0, 2.0))[0]
    (doubled,) = _mixture_costs(measurements.scaled(np.full(4, 2.0)), pose, (1.0,))[0]
    assert two - _SCALE_PENALTY == pytest.approx(doubled, rel=1e-9)
    assert one < two
