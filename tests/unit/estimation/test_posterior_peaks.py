"""Peaks of the posterior: one where the local covariance holds, and the others where it does not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.estimation import posterior_peaks as peaks_module
from calib_core.estimation.alternative_poses import find_agreeing_outliers, find_alternatives
from calib_core.estimation.pose_posterior import pose_posterior
from calib_core.estimation.posterior_peaks import Modes, PosteriorPeaks, posterior_peaks, refine_poses
from calib_core.geometry import Poses
from calib_core.measurements import Pair
from tests.solved_draws import SolvedDraw, solve_draw


def peaks_of(solved: SolvedDraw) -> PosteriorPeaks:
    alone = np.linalg.inv(solved.uncertainty.information[:6, :6])
    return posterior_peaks(solved.measurements, solved.refined, alone, (), rng=np.random.default_rng(1))


def test_a_nearly_normal_posterior_has_one_peak_with_the_local_covariance():
    simulated = simulate_pairs(30, rng=np.random.default_rng(4), noise="imaging", outlier_share=0.1)
    solved = solve_draw(simulated)
    peaks = peaks_of(solved)
    alone = np.linalg.inv(solved.uncertainty.information[:6, :6])
    root = np.linalg.cholesky(alone)
    spread = peaks.spread_about(solved.refined.camera_from_radar)
    whitened = np.linalg.solve(root, np.linalg.solve(root, spread).T)
    assert peaks.probabilities[0] > 0.99
    assert np.linalg.eigvalsh(whitened) == pytest.approx(np.ones(6), abs=0.35)


def test_a_wrong_pair_that_agrees_leaves_two_possible_poses_and_the_ellipsoid_holds_the_right_one():
    simulated = simulate_pairs(12, rng=np.random.default_rng(1), outlier_share=0.3)
    solved = solve_draw(simulated)
    beyond = find_alternatives(solved.measurements, solved.refined, solved.uncertainty, (), seed=1)
    apart = [
        np.linalg.norm(simulated.camera_from_radar.error_from(one.camera_from_radar)[3:]) for one in beyond.possible
    ]
    assert len(apart) == 2
    assert apart[1] < np.deg2rad(3.0) < 0.5 * apart[0]
    error = simulated.camera_from_radar.error_from(solved.refined.camera_from_radar)
    for stated, holds in ((solved.uncertainty, False), (beyond.uncertainty, True)):
        assert (error @ np.linalg.solve(stated.covariance, error) <= stated.quantile) == holds


def test_the_spread_about_a_pose_is_that_of_the_peaks_and_their_distance():
    solved = solve_draw(simulate_pairs(10, rng=np.random.default_rng(5)))
    here = solved.refined.camera_from_radar
    there = here.perturbed(np.array([0.4, 0.0, 0.0, 0.0, 0.0, 0.1]))
    peaks = PosteriorPeaks(Poses.of([here, there]), np.stack([np.eye(6), 2.0 * np.eye(6)]), np.array([0.75, 0.25]))
    expected = 1.25 * np.eye(6)
    expected[0, 0] += 0.25 * 0.16
    expected[5, 5] += 0.25 * 0.01
    expected[0, 5] = expected[5, 0] = 0.25 * 0.04
    assert peaks.spread_about(here) == pytest.approx(expected, abs=1e-9)


def test_the_same_seed_gives_the_same_peaks():
    solved = solve_draw(simulate_pairs(12, rng=np.random.default_rng(6), outlier_share=0.2))
    first, second = peaks_of(solved), peaks_of(solved)
    assert (first.probabilities == second.probabilities).all()
    assert (first.covariances == second.covariances).all()


def test_the_posterior_falls_away_from_the_truth_and_does_not_care_about_outliers():
    simulated = simulate_pairs(20, rng=np.random.default_rng(9), outlier_share=0.3)
    solved = solve_draw(simulated)
    posterior = pose_posterior(solved.measurements, solved.refined.camera_from_radar)
    truth = simulated.camera_from_radar
    turned = [truth.perturbed(np.array([0.0, 0.0, 0.0, 0.0, angle, 0.0])) for angle in (0.0, 0.05, 0.2, 3.0)]
    costs = posterior.pose_costs(Poses.of(turned), np.zeros((4, 4)))
    assert (np.diff(costs) > 0.0).all() or costs[3] > costs[1] > costs[0]
    terms = posterior.pair_terms(Poses.of([truth]), np.zeros((1, 4)))
    assert (terms.outlier_probabilities(0.7)[0][~simulated.outlier] < 0.5).all()


def test_a_start_whose_pose_is_not_determined_is_no_peak(monkeypatch):
    """Its Hessian is singular, and rounding may turn the zero into a small negative number."""

    def with_one_undetermined(*arguments: Any, **options: Any) -> Modes:
        modes = refine_poses(*arguments, **options)
        values, vectors = np.linalg.eigh(modes.hessians[-1])
        values[:2] = -1e-14 * values[-1], 1e-14 * values[-1]
        hessians = modes.hessians.copy()
        hessians[-1] = (vectors * values) @ vectors.T
        return replace(modes, hessians=hessians)

    solved = solve_draw(simulate_pairs(20, rng=np.random.default_rng(4), noise="ti"))
    plain = peaks_of(solved)
    monkeypatch.setattr(peaks_module, "refine_poses", with_one_undetermined)
    peaks = peaks_of(solved)
    assert np.isfinite(peaks.probabilities).all()
    assert peaks.poses.translations_m[0] == pytest.approx(plain.poses.translations_m[0], abs=0.02)


# Outliers that agree among themselves are found with their pose; outliers that are just wrong are not.


COMPANION_M = np.array([0.7, 0.7, 0.4])  # behind the reflector, to its left and higher, in the world


def with_companion(simulated: SimulatedPairs, which: range) -> list[Pair]:
    """Give pairs the radar position of something that always stands in the same place relative to the reflector."""
    moved_m = simulated.rig.radar_from_world.rotation @ COMPANION_M
    pairs = list(simulated.pairs)
    for i in which:
        candidate = pairs[i].candidates[0]
        pairs[i] = replace(
            pairs[i], candidates=(replace(candidate, position_radar_m=candidate.position_radar_m + moved_m),)
        )
    return pairs


@pytest.mark.parametrize("tape", [False, True])
def test_pairs_of_a_companion_are_found_with_the_place_where_it_stands(tape):
    simulated = simulate_pairs(20, rng=np.random.default_rng(2), noise="imaging")
    solved = solve_draw(simulated, pairs=with_companion(simulated, range(6)), tape=tape)
    found = find_agreeing_outliers(solved.measurements, solved.refined, rng=np.random.default_rng(1))
    assert found.pairs.tolist() == list(range(6))
    assert found.camera_move_m == pytest.approx(np.linalg.norm(COMPANION_M), abs=0.3)
    assert np.linalg.norm(found.difference[3:]) < np.deg2rad(5.0)


@pytest.mark.parametrize("share", [0.3, 0.5])
def test_outliers_that_are_just_wrong_do_not_agree(share):
    for seed in range(6):
        simulated = simulate_pairs(20, rng=np.random.default_rng([5, seed]), outlier_share=share)
        solved = solve_draw(simulated)
        assert find_agreeing_outliers(solved.measurements, solved.refined, rng=np.random.default_rng(1)) is None


def test_three_outliers_are_too_few_to_agree():
    simulated = simulate_pairs(20, rng=np.random.default_rng(2), noise="imaging")
    solved = solve_draw(simulated, pairs=with_companion(simulated, range(3)))
    assert find_agreeing_outliers(solved.measurements, solved.refined, rng=np.random.default_rng(1)) is None
