"""Posterior samples agree with the local covariance where it holds, and find what it cannot describe."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.arrays import Values
from calib_core.estimation import posterior_samples as samples
from calib_core.estimation.alternative_poses import (
    PosteriorSummary,
    find_agreeing_outliers,
    possible_poses,
    summarize_posterior,
)
from calib_core.estimation.covariance import pose_covariance
from calib_core.estimation.pose_posterior import batch_of, pose_posterior
from calib_core.estimation.posterior_samples import (
    Mixture,
    Modes,
    PosteriorSamples,
    WeightedSamples,
    importance_samples,
    refine_poses,
    sample_posterior,
)
from calib_core.geometry import RigidTransform
from calib_core.measurements import Pair
from tests.solved_draws import NARROW, SolvedDraw, solve_draw


def sampled(solved: SolvedDraw) -> PosteriorSamples:
    return sample_posterior(
        solved.measurements, solved.refined, solved.uncertainty.covariance, (), rng=np.random.default_rng(1)
    )


def summarized(solved: SolvedDraw, drawn: PosteriorSamples, shared: np.ndarray | None = None) -> PosteriorSummary:
    stated = solved.uncertainty
    return summarize_posterior(
        drawn,
        solved.refined.camera_from_radar,
        stated.covariance,
        stated.quantile,
        shared=shared,
        rng=np.random.default_rng(2),
    )


def inside(simulated: SimulatedPairs, pose: RigidTransform, covariance: np.ndarray, quantile: float) -> bool:
    error = simulated.camera_from_radar.error_from(pose)
    return bool(error @ np.linalg.solve(covariance, error) <= quantile)


def an_aisle(seed: int) -> SimulatedPairs:
    return simulate_pairs(20, rng=np.random.default_rng(seed), noise="ti_aisle", outlier_share=0.3, layout=NARROW)


@pytest.mark.parametrize("estimate_scale", [False, True])
def test_a_nearly_normal_posterior_has_the_local_mean_and_covariance(estimate_scale):
    simulated = simulate_pairs(30, rng=np.random.default_rng(4), noise="imaging", outlier_share=0.1)
    solved = solve_draw(simulated, tape=True, estimate_scale=estimate_scale)
    drawn = sampled(solved)
    summary = summarized(solved, drawn)
    independent = pose_covariance(solved.refined, smooth=False)  # the samples know no smooth errors
    root = np.linalg.cholesky(independent.covariance)
    whitened = np.linalg.solve(root, np.linalg.solve(root, summary.covariance).T)
    moved = np.linalg.solve(root, summary.camera_from_radar.error_from(solved.refined.camera_from_radar))
    assert drawn.samples.effective > 500.0
    assert np.linalg.norm(moved) < 0.4
    assert np.linalg.eigvalsh(whitened) == pytest.approx(np.ones(6), abs=0.35)
    assert summary.local_holds
    assert summary.inside > 0.925


def test_in_an_aisle_the_samples_contain_a_truth_that_the_local_ellipsoid_misses():
    simulated = an_aisle(36)
    solved = solve_draw(simulated)
    summary = summarized(solved, sampled(solved))
    stated = solved.uncertainty
    assert not inside(simulated, solved.refined.camera_from_radar, stated.covariance, 2.0 * stated.quantile)
    assert not summary.local_holds
    assert inside(simulated, summary.camera_from_radar, summary.covariance, summary.quantile)


def test_a_wrong_pair_that_agrees_leaves_two_possible_poses_of_which_one_is_right():
    simulated = simulate_pairs(12, rng=np.random.default_rng(1), outlier_share=0.3)
    solved = solve_draw(simulated)
    found = possible_poses(sampled(solved))
    apart = [np.linalg.norm(one.camera_from_radar.error_from(simulated.camera_from_radar)[3:]) for one in found]
    assert len(found) == 2
    assert sum(one.probability for one in found) == pytest.approx(1.0, abs=0.02)
    assert min(apart) < np.deg2rad(3.0)
    assert max(apart) > 2.0 * min(apart)


def test_errors_that_the_samples_do_not_contain_widen_them():
    solved = solve_draw(simulate_pairs(20, rng=np.random.default_rng(5)))
    drawn = sampled(solved)
    shared = np.diag([0.3, 0.3, 0.3, 0.05, 0.05, 0.05]) ** 2
    plain, widened = summarized(solved, drawn), summarized(solved, drawn, shared)
    assert np.diag(widened.covariance - plain.covariance) == pytest.approx(np.diag(shared), rel=0.35)


def test_the_same_seed_gives_the_same_samples():
    solved = solve_draw(simulate_pairs(12, rng=np.random.default_rng(6), outlier_share=0.2))
    first, second = sampled(solved), sampled(solved)
    assert (first.samples.states == second.samples.states).all()
    assert (first.samples.weights == second.samples.weights).all()


def test_a_state_and_its_pose_are_the_same_thing():
    solved = solve_draw(simulate_pairs(10, rng=np.random.default_rng(7)))
    reference = solved.refined.camera_from_radar
    posterior = pose_posterior(solved.measurements, reference, np.array([8.0, 0.5, -1.0]))
    state = np.array([0.3, -0.2, 0.5, 0.4, -1.0, 0.7])
    pose = posterior.poses(state[None]).transform(0)
    assert posterior.state_of(pose) == pytest.approx(state, abs=1e-9)
    error = 1e-6 * np.array([3.0, -1.0, 2.0, 1.0, 2.0, -2.0])
    moved = posterior.state_of(pose.perturbed(error)) - state
    assert moved == pytest.approx(posterior.state_jacobian(pose) @ error, abs=1e-10)


def test_the_posterior_of_many_states_is_that_of_each_alone():
    simulated = simulate_pairs(10, rng=np.random.default_rng(8), decoys=2)
    solved = solve_draw(simulated)
    posterior = pose_posterior(solved.measurements, solved.refined.camera_from_radar, np.zeros(3))
    states = 0.05 * np.random.default_rng(1).standard_normal((2000, 10))
    alone = [posterior.costs(state[None])[0] for state in states[::400]]
    assert posterior.costs(states)[::400] == pytest.approx(alone, rel=1e-12)


def test_the_posterior_falls_away_from_the_truth_and_does_not_care_about_outliers():
    simulated = simulate_pairs(20, rng=np.random.default_rng(9), outlier_share=0.3)
    solved = solve_draw(simulated)
    posterior = pose_posterior(solved.measurements, solved.refined.camera_from_radar, np.zeros(3))
    truth = simulated.camera_from_radar
    turned = [truth.perturbed(np.array([0.0, 0.0, 0.0, 0.0, angle, 0.0])) for angle in (0.0, 0.05, 0.2, 3.0)]
    costs = posterior.pose_costs(batch_of(turned), np.zeros((4, 4)))
    assert (np.diff(costs) > 0.0).all() or costs[3] > costs[1] > costs[0]
    terms = posterior.pair_terms(batch_of([truth]), np.zeros((1, 4)))
    assert (terms.outlier_probabilities(0.7)[0][~simulated.outlier] < 0.5).all()


def test_a_start_whose_pose_is_not_determined_is_not_sampled(monkeypatch):
    """Its Hessian is singular, and rounding may turn the zero into a small negative number."""

    def with_one_undetermined(*arguments: Any, **options: Any) -> Modes:
        modes = refine_poses(*arguments, **options)
        values, vectors = np.linalg.eigh(modes.hessians[-1])
        values[:2] = -1e-14 * values[-1], 1e-14 * values[-1]
        hessians = modes.hessians.copy()
        hessians[-1] = (vectors * values) @ vectors.T
        return replace(modes, hessians=hessians)

    solved = solve_draw(simulate_pairs(20, rng=np.random.default_rng(4), noise="ti"))
    plain = sampled(solved)
    monkeypatch.setattr(samples, "refine_poses", with_one_undetermined)
    drawn = sampled(solved)
    assert np.isfinite(drawn.samples.states).all()
    assert drawn.mean().translation_m == pytest.approx(plain.mean().translation_m, abs=0.02)


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


# Adaptive importance sampling finds means, covariances and shares of known densities.


COVARIANCE = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.2], [0.0, 0.2, 0.3]])


def normal_costs(states: np.ndarray, mean: float, covariance: np.ndarray) -> Values:
    away = states - mean
    return np.asarray((away * np.linalg.solve(covariance, away.T).T).sum(axis=1))


def drawn_from(start: Mixture, *, apart: float | None = None) -> WeightedSamples:
    """Sample a normal density, or one of two peaks with shares of 0.75 and 0.25."""

    def costs(states: np.ndarray) -> Values:
        first = normal_costs(states, 0.0, COVARIANCE)
        if apart is None:
            return first
        second = normal_costs(states, apart, COVARIANCE)
        return np.asarray(-2.0 * np.logaddexp(np.log(0.75) - 0.5 * first, np.log(0.25) - 0.5 * second))

    return importance_samples(costs, start, per_round=500, rounds=(3, 8), enough=1000.0, rng=np.random.default_rng(1))


def test_a_normal_density_gives_its_mean_and_covariance_even_from_a_bad_start():
    bad = Mixture(np.ones(1), np.full((1, 3), 1.5), 4.0 * np.eye(3)[None])
    samples = drawn_from(bad)
    mean = samples.weights @ samples.states
    away = samples.states - mean
    assert samples.effective > 1000.0
    assert mean == pytest.approx(np.zeros(3), abs=0.1)
    assert (away * samples.weights[:, None]).T @ away == pytest.approx(COVARIANCE, abs=0.1)


def test_two_peaks_get_their_shares_whatever_the_first_guess_of_them():
    start = Mixture(np.array([0.1, 0.9]), np.array([[0.0] * 3, [6.0] * 3]), np.stack([COVARIANCE] * 2))
    samples = drawn_from(start, apart=6.0)
    assert samples.weights[samples.states.mean(axis=1) < 3.0].sum() == pytest.approx(0.75, abs=0.05)
    assert samples.mixture.weights == pytest.approx([0.75, 0.25], abs=0.08)


def test_a_mixture_s_samples_follow_its_density():
    mixture = Mixture(np.array([0.3, 0.7]), np.array([[0.0], [5.0]]), np.array([[[1.0]], [[4.0]]]))
    states = mixture.draw(4000, np.random.default_rng(2))[:, 0]
    grid = np.linspace(-60.0, 60.0, 12001)
    density = np.exp(mixture.log_density(grid[:, None]))
    assert density.sum() * 0.01 == pytest.approx(1.0, abs=0.01)
    assert (states < 2.5).mean() == pytest.approx(density[grid < 2.5].sum() * 0.01, abs=0.03)
