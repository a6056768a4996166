"""The methods written from other papers do what the papers say."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.accuracy.cases import Case, draw
from benchmarks.accuracy.methods import PEERS, sqpnp_lm
from benchmarks.accuracy.reproduced import bias_compensated_pnp, gmlpnp, unbiased_positions
from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.radar import cartesian_from_polar, polar_from_cartesian

EXACT = [simulate_pairs(20, rng=np.random.default_rng(seed), noise="none") for seed in range(3)]


def positions(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def pixels(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.pixel_px for pair in simulated.pairs])


@pytest.mark.parametrize("simulated", EXACT, ids=range(3))
def test_without_noise_both_find_the_true_pose(simulated):
    points, clicked, camera = positions(simulated), pixels(simulated), simulated.camera
    for pose in (
        gmlpnp(points, clicked, camera),
        bias_compensated_pnp(points, clicked, np.zeros((20, 3)), 1e-3, camera),
    ):
        assert pose is not None
        assert np.abs(simulated.camera_from_radar.error_from(pose)).max() < 1e-7


def test_too_few_pairs_are_no_pose():
    points, clicked, camera = positions(EXACT[0])[:3], pixels(EXACT[0])[:3], EXACT[0].camera
    assert gmlpnp(points, clicked, camera) is None
    assert bias_compensated_pnp(points, clicked, np.zeros((3, 3)), 1.0, camera) is None


def test_the_mean_of_noisy_positions_is_right_once_its_bias_is_taken_off():
    rng = np.random.default_rng(1)
    true = np.array([[8.0, 3.0, -2.0]])
    sigma = np.array([[0.02, np.deg2rad(8.0), np.deg2rad(12.0)]])
    noisy = cartesian_from_polar(polar_from_cartesian(true) + sigma * rng.standard_normal((400_000, 3)))
    assert np.abs(noisy.mean(axis=0) - true).max() > 0.15
    assert np.abs(unbiased_positions(noisy, sigma).mean(axis=0) - true).max() < 0.01


def test_a_thousand_pairs_leave_little_of_the_bias_that_plain_pnp_has():
    case = Case("ti_aisle", 1000, tape_m=None)
    backwards_m = []
    for trial in range(3):
        simulated = draw(case, trial)
        poses = [method(simulated, case) for method in (sqpnp_lm, PEERS["bias-compensated PnP"], PEERS["GMLPnP"])]
        backwards_m.append([forwards(simulated, pose) for pose in poses])
    plain, compensated, general = np.abs(np.mean(backwards_m, axis=0))
    assert plain > 0.05
    assert compensated < 0.5 * plain
    assert general < 0.5 * plain


def forwards(simulated: SimulatedPairs, pose: RigidTransform | None) -> float:
    return float(pose.inverse().translation_m[0] - simulated.rig.camera_position_radar_m[0])


def test_gmlpnp_learns_that_one_axis_is_noisier_than_the_others():
    sigma_m, errors = np.array([0.3, 0.01, 0.01]), []
    for trial in range(20):
        rng = np.random.default_rng([5, trial])
        simulated = simulate_pairs(40, rng=rng, noise="none")
        points = positions(simulated) + sigma_m * rng.standard_normal((40, 3))
        turned = points @ rotation_exp(np.array([0.3, -0.2, 0.1])).T  # the axes of the noise are not those of the radar
        pose = gmlpnp(turned, pixels(simulated), simulated.camera)
        plain = sqpnp_lm(simulated_at(simulated, points), Case("none", 40, tape_m=None))
        centre_m = rotation_exp(np.array([0.3, -0.2, 0.1])).T @ pose.inverse().translation_m
        errors.append(
            [
                np.linalg.norm(one - simulated.rig.camera_position_radar_m)
                for one in (centre_m, plain.inverse().translation_m)
            ]
        )
    ours, plain_m = np.sqrt(np.mean(np.square(errors), axis=0))
    assert ours < 0.8 * plain_m


def simulated_at(simulated: SimulatedPairs, points: np.ndarray) -> SimulatedPairs:
    pairs = [
        replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=point),))
        for pair, point in zip(simulated.pairs, points, strict=True)
    ]
    return replace(simulated, pairs=tuple(pairs))
