"""Pose refinement: several rough poses at once, each fitted to the candidates that it makes likely.

Expectation maximization: each candidate weighs as much as it is probably the reflector, given the pose; each step then solves
for rotation, camera position and the scales of the radar's angles, with the mounting as prior. Tolerances shrink from step to
step, and the noise level that explains a recording best is kept.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Values, frozen_array
from calib_core.geometry import rotation_exp
from calib_core.proposing.agreement.candidate_rays import CandidateRays
from calib_core.proposing.agreement.mounting_prior import MountingPrior
from calib_core.proposing.agreement.rotation_consensus import Rotations

NOISE_LEVELS = (4.0, 2.0, 1.0, 0.5, 0.25)
"""Factors on the stated standard deviations of the radar's angles, in the order in which they are tried."""
_FREE = 6.0
"""Parameters that a fit adapts to noise: that much a smaller noise level gains by chance, times its logarithm."""
_STEPS = 3
_WIDE, _WIDE_SHARE = 3.0, 0.15
"""Factor on all standard deviations of a dwell that another echo pulls aside, and the share of such dwells."""
_LEAST_FORWARD = 0.3
"""Cosine of the angle between a predicted and a seen direction below which they have nothing to do with each other."""
_LEAST_SHARE_SQUARED = 0.25
"""Of the range that is left along the plane of the placements."""


@dataclass(frozen=True, slots=True, eq=False)
class RoughPoses:
    """Several poses with the noise level at which each explains the candidates best.

    Attributes:
        rotations: (m, 3, 3) camera from radar.
        centres_radar_m: (m, 3) the camera's position.
        scales: (m, 2) azimuth and elevation as reported over the true ones, minus 1.
        noise: (m,) factor on the radar's standard deviations.
        scores: (m,) logarithms of how much better each explains the candidates than chance, prior included.
    """

    rotations: np.ndarray
    centres_radar_m: np.ndarray
    scales: np.ndarray
    noise: Values
    scores: Values

    def __post_init__(self) -> None:
        m = len(self.scores)
        for name, shape in (
            ("rotations", (m, 3, 3)),
            ("centres_radar_m", (m, 3)),
            ("scales", (m, 2)),
            ("noise", (m,)),
            ("scores", (m,)),
        ):
            object.__setattr__(self, name, frozen_array(getattr(self, name), shape))

    def __len__(self) -> int:
        return len(self.scores)


@dataclass(frozen=True, slots=True, eq=False)
class Expectation:
    """How candidates lie to poses.

    Attributes:
        off_rad: (m, n, k, 2) prediction minus candidate, across its ray.
        jacobian: (m, n, k, 2, 8) of it by rotation, camera position and scales.
        covariance: (m, n, k, 2, 2) of it by the noise of radar and picture.
        probability: (m, n, k) that the candidate is the reflector, given the pose.
        weight: (m, n, k) of its offset in a fit: the probability, less for what lies aside.
        log_odds: (m, n) of each dwell over chance.
    """

    off_rad: np.ndarray
    jacobian: np.ndarray
    covariance: np.ndarray
    probability: np.ndarray
    weight: np.ndarray
    log_odds: np.ndarray


def refined_poses(rays: CandidateRays, prior: MountingPrior, rough: Rotations) -> RoughPoses:
    """Fit every rough rotation to the dwells, at each noise level, and return the best of each; in the given order."""
    m = len(rough.scores)
    poses = RoughPoses(rough.rotations, rough.centres_radar_m, np.zeros((m, 2)), np.ones(m), np.zeros(m))
    best = replace(poses, scores=np.full(m, -np.inf))
    for level in NOISE_LEVELS:
        poses = replace(poses, noise=np.full(m, level))
        for _ in range(_STEPS):
            poses = _stepped(rays, prior, poses)
        scored = replace(poses, scores=_scores(rays, prior, poses))
        better = scored.scores > best.scores
        best = RoughPoses(
            *(
                np.where(better.reshape(m, *[1] * (new.ndim - 1)), new, old)
                for new, old in (
                    (scored.rotations, best.rotations),
                    (scored.centres_radar_m, best.centres_radar_m),
                    (scored.scales, best.scales),
                    (scored.noise, best.noise),
                    (scored.scores, best.scores),
                )
            )
        )
    return best


def expectation(rays: CandidateRays, poses: RoughPoses) -> Expectation:
    """Predict every dwell with every pose, and weigh the candidates."""
    points, by_scale = _true_positions(rays, poses)
    away = points - poses.centres_radar_m[:, None]
    range_m = np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 0.1)
    turned = np.einsum("mij,mnj->mni", poses.rotations, away / range_m)
    forward = np.einsum("mni,nki->mnk", turned, rays.rays)
    safe = np.maximum(forward, _LEAST_FORWARD)[..., None]
    off_rad = np.einsum("nkai,mni->mnka", rays.tangents, turned) / safe
    by_point = np.einsum("nkai,mij->mnkaj", rays.tangents, poses.rotations) / (safe * range_m[:, :, None])[..., None]
    crossed = np.cross(turned[:, :, None, None], rays.tangents[None]) / safe[..., None]
    jacobian = np.concatenate([crossed, -by_point, np.einsum("mnkaj,mnjs->mnkas", by_point, by_scale)], axis=-1)
    factor = np.stack([np.ones_like(poses.noise), poses.noise, poses.noise], axis=-1)
    spread = rays.slopes[None] * (rays.sigma_polar[None] * factor[:, None])[:, :, None]
    across = np.einsum("mnkaj,mnjl->mnkal", by_point, spread)
    covariance = across @ np.swapaxes(across, -1, -2) + (rays.sigma_rad**2)[None, ..., None, None] * np.eye(2)
    near, wide = densities(off_rad, covariance)
    odds = np.where(forward > _LEAST_FORWARD, rays.odds / rays.density, 0.0)
    gain = (near + wide) * odds
    total = rays.missing + gain.sum(axis=-1)
    weight = (near + wide / _WIDE**2) * odds / total[..., None]
    return Expectation(off_rad, jacobian, covariance, gain / total[..., None], weight, np.log(total))


def densities(off: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the density (...) of offsets (..., 2) with covariances (..., 2, 2): of the usual, and of those pulled aside."""
    near = (1.0 - _WIDE_SHARE) * _normal(off, covariance)
    return near, _WIDE_SHARE / _WIDE**2 * _normal(off / _WIDE, covariance)


def _normal(off: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    a, b, c = covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 1, 1]
    determinant = a * c - b * b
    x, y = off[..., 0], off[..., 1]
    squared = (c * x * x - 2.0 * b * x * y + a * y * y) / determinant
    return np.asarray(np.exp(-0.5 * squared) / (2.0 * np.pi * np.sqrt(determinant)))


def normal_equations(rays: CandidateRays, prior: MountingPrior, poses: RoughPoses) -> tuple[np.ndarray, np.ndarray]:
    """Return the information (m, 8, 8) of the dwells and the prior, and the gradient (m, 8) of the log-probability."""
    seen = expectation(rays, poses)
    weight = np.linalg.inv(seen.covariance) * seen.weight[..., None, None]
    weighted = np.einsum("mnkab,mnkbp->mnkap", weight, seen.jacobian)
    m = len(poses)
    rows = seen.jacobian.reshape(m, -1, 8)
    information = np.swapaxes(rows, 1, 2) @ weighted.reshape(m, -1, 8)
    gradient = -np.einsum("mrp,mr->mp", weighted.reshape(m, -1, 8), seen.off_rad.reshape(m, -1))
    off, precision = _prior_offsets(prior, poses)
    return information + np.eye(8) * precision, gradient - precision * off


def _stepped(rays: CandidateRays, prior: MountingPrior, poses: RoughPoses) -> RoughPoses:
    """Make one Gauss-Newton step of every pose."""
    information, gradient = normal_equations(rays, prior, poses)
    step = np.linalg.solve(information, gradient[..., None])[..., 0]
    return replace(
        poses,
        rotations=rotation_exp(step[:, :3]) @ poses.rotations,
        centres_radar_m=poses.centres_radar_m + step[:, 3:6],
        scales=poses.scales + step[:, 6:],
    )


def _scores(rays: CandidateRays, prior: MountingPrior, poses: RoughPoses) -> Values:
    off, precision = _prior_offsets(prior, poses)
    penalty = 0.5 * (precision * off**2).sum(axis=1)
    overfit = _FREE * np.log(np.minimum(poses.noise, 1.0))
    return np.asarray(expectation(rays, poses).log_odds.sum(axis=1) - penalty + overfit)


def _prior_offsets(prior: MountingPrior, poses: RoughPoses) -> tuple[np.ndarray, Values]:
    """Return how far poses are from the mounting (m, 8), and the prior's precision (8,)."""
    relative = poses.rotations @ prior.rotation.T
    offsets = np.concatenate(
        [_rotation_logs(relative), poses.centres_radar_m - prior.centre_radar_m, poses.scales], axis=1
    )
    sigma = np.concatenate([np.full(3, prior.rotation_sigma_rad), prior.centre_sigma_m, prior.scale_sigma])
    return offsets, sigma**-2.0


def _rotation_logs(rotations: np.ndarray) -> np.ndarray:
    """Return the rotation vectors (m, 3) of rotations (m, 3, 3) well below half a turn."""
    axis = 0.5 * np.stack(
        [
            rotations[:, 2, 1] - rotations[:, 1, 2],
            rotations[:, 0, 2] - rotations[:, 2, 0],
            rotations[:, 1, 0] - rotations[:, 0, 1],
        ],
        axis=1,
    )
    sine = np.linalg.norm(axis, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(rotations, axis1=1, axis2=2) - 1.0))
    return np.asarray(axis * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 1.0)[:, None])


def _true_positions(rays: CandidateRays, poses: RoughPoses) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (m, n, 3) with the scales taken out, and their derivative by these (m, n, 3, 2).

    A radar without elevation reports the range to a plane below it as if it lay in that plane; the height is taken from the
    camera's, which stands next to it.
    """
    by_scale = -rays.slopes[:, :, 1:] * rays.polar[:, None, 1:]
    points = rays.positions_radar_m[None] + np.einsum("nis,ms->mni", by_scale, poses.scales)
    if rays.is_flat:
        height_m = poses.centres_radar_m[:, None, 2] - rays.positions_radar_m[None, :, 2]
        range_m = np.maximum(rays.polar[None, :, 0], 1e-3)
        points = points * np.sqrt(np.maximum(1.0 - (height_m / range_m) ** 2, _LEAST_SHARE_SQUARED))[..., None]
    return points, np.broadcast_to(by_scale, (len(poses), *by_scale.shape))
