"""Pose posterior: how likely any pose and noise level is, given all pairs, without linearizing about one solution.

The covariance of a fit describes one peak by a parabola. With few or many wrong pairs, or placements in a narrow strip, the
posterior is curved, has heavy tails or several peaks. A pair is an inlier with noise S, a near outlier (k times noisier), or
an outlier, and its candidates are alternatives:

    p(pixel | pose, noise) = q sum_c score_c [(1 - a) N(e_c; 0, S_c) + a N(e_c; 0, k^2 S_c)] + (1 - q) o(pixel).    (5)

Most outliers have a good click and a radar position of something else, so their pixels are spread as those of all clicks are:
o is the density of the other clicks, mixed with an even one for clicks that are anywhere. In an aisle, where all clicks are
close together, an even density alone would take agreement by chance as evidence. The share q of inliers is integrated out.
The determinant of S is that at a reference pose: a determinant that follows the pose is right only if placements are spread
evenly over the radar's polar coordinates, and draws the camera backwards, where the same noise covers fewer pixels.

The noise level is unknown too: one factor each on the sigmas of click, range, azimuth and elevation, normal in the logarithm,
the last three with a part in common. All functions take many states at once.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Values
from calib_core.estimation.leave_one_out import PSEUDO_REDUNDANCY, PSEUDO_SHARED
from calib_core.estimation.measurement_model import MeasurementPlanes, PairMeasurements
from calib_core.geometry import Poses, RigidTransform, rotation_jacobian
from calib_core.radar import position_planes

NEAR_OUTLIER_SHARE, NEAR_OUTLIER_FACTOR = 0.01, 5.0
"""Of the pairs that are not outliers anywhere on the image, the share of near outliers, and how many times noisier these are."""

PRIOR_INLIERS, PRIOR_OUTLIERS = 3.0, 0.5
"""Pairs that the prior of the inlier share counts for: a beta distribution."""

NEAR_SIGMAS = 6.0
"""Standard deviations beyond which a pair does not move its own true position."""

LARGEST_EXPONENT = 500.0
"""Of exp(), for log odds and logarithms of likelihood ratios: float64 ends at 709, and products need the rest."""

_SHARES = np.array([0.25, 0.4, 0.55, 0.7, 0.8, 0.88, 0.94, 0.98])  # of inliers: a grid, 0.5 to 1.1 apart in log odds
_TAIL = 4.0  # the weak camera prior is a Cauchy distribution in three dimensions: density (1 + d^2 / sigma^2)^-2
_FAR_PX = 1e6  # residual of a position the camera cannot see


@dataclass(frozen=True, slots=True, eq=False)
class _Linear:
    """The candidate rows linearized at some positions: e ~ N(0, S) as in equation (2), not whitened.

    Attributes:
        residual_px: (s, 2, m) e.
        d_polar: (s, 2, 3, m) d pixel / d polar.
        noise: uu, uv, vv of S, each (s, m) [px^2].
        d_point: (s, 3, 2, m) d pixel / d camera point.
        turned_m: (s, 3, m) the points in camera axes before the translation.
    """

    residual_px: np.ndarray
    d_polar: np.ndarray
    noise: tuple[np.ndarray, np.ndarray, np.ndarray]
    d_point: np.ndarray
    turned_m: np.ndarray

    def solved(self) -> np.ndarray:
        """Return S^-1 e (s, 2, m)."""
        uu, uv, vv = self.noise
        u, v = self.residual_px[:, 0], self.residual_px[:, 1]
        return np.stack([vv * u - uv * v, uu * v - uv * u], axis=1) / (uu * vv - uv * uv)[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class PairTerms:
    """The parts of equation (5) at some states, as logarithms relative to the density of an outlier.

    Attributes:
        linear: the candidate rows, linearized.
        inlier: (s, m) log density of each candidate row as an inlier, score included.
        near: (s, m) the same as a near outlier.
        pair: (s, n) logarithm of the sum over a pair's candidates and both kinds.
    """

    linear: _Linear
    inlier: np.ndarray
    near: np.ndarray
    pair: np.ndarray

    def outlier_probabilities(self, share: float) -> np.ndarray:
        """Return the probability (s, n) that each pair is an outlier anywhere, for a share of inliers."""
        return np.asarray(1.0 / (1.0 + share / (1.0 - share) * np.exp(np.minimum(self.pair, LARGEST_EXPONENT))))

    def whitened(self) -> np.ndarray:
        """Return residual and d pixel / d (dt, dtheta), whitened by the noise: (s, 7, 2, m)."""
        linear = self.linear
        rows = np.empty((len(linear.residual_px), 7, *linear.residual_px.shape[1:]))
        rows[:, 0], rows[:, 1:4] = linear.residual_px, linear.d_point
        rotation_jacobian(linear.turned_m, linear.d_point, out=rows[:, 4:7])
        uu, uv, vv = linear.noise
        root = np.sqrt(uu)[:, None]
        rows[:, :, 0] /= root
        rows[:, :, 1] -= rows[:, :, 0] * (uv[:, None] / root)
        rows[:, :, 1] /= np.sqrt(vv - uv * uv / uu)[:, None]
        return rows


@dataclass(frozen=True, slots=True, eq=False)
class PosePosterior:
    """The posterior of poses and noise levels.

    Attributes:
        measurements: the pairs with the assumed noise.
        candidates: every candidate row with its pair's click.
        log_outlier: (m,) logarithm of the density of each row's click if it is an outlier [1/px^2].
        d_polar: (2, 3, m) d pixel / d polar of each row at the reference; zeros where it does not see the position.
    """

    measurements: PairMeasurements
    candidates: MeasurementPlanes
    log_outlier: Values
    d_polar: np.ndarray

    def pose_costs(self, poses: Poses, log_scales: np.ndarray) -> Values:
        """Return twice the negative log posterior (s,) of poses and noise, per unit volume of translations and rotations.

        Args:
            poses: s of them.
            log_scales: (s, 4) logarithms of the noise over the assumed one.
        """
        ratio = np.exp(np.minimum(self.pair_terms(poses, log_scales).pair, LARGEST_EXPONENT))
        mixed = np.log(_SHARES[:, None, None] * (ratio - 1.0) + 1.0).sum(axis=-1)
        costs = -2.0 * np.logaddexp.reduce(mixed + _LOG_SHARE_PRIOR[:, None], axis=0) + self.prior_costs(poses)
        return np.asarray(costs + ((log_scales @ _SCALES_INFORMATION) * log_scales).sum(axis=1))

    def prior_costs(self, poses: Poses) -> Values:
        """Return the share (s,) of the prior of the camera centre in the costs."""
        prior = self.measurements.prior
        squared = prior.costs(poses.rotations, poses.translations_m)
        return squared if prior.measured else np.asarray(_TAIL * np.log1p(squared))

    def prior_information(self, poses: Poses) -> tuple[np.ndarray, np.ndarray]:
        """Return its Hessians (s, 6, 6) and right-hand sides (s, 6) for Gauss-Newton steps."""
        prior = self.measurements.prior
        hessians, gradients = prior.information(poses.rotations, poses.translations_m)
        factor = 1.0 if prior.measured else _TAIL
        return factor * hessians, factor * gradients

    def pair_terms(self, poses: Poses, log_scales: np.ndarray) -> PairTerms:
        """Evaluate equation (5) at poses, with the logarithms (s, 4) of the noise over the assumed one."""
        measurements = self.measurements
        factors = np.exp(2.0 * log_scales)
        linear = self._linearized(poses, factors)
        squared = (linear.residual_px * linear.solved()).sum(axis=1)
        level = measurements.log_score - self.log_outlier - np.log(2.0 * np.pi)
        level = level - 0.5 * self._log_volumes(factors)
        inlier = level - 0.5 * squared + np.log1p(-NEAR_OUTLIER_SHARE)
        wider = NEAR_OUTLIER_FACTOR**2
        near = level - 0.5 * squared / wider + np.log(NEAR_OUTLIER_SHARE / wider)
        pair = np.logaddexp(inlier, near)
        if not measurements.one_to_one:
            pair = np.logaddexp.reduceat(pair, measurements.first[:-1], axis=-1)
        return PairTerms(linear, inlier, near, pair)

    def _log_volumes(self, factors: np.ndarray) -> np.ndarray:
        """Return log det S (s, m) at the reference pose; that of a position it does not see is taken from the others."""
        uu, uv, vv = self._noise(self.d_polar[None], factors)
        logs = np.log(uu * vv - uv * uv)
        seen = self.d_polar.any(axis=(0, 1))
        return logs if seen.all() or not seen.any() else np.where(seen, logs, np.median(logs[:, seen], axis=1)[:, None])

    def _noise(self, d_polar: np.ndarray, factors: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the entries uu, uv, vv (s, m) of S = C + J V J^T with variances multiplied by factors (s, 4)."""
        noisy = d_polar * self.candidates.sigma_polar
        each, click = factors[:, 1:, None], factors[:, :1] * self.candidates.sigma_px**2
        u, v = noisy[:, 0], noisy[:, 1]
        return (each * u * u).sum(axis=1) + click, (each * u * v).sum(axis=1), (each * v * v).sum(axis=1) + click

    def _linearized(self, poses: Poses, factors: np.ndarray) -> _Linear:
        """Linearize at the measured positions, then at the true positions mu = m + V J^T S^-1 e that follow from that.

        At the measured ones alone the camera would be drawn away from the placements, as in plain PnP.
        """
        measured = self.candidates.polar
        first = self._linearized_at(poses, factors, measured[:, None])
        solved = first.solved()
        near = (first.residual_px * solved).sum(axis=1) < NEAR_SIGMAS**2
        pull = (first.d_polar * solved[:, :, None]).sum(axis=1).transpose(1, 0, 2)  # (3, s, m)
        variances = factors.T[1:, :, None] * self.candidates.sigma_polar[:, None] ** 2
        return self._linearized_at(poses, factors, measured[:, None] + np.where(near, variances * pull, 0.0))

    def _linearized_at(self, poses: Poses, factors: np.ndarray, polar: np.ndarray) -> _Linear:
        """Linearize at polar positions (3, s, m) or (3, 1, m)."""
        position_m, turning = position_planes(polar.reshape(3, -1))
        position_m = position_m.reshape(polar.shape).transpose(1, 0, 2)
        turning = turning.reshape(3, 3, *polar.shape[1:]).transpose(2, 0, 1, 3)
        turned_m = poses.rotations @ position_m
        offset_m = self.measurements.errors.offset_m
        projected_px, d_point = self.measurements.camera.project_planes(
            turned_m + (poses.translations_m + offset_m)[..., None]
        )
        turned_axes = poses.rotations @ turning.reshape(len(turning), 3, -1)
        turned_axes = turned_axes.reshape(len(poses), 3, 3, -1)
        d_polar = np.einsum("sirm,sikm->srkm", d_point, turned_axes)
        residual_px = self.candidates.pixels_px - projected_px
        residual_px -= (d_polar * (self.candidates.polar[:, None] - polar).transpose(1, 0, 2)[:, None]).sum(axis=2)
        unseen = ~np.isfinite(residual_px).all(axis=1)
        if unseen.any():
            residual_px = np.where(unseen[:, None], _FAR_PX, residual_px)
            d_polar, d_point = (np.where(unseen[:, None, None], 0.0, one) for one in (d_polar, d_point))
        noise = self._noise(d_polar, factors)
        return _Linear(residual_px, d_polar, noise, d_point, turned_m)


def pose_posterior(measurements: PairMeasurements, reference: RigidTransform) -> PosePosterior:
    """Prepare the posterior of all pairs.

    Args:
        measurements: with the assumed noise.
        reference: a likely pose.
    """
    each = measurements if measurements.one_to_one else measurements.candidates_apart()
    log_outlier = measurements.log_outlier[measurements.owner]
    candidates = each.measured(np.arange(len(each.polar)))
    nothing = np.zeros((2, *candidates.polar.shape))
    unplaced = PosePosterior(measurements, candidates, log_outlier, nothing)
    linear = unplaced._linearized_at(Poses.of([reference]), np.ones((1, 4)), candidates.polar[:, None])
    return replace(unplaced, d_polar=linear.d_polar[0])


def _log_share_prior() -> Values:
    """Return the logarithm of the beta prior's weight of each of the shares, which are spaced in their log odds."""
    odds = np.log(_SHARES / (1.0 - _SHARES))
    weights = PRIOR_INLIERS * np.log(_SHARES) + PRIOR_OUTLIERS * np.log1p(-_SHARES) + np.log(np.gradient(odds))
    return np.asarray(weights - np.logaddexp.reduce(weights))


def _scales_information() -> np.ndarray:
    """Invert the prior covariance (4, 4) of the log scales; a variance known from nu samples has a log scale of 1 / (2 nu)."""
    covariance = np.eye(4) / (2.0 * PSEUDO_REDUNDANCY)
    covariance[1:, 1:] += 1.0 / (2.0 * PSEUDO_SHARED)
    return np.linalg.inv(covariance)


_LOG_SHARE_PRIOR = _log_share_prior()
_SCALES_INFORMATION = _scales_information()
