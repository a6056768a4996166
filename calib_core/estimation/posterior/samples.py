"""Posterior samples: pose, covariance and 95 % ellipsoid where the local covariance does not describe the posterior.

Samples are drawn about the fit, about poses that other starts end in, and about the poses without each pair in turn. If the
stated ellipsoid holds its share of the posterior, nothing is changed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Values, Vector3
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.posterior.importance_sampling import Mixture, WeightedSamples, importance_samples
from calib_core.estimation.posterior.modes import refine_poses
from calib_core.estimation.posterior.pose_batch import Poses, batch_of, joined_poses
from calib_core.estimation.posterior.pose_posterior import PosePosterior, pose_posterior
from calib_core.geometry import RigidTransform, rotation_log
from calib_core.radar import cartesian_from_polar

MOST_ROWS = 300
"""Candidate rows up to which samples take a fraction of a second; of more pairs, the local covariance describes the posterior."""

_PER_ROUND, _ROUNDS = 500, (3, 10)
_ENOUGH = 600.0  # effective samples: the share inside the 95 % ellipsoid is then known to 0.9 %
_WIDER = 1.2  # factor on the covariance of a peak to start from
_EVENING = 0.25  # power of the peaks' probabilities
_UNLIKELY = 25.0  # a peak less likely than the best by this log factor is not sampled
_HYPOTHESES, _REFINED_HYPOTHESES = 80, 16
_MOST_PEAKS = 8
_SAME = 4.0  # squared distance, in standard deviations
_REFINING_ROUNDS = 8
_LEAST_DEGREES = 3.0  # of each noise scale
_SINGULAR, _LEAST_INFORMATION = 1e-12, 1e-12
"""The smallest eigenvalue of a Hessian with a unit diagonal that is more than rounding, and the least entry of a diagonal."""


@dataclass(frozen=True, slots=True, eq=False)
class PosteriorSamples:
    """Weighted poses.

    Attributes:
        posterior: the density that they were drawn from.
        samples: its states, with weights.
    """

    posterior: PosePosterior
    samples: WeightedSamples

    def mean(self) -> RigidTransform:
        """Return the mean pose."""
        state = self.samples.weights @ self.samples.states[:, :6]
        return self.posterior.poses(state[None]).transform(0)

    def errors_from(self, camera_from_radar: RigidTransform) -> np.ndarray:
        """Return the errors (s, 6) of a pose, (dt, dtheta) [m, rad], if each sample in turn is the truth."""
        states = self.samples.states
        turned = rotation_log(camera_from_radar.rotation @ self.posterior.reference.rotation.T)
        shifts_m = self.posterior.poses(states).translations_m - camera_from_radar.translation_m
        return np.concatenate([shifts_m, _differences(states[:, 3:6], turned)], axis=1)


def sample_posterior(
    measurements: PairMeasurements,
    refined: ErrorsInVariablesFit,
    covariance: Matrix66,
    others: Sequence[RigidTransform],
    *,
    rng: "np.random.Generator",
) -> PosteriorSamples:
    """Draw weighted samples of pose and noise level.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        covariance: (6, 6) of its pose.
        others: other poses to look at, such as those that other starts end in.
        rng: random generator.
    """
    points_m = cartesian_from_polar(measurements.polar[refined.rows])
    pivot_m = refined.weights @ points_m / refined.weights.sum()
    posterior = pose_posterior(measurements, refined.camera_from_radar, pivot_m)
    others = (*others, *_hypotheses(posterior, rng))
    peaks = _likeliest(posterior, _peaks(posterior, refined, covariance, others))
    posterior = posterior.about(peaks.poses.transform(0))
    start = _mixture(posterior, peaks, refined.degrees_of_freedom)
    samples = importance_samples(posterior.costs, start, per_round=_PER_ROUND, rounds=_ROUNDS, enough=_ENOUGH, rng=rng)
    return PosteriorSamples(posterior, samples)


def _hypotheses(posterior: PosePosterior, rng: "np.random.Generator") -> tuple[RigidTransform, ...]:
    """Draw poses from few pairs each, and keep the most likely."""
    drawn = initial_poses(posterior.measurements, most=_HYPOTHESES, rng=rng)
    if not drawn:
        return ()
    costs = posterior.pose_costs(batch_of(drawn), np.zeros((len(drawn), 4)))
    return tuple(drawn[k] for k in np.argsort(costs, kind="stable")[:_REFINED_HYPOTHESES])


def _differences(rotation_vectors: np.ndarray, subtracted: Vector3) -> np.ndarray:
    """Return the rotation vectors (s, 3) of Exp(v) Exp(u)^T, by quaternions, which keep their precision near a half turn."""
    w, xyz = _quaternions(rotation_vectors)
    w0, xyz0 = _quaternions(subtracted[None])
    real = w * w0 + (xyz * xyz0).sum(axis=1)
    imaginary = xyz * w0[:, None] - w[:, None] * xyz0 - np.cross(xyz, xyz0)
    imaginary = np.where(real[:, None] < 0.0, -imaginary, imaginary)
    sine = np.linalg.norm(imaginary, axis=1)
    factor = np.where(sine > 1e-9, 2.0 * np.arctan2(sine, np.abs(real)) / np.maximum(sine, 1e-9), 2.0)
    return np.asarray(imaginary * factor[:, None])


def _quaternions(rotation_vectors: np.ndarray) -> tuple[Values, np.ndarray]:
    """Return the real part (s,) and the imaginary parts (s, 3)."""
    half = 0.5 * np.linalg.norm(rotation_vectors, axis=1)
    return np.cos(half), 0.5 * np.sinc(half / np.pi)[:, None] * rotation_vectors


@dataclass(frozen=True, slots=True, eq=False)
class _Peaks:
    """Where to look.

    Attributes:
        poses: k of them.
        covariances: (k, 6, 6) of (dt, dtheta); zeros where there is no peak.
        log_scales: (k, 4) of the noise; (k, 0) if it is known.
    """

    poses: Poses
    covariances: np.ndarray
    log_scales: np.ndarray

    def some(self, which: list[int]) -> "_Peaks":
        return _Peaks(self.poses.some(np.array(which)), self.covariances[which], self.log_scales[which])


def _peaks(
    posterior: PosePosterior,
    refined: ErrorsInVariablesFit,
    covariance: Matrix66,
    others: Sequence[RigidTransform],
) -> _Peaks:
    """Return the fit, and refined: the other solutions, and the fit without each pair in turn, the other pairs judged anew.

    The other solutions are refined at the fit's noise level and at the assumed one: a wrong fit has a wrong noise level.
    """
    inliers = np.flatnonzero(refined.inliers)
    others = [refined.camera_from_radar, *others]
    starts = batch_of([*others, *[refined.camera_from_radar] * len(inliers), *others])
    log_scales = np.zeros((len(starts), 4))
    log_scales[: -len(others)] = np.log(refined.noise_scale)
    used = np.ones((len(starts), len(posterior.measurements)), dtype=bool)
    used[len(others) + np.arange(len(inliers)), inliers] = False
    modes = refine_poses(posterior, starts, log_scales, share=refined.inlier_share, used=used, rounds=_REFINING_ROUNDS)
    log_scales = np.concatenate([log_scales[:1], log_scales])
    return _Peaks(
        joined_poses([batch_of(others[:1]), modes.poses]),
        np.concatenate([covariance[None], _covariances(modes.hessians)]),
        log_scales if refined.degrees_of_freedom > 0 else log_scales[:, :0],
    )


def _covariances(hessians: np.ndarray) -> np.ndarray:
    """Return the inverses (k, 6, 6) of Hessians; zeros for one that is singular to rounding: no peak is there."""
    scale = np.sqrt(np.maximum(np.diagonal(hessians, axis1=1, axis2=2), _LEAST_INFORMATION))
    scaled = hessians / (scale[:, :, None] * scale[:, None, :])
    values, vectors = np.linalg.eigh(scaled)
    peaked = values[:, 0] > _SINGULAR
    inverse = (vectors / np.where(peaked[:, None], values, 1.0)[:, None, :]) @ vectors.swapaxes(1, 2)
    return np.where(peaked[:, None, None], inverse / (scale[:, :, None] * scale[:, None, :]), 0.0)


def _likeliest(posterior: PosePosterior, peaks: _Peaks) -> _Peaks:
    """Keep the few peaks that hold most of the posterior and differ from one another, the largest first."""
    log_volumes = 0.5 * np.linalg.slogdet(peaks.covariances)[1]
    costs = posterior.pose_costs(peaks.poses, peaks.log_scales)
    likely = np.where(np.isfinite(costs), log_volumes - 0.5 * costs, -np.inf)
    kept: list[int] = []
    for k in np.argsort(-likely, kind="stable").tolist():
        if likely[k] < likely.max() - _UNLIKELY or len(kept) == _MOST_PEAKS:
            break
        pose = peaks.poses.transform(k)
        errors = [pose.error_from(peaks.poses.transform(j)) for j in kept]
        apart = [float(one @ np.linalg.solve(peaks.covariances[j], one)) for j, one in zip(kept, errors, strict=True)]
        if not any(one < _SAME for one in apart):
            kept.append(k)
    return peaks.some(kept)


def _mixture(posterior: PosePosterior, peaks: _Peaks, degrees_of_freedom: float) -> Mixture:
    """Return a mixture with a component for each peak; the less likely ones get more than their share."""
    poses = [peaks.poses.transform(k) for k in range(len(peaks.poses))]
    jacobians = np.array([posterior.state_jacobian(pose) for pose in poses])
    states = np.concatenate([[posterior.state_of(pose) for pose in poses], peaks.log_scales], axis=1)
    spreads = np.zeros((len(poses), states.shape[1], states.shape[1]))
    spreads[:, :6, :6] = _WIDER * jacobians @ peaks.covariances @ np.swapaxes(jacobians, 1, 2)
    scales = range(6, states.shape[1])
    spreads[:, scales, scales] = 1.0 / (2.0 * max(degrees_of_freedom / 4.0, _LEAST_DEGREES))
    likely = 0.5 * np.linalg.slogdet(spreads)[1] - 0.5 * posterior.costs(states)
    weights = np.exp(_EVENING * (likely - likely.max()))
    return Mixture(weights / weights.sum(), states, spreads)
