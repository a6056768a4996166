"""Posterior peaks: the separate poses that the pairs allow, each with its share of the posterior by Laplace's method.

Peaks are sought from the fit, from the poses that other starts and few pairs each give, and from the fit without each pair in
turn. All are refined together as one batch, and each may use another set of pairs: without one pair, or only some. A peak's
share is proportional to its density times the volume of its covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Matrix66, Values
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import LEAST_INFORMATION, damped_steps
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.pose_posterior import (
    LARGEST_EXPONENT,
    NEAR_OUTLIER_FACTOR,
    PairTerms,
    PosePosterior,
    pose_posterior,
)
from calib_core.geometry import Poses, RigidTransform

_HYPOTHESES, _REFINED_HYPOTHESES, _MOST_PEAKS = 80, 16, 8
"""Number of poses drawn, of those refined as the most likely, and of peaks that are kept. A choice: more find rarer peaks in
more time."""

_SAME = 4.0  # squared distance, in standard deviations
_ROUNDS_APART, _ROUNDS_TOGETHER = 5, 3  # without a pair each, then with all
_SINGULAR = 1e-12
"""The smallest eigenvalue of a Hessian with a unit diagonal that is more than rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class PosteriorPeaks:
    """Separate peaks of the posterior, the most probable first.

    Attributes:
        poses: k of them.
        covariances: (k, 6, 6) of (dt, dtheta) about each.
        probabilities: (k,) their shares of the posterior, which add up to 1.
    """

    poses: Poses
    covariances: np.ndarray
    probabilities: Values

    def of_at_least(self, share: float) -> "PosteriorPeaks":
        """Return the peaks that hold at least this share, or else the first, as if there were no others."""
        kept = np.flatnonzero(self.probabilities >= min(share, self.probabilities[0]))
        shares = self.probabilities[kept]
        return PosteriorPeaks(self.poses.some(kept), self.covariances[kept], shares / shares.sum())

    def spread_about(self, camera_from_radar: RigidTransform) -> Matrix66:
        """Return the mean square error (6, 6) of a pose under the posterior."""
        errors = np.array([pose.error_from(camera_from_radar) for pose in self.poses.transforms()])
        each = self.covariances + errors[:, :, None] * errors[:, None, :]
        return np.asarray(np.einsum("k,kij->ij", self.probabilities, each))


def posterior_peaks(
    measurements: PairMeasurements,
    refined: ErrorsInVariablesFit,
    covariance: Matrix66,
    others: Sequence[RigidTransform],
    *,
    rng: "np.random.Generator",
) -> PosteriorPeaks:
    """Find the few peaks that hold most of the posterior and differ from one another.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        covariance: (6, 6) of its pose.
        others: other poses to look at, such as those that other starts end in.
        rng: random generator.
    """
    posterior = pose_posterior(measurements, refined.camera_from_radar)
    poses, covariances, log_scales = _refined(posterior, refined, covariance, (*others, *_hypotheses(posterior, rng)))
    costs = posterior.pose_costs(poses, log_scales)
    log_shares = np.where(np.isfinite(costs), 0.5 * (np.linalg.slogdet(covariances)[1] - costs), -np.inf)
    kept = [0]  # the fit stands for the peak that it is on
    for k in np.argsort(-log_shares, kind="stable").tolist():
        if not np.isfinite(log_shares[k]) or len(kept) == _MOST_PEAKS:
            break
        errors = [poses.transform(k).error_from(poses.transform(j)) for j in kept]
        apart = (error @ np.linalg.solve(covariances[j], error) for j, error in zip(kept, errors, strict=True))
        if all(squared >= _SAME for squared in apart):
            kept.append(k)
    kept = sorted(kept, key=lambda k: -log_shares[k])
    shares = np.exp(log_shares[kept] - log_shares[kept[0]])
    return PosteriorPeaks(poses.some(np.array(kept)), covariances[kept], shares / shares.sum())


def _hypotheses(posterior: PosePosterior, rng: "np.random.Generator") -> tuple[RigidTransform, ...]:
    """Draw poses from few pairs each, and keep the most likely."""
    drawn = initial_poses(posterior.measurements, most=_HYPOTHESES, rng=rng)
    if not drawn:
        return ()
    costs = posterior.pose_costs(Poses.of(drawn), np.zeros((len(drawn), 4)))
    return tuple(drawn[k] for k in np.argsort(costs, kind="stable")[:_REFINED_HYPOTHESES])


def _refined(
    posterior: PosePosterior,
    refined: ErrorsInVariablesFit,
    covariance: Matrix66,
    others: Sequence[RigidTransform],
) -> tuple[Poses, np.ndarray, np.ndarray]:
    """Return the fit, and refined: the other solutions, and the fit without each pair in turn, the other pairs judged anew.

    The other solutions are refined at the fit's noise level and at the assumed one: a wrong fit has a wrong noise level.

    Returns:
        The poses, their covariances (k, 6, 6) of (dt, dtheta), zeros where there is no peak, and the logarithms (k, 4) of the
        noise over the assumed one.
    """
    inliers = np.flatnonzero(refined.inliers)
    others = [refined.camera_from_radar, *others]
    starts = Poses.of([*others, *[refined.camera_from_radar] * len(inliers), *others])
    log_scales = np.zeros((len(starts), 4))
    log_scales[: -len(others)] = np.log(refined.noise_scale)
    used = np.ones((len(starts), len(posterior.measurements)), dtype=bool)
    used[len(others) + np.arange(len(inliers)), inliers] = False
    share = refined.inlier_share
    modes = refine_poses(posterior, starts, log_scales, share=share, used=used, rounds=_ROUNDS_APART)
    modes = refine_poses(posterior, modes.poses, log_scales, share=share, rounds=_ROUNDS_TOGETHER)
    return (
        Poses.joined([Poses.of(others[:1]), modes.poses]),
        np.concatenate([covariance[None], _covariances(modes.hessians)]),
        np.concatenate([log_scales[:1], log_scales]),
    )


def _covariances(hessians: np.ndarray) -> np.ndarray:
    """Return the inverses (k, 6, 6) of Hessians; zeros for one that is singular to rounding: no peak is there."""
    scale = np.sqrt(np.maximum(np.diagonal(hessians, axis1=1, axis2=2), LEAST_INFORMATION))
    scaled = hessians / (scale[:, :, None] * scale[:, None, :])
    values, vectors = np.linalg.eigh(scaled)
    peaked = values[:, 0] > _SINGULAR
    inverse = (vectors / np.where(peaked[:, None], values, 1.0)[:, None, :]) @ vectors.swapaxes(1, 2)
    return np.where(peaked[:, None, None], inverse / (scale[:, :, None] * scale[:, None, :]), 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """Refined poses.

    Attributes:
        poses: k of them.
        hessians: (k, 6, 6) Gauss-Newton Hessians, camera prior included.
        inlier: (k, n) probability that each pair is an inlier, whether or not it was used.
        log_likelihood: (k,) of the pairs that were used, relative to all being outliers, camera prior included.
    """

    poses: Poses
    hessians: np.ndarray
    inlier: np.ndarray
    log_likelihood: Values


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
        # steps, a choice: about half as far as in GNC, whose first radii are wide
        poses = poses.perturbed(damped_steps(hessians, gradients, largest_turn_rad=0.3, largest_shift_m=1.0))
    terms = posterior.pair_terms(poses, log_scales)
    hessians, _ = _normal_equations(posterior, poses, terms, share, counts)
    mixed = np.log1p(share * np.expm1(np.minimum(terms.pair, LARGEST_EXPONENT)))
    log_likelihood = np.where(counts, mixed, 0.0).sum(axis=1) - 0.5 * posterior.prior_costs(poses)
    return Modes(poses, hessians, 1.0 - terms.outlier_probabilities(share), log_likelihood)


def _normal_equations(
    posterior: PosePosterior, poses: Poses, terms: PairTerms, share: float, counts: Flags
) -> tuple[np.ndarray, np.ndarray]:
    """Return Hessians (k, 6, 6) and right-hand sides (k, 6), every candidate row weighted by its probability."""
    outlier = terms.outlier_probabilities(share) / (1.0 - share) * share * counts
    per_row = outlier if posterior.measurements.one_to_one else outlier[:, posterior.measurements.owner]
    inlier, near = (np.exp(np.minimum(log_density, LARGEST_EXPONENT)) for log_density in (terms.inlier, terms.near))
    kinds = inlier + near / NEAR_OUTLIER_FACTOR**2
    rows = terms.whitened() * np.sqrt(per_row * kinds)[:, None, None, :]
    rows = rows.reshape(*rows.shape[:2], -1)
    product = rows @ np.swapaxes(rows, 1, 2)
    prior_hessians, prior_gradients = posterior.prior_information(poses)
    return product[:, 1:, 1:] + prior_hessians, product[:, 1:, 0] + prior_gradients
