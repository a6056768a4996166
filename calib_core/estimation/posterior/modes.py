"""Modes of the posterior: poses that many pairs agree on, each refined with inlier probabilities of its own.

All poses are refined together as one batch, and each may use another set of pairs: without one pair in turn, or only some.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Values
from calib_core.estimation.posterior.pose_batch import Poses
from calib_core.estimation.posterior.pose_posterior import NEAR_OUTLIER_FACTOR, PairTerms, PosePosterior

_LARGEST_TURN_RAD, _LARGEST_SHIFT_M = 0.3, 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """Refined poses.

    Attributes:
        poses: k of them.
        hessians: (k, 6, 6) Gauss-Newton Hessians, camera prior included.
        inlier: (k, n) probability that each pair is an inlier, whether or not it was used.
        evidence: (k,) log likelihood of the pairs that were used, relative to all being outliers, camera prior included.
    """

    poses: Poses
    hessians: np.ndarray
    inlier: np.ndarray
    evidence: Values


def refine_poses(
    posterior: PosePosterior,
    poses: Poses,
    log_scales: np.ndarray,
    *,
    share: float,
    used: Flags | None = None,
    rounds: int,
) -> Modes:
    """Refine poses at given noise levels by expectation-maximisation, with one Gauss-Newton step per round.

    Args:
        posterior: of the pairs.
        poses: where to start, k of them.
        log_scales: (k, 4) logarithm of the noise over the assumed one.
        share: of inliers, before any pair is looked at.
        used: (k, n) the pairs that count for each pose; None uses all.
        rounds: number of steps.
    """
    counts = np.ones((len(poses), len(posterior.measurements)), dtype=bool) if used is None else used
    for _ in range(rounds):
        terms = posterior.pair_terms(poses, log_scales)
        hessians, gradients = _normal_equations(posterior, poses, terms, share, counts)
        poses = poses.perturbed(_steps(hessians, gradients))
    terms = posterior.pair_terms(poses, log_scales)
    hessians, _ = _normal_equations(posterior, poses, terms, share, counts)
    mixed = np.log1p(share * np.expm1(np.minimum(terms.pair, 500.0)))
    evidence = np.where(counts, mixed, 0.0).sum(axis=1) - 0.5 * posterior.prior_costs(poses)
    return Modes(poses, hessians, 1.0 - terms.outlier_probabilities(share), evidence)


def _normal_equations(
    posterior: PosePosterior, poses: Poses, terms: PairTerms, share: float, counts: Flags
) -> tuple[np.ndarray, np.ndarray]:
    """Return Hessians (k, 6, 6) and right-hand sides (k, 6), every candidate row weighted by its probability."""
    outlier = terms.outlier_probabilities(share) / (1.0 - share) * share * counts
    per_row = outlier if posterior.measurements.one_to_one else outlier[:, posterior.measurements.owner]
    kinds = np.exp(np.minimum(terms.inlier, 500.0)) + np.exp(np.minimum(terms.near, 500.0)) / NEAR_OUTLIER_FACTOR**2
    rows = terms.whitened() * np.sqrt(per_row * kinds)[:, None, None, :]
    rows = rows.reshape(*rows.shape[:2], -1)
    product = rows @ np.swapaxes(rows, 1, 2)
    prior_hessians, prior_gradients = posterior.prior_information(poses)
    return product[:, 1:, 1:] + prior_hessians, product[:, 1:, 0] + prior_gradients


def _steps(hessians: np.ndarray, gradients: np.ndarray) -> np.ndarray:
    """Solve for steps (k, 6) of limited length, slightly damped."""
    scale = np.sqrt(np.maximum(np.diagonal(hessians, axis1=1, axis2=2), 1e-12))
    scaled = hessians / (scale[:, :, None] * scale[:, None, :]) + 1e-9 * np.eye(6)
    steps = np.linalg.solve(scaled, (gradients / scale)[:, :, None])[:, :, 0] / scale
    turns, shifts = np.linalg.norm(steps[:, 3:], axis=1), np.linalg.norm(steps[:, :3], axis=1)
    longest = np.maximum(np.maximum(turns / _LARGEST_TURN_RAD, shifts / _LARGEST_SHIFT_M), 1.0)
    return np.asarray(steps / longest[:, None])
