"""Posterior samples agree with the local covariance where it holds, and find what it cannot describe."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from calib_core.estimation import posterior_samples as samples
from calib_core.estimation.beyond_the_fit import PosteriorSummary, possible_poses, summarize_posterior
from calib_core.estimation.pose_posterior import batch_of, pose_posterior
from calib_core.estimation.posterior_samples import Modes, PosteriorSamples, refine_poses, sample_posterior
from calib_core.geometry import RigidTransform
from calib_core.synthetic import SimulatedPairs, simulate_pairs
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
def test_a_nearly_normal_posterior_has_the_local_mean_and_covariance(estimate_scale: bool) -> None:
    simulated = simulate_pairs(30, rng=np.random.default_rng(4), noise="imaging", outlier_share=0.1)
    solved = solve_draw(simulated, tape=True, estimate_scale=estimate_scale)
    drawn = sampled(solved)
    summary = summarized(solved, drawn)
    root = np.linalg.cholesky(solved.uncertainty.covariance)
    whitened = np.linalg.solve(root, np.linalg.solve(root, summary.covariance).T)
    moved = np.linalg.solve(root, summary.camera_from_radar.error_from(solved.refined.camera_from_radar))
    assert drawn.samples.effective > 500.0
    assert np.linalg.norm(moved) < 0.4
    assert np.linalg.eigvalsh(whitened) == pytest.approx(np.ones(6), abs=0.35)
    assert summary.local_holds
    assert summary.inside == pytest.approx(0.95, abs=0.025)


def test_in_an_aisle_the_samples_contain_a_truth_that_the_local_ellipsoid_misses() -> None:
    simulated = an_aisle(36)
    solved = solve_draw(simulated)
    summary = summarized(solved, sampled(solved))
    stated = solved.uncertainty
    assert not inside(simulated, solved.refined.camera_from_radar, stated.covariance, 2.0 * stated.quantile)
    assert not summary.local_holds
    assert inside(simulated, summary.camera_from_radar, summary.covariance, summary.quantile)


def test_a_wrong_pair_that_agrees_leaves_two_possible_poses_of_which_one_is_right() -> None:
    simulated = simulate_pairs(12, rng=np.random.default_rng(1), outlier_share=0.3)
    solved = solve_draw(simulated)
    found = possible_poses(sampled(solved))
    apart = [np.linalg.norm(one.camera_from_radar.error_from(simulated.camera_from_radar)[3:]) for one in found]
    assert len(found) == 2
    assert sum(one.probability for one in found) == pytest.approx(1.0, abs=0.02)
    assert min(apart) < np.deg2rad(3.0)
    assert max(apart) > 2.0 * min(apart)


def test_errors_that_the_samples_do_not_contain_widen_them() -> None:
    solved = solve_draw(simulate_pairs(20, rng=np.random.default_rng(5)))
    drawn = sampled(solved)
    shared = np.diag([0.3, 0.3, 0.3, 0.05, 0.05, 0.05]) ** 2
    plain, widened = summarized(solved, drawn), summarized(solved, drawn, shared)
    assert np.diag(widened.covariance - plain.covariance) == pytest.approx(np.diag(shared), rel=0.35)


def test_the_same_seed_gives_the_same_samples() -> None:
    solved = solve_draw(simulate_pairs(12, rng=np.random.default_rng(6), outlier_share=0.2))
    first, second = sampled(solved), sampled(solved)
    assert (first.samples.states == second.samples.states).all()
    assert (first.samples.weights == second.samples.weights).all()


def test_a_state_and_its_pose_are_the_same_thing() -> None:
    solved = solve_draw(simulate_pairs(10, rng=np.random.default_rng(7)))
    reference = solved.refined.camera_from_radar
    posterior = pose_posterior(solved.measurements, reference, np.array([8.0, 0.5, -1.0]))
    state = np.array([0.3, -0.2, 0.5, 0.4, -1.0, 0.7])
    pose = posterior.poses(state[None]).transform(0)
    assert posterior.state_of(pose) == pytest.approx(state, abs=1e-9)
    error = 1e-6 * np.array([3.0, -1.0, 2.0, 1.0, 2.0, -2.0])
    moved = posterior.state_of(pose.perturbed(error)) - state
    assert moved == pytest.approx(posterior.state_jacobian(pose) @ error, abs=1e-10)


def test_the_posterior_of_many_states_is_that_of_each_alone() -> None:
    simulated = simulate_pairs(10, rng=np.random.default_rng(8), decoys=2)
    solved = solve_draw(simulated)
    posterior = pose_posterior(solved.measurements, solved.refined.camera_from_radar, np.zeros(3))
    states = 0.05 * np.random.default_rng(1).standard_normal((2000, 10))
    alone = [posterior.costs(state[None])[0] for state in states[::400]]
    assert posterior.costs(states)[::400] == pytest.approx(alone, rel=1e-12)


def test_the_posterior_falls_away_from_the_truth_and_does_not_care_about_outliers() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(9), outlier_share=0.3)
    solved = solve_draw(simulated)
    posterior = pose_posterior(solved.measurements, solved.refined.camera_from_radar, np.zeros(3))
    truth = simulated.camera_from_radar
    turned = [truth.perturbed(np.array([0.0, 0.0, 0.0, 0.0, angle, 0.0])) for angle in (0.0, 0.05, 0.2, 3.0)]
    costs = posterior.pose_costs(batch_of(turned), np.zeros((4, 4)))
    assert (np.diff(costs) > 0.0).all() or costs[3] > costs[1] > costs[0]
    terms = posterior.pair_terms(batch_of([truth]), np.zeros((1, 4)))
    assert (terms.outlier_probabilities(0.7)[0][~simulated.outlier] < 0.5).all()


def test_a_start_whose_pose_is_not_determined_is_not_sampled(monkeypatch: pytest.MonkeyPatch) -> None:
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
