"""Pose agreement: the pose on which dwells and candidates agree, and how probable each candidate is under it.

It starts from a consensus of rotations. Camera and radar stand close to each other, so directions nearly suffice: two dwells
with a candidate each give a rotation, and a rotation is as good as it explains the other dwells. All such rotations near the
nominal mounting are tried.

A candidate is judged by the pose that all other dwells give, with its covariance, so that no dwell vouches for itself.

Several rough poses are refined at once (expectation maximization): each candidate weighs as much as it is probably the reflector,
given the pose; each step then solves for rotation, camera position and the scales of the radar's angles, with the mounting as
prior. Tolerances shrink from step to step, and the noise level that explains a recording best is kept.

A person who goes from place to place is seen by the radar and in the images alike, but the echo of many parts that move fades,
and no apex is seen.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Indices, Matrix33, Points2, Points3, Values, Vector3, freeze
from calib_core.geometry import RigidTransform, mounting_rotation, rotation_exp, skews
from calib_core.options import CalibrationOptions
from calib_core.proposing.candidate_rays import CandidateRays
from calib_core.proposing.dwell_views import DwellView

_MOST_TURNED_RAD = float(np.radians(26.0))
"""Largest rotation away from the nominal mounting."""
_TURNED_SIGMA_RAD = np.radians(9.0)
_LEVER_SIGMA_M = 0.25
"""Standard deviation per axis of the camera's position about the radar's, if nobody measured it."""
_HEIGHT_M = 0.8
"""Height of the camera above the plane of the placements from which a radar that measures no elevation starts."""


@dataclass(frozen=True, slots=True, eq=False)
class MountingPrior:
    """What is known of the pose before any dwell.

    Attributes:
        rotation: (3, 3) camera from radar, nominal.
        rotation_sigma_rad: per axis.
        centre_radar_m: (3,) the camera's position.
        centre_sigma_m: (3,) per radar axis.
        start_m: (3,) the camera's position to start from.
        scale_sigma: (2,) of the scales of azimuth and elevation.
    """

    rotation: Matrix33
    rotation_sigma_rad: float
    centre_radar_m: Vector3
    centre_sigma_m: Vector3
    start_m: Vector3
    scale_sigma: Values

    def __post_init__(self) -> None:
        freeze(self, rotation=(3, 3), centre_radar_m=(3,), centre_sigma_m=(3,), start_m=(3,), scale_sigma=(2,))


def mounting_prior(options: CalibrationOptions, *, is_flat: bool) -> MountingPrior:
    """Return the prior of the mounting that the options state.

    Args:
        options: nominal angles, measured position, scale errors of the radar.
        is_flat: the radar measures no elevation, so that its height above the placements is open.
    """
    measured = options.solving.camera_position
    centre = np.zeros(3) if measured is None else np.array(measured.position_m)
    sigma = np.full(3, _LEVER_SIGMA_M if measured is None else max(measured.sigma_m, 0.02))
    start = centre
    if is_flat:
        sigma = np.array([sigma[0], sigma[1], np.hypot(sigma[2], options.radar.height_sigma_m)])
        start = centre + np.array([0.0, 0.0, _HEIGHT_M])
    return MountingPrior(
        rotation=mounting_rotation(*astuple(options.mounting)),
        rotation_sigma_rad=float(_TURNED_SIGMA_RAD),
        centre_radar_m=centre,
        centre_sigma_m=sigma,
        start_m=start,
        scale_sigma=np.maximum([options.radar.azimuth_scale_sigma, options.radar.elevation_scale_sigma], 1e-4),
    )


NOISE_LEVELS = (4.0, 2.0, 1.0, 0.5, 0.25)
"""Factors on the stated standard deviations of the radar's angles, in the order in which they are tried."""


_OF_POSES = ("rotations", "centres_radar_m", "scales", "noise", "scores")


@dataclass(frozen=True, slots=True, eq=False)
class RoughPoses:
    """Several poses, the best first before they are refined, with the noise level at which each explains the candidates best.

    Attributes:
        rotations: (m, 3, 3) camera from radar.
        centres_radar_m: (m, 3) the camera's position.
        scales: (m, 2) azimuth and elevation as reported over the true ones, minus 1.
        noise: (m,) factor on the radar's standard deviations.
        scores: (m,) logarithms of how much better each explains the candidates than chance, prior included; before they are
            refined, the prior not.
        tried: how many rotations were compared.
    """

    rotations: np.ndarray
    centres_radar_m: np.ndarray
    scales: np.ndarray
    noise: Values
    scores: Values
    tried: int = 0

    def __post_init__(self) -> None:
        m = len(self.scores)
        freeze(self, rotations=(m, 3, 3), centres_radar_m=(m, 3), scales=(m, 2), noise=(m,), scores=(m,))

    def __len__(self) -> int:
        return len(self.scores)


@dataclass(frozen=True, slots=True, eq=False)
class Expectation:
    """How candidates lie to poses.

    Attributes:
        off_rad: (m, n, k, 2) prediction minus candidate, across its ray.
        jacobian: (m, n, k, 2, 8) of it by rotation, camera position and scales.
        covariance: (m, n, k, 2, 2) of it by the noise of radar and image.
        probability: (m, n, k) that the candidate is the reflector, given the pose; the weight of its offset in a fit.
        log_odds: (m, d) of each dwell over chance.
    """

    off_rad: np.ndarray
    jacobian: np.ndarray
    covariance: np.ndarray
    probability: np.ndarray
    log_odds: np.ndarray


_LEAST_DWELLS = 2

_OTHER_POSE_RAD = np.radians(2.5)
"""Mean angle between the predictions of two poses that differ clearly."""

_RIVAL_STEP = 4.0
"""How fast the probability of a pose changes with its score: slower than if dwells were independent."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseAgreement:
    """The best pose, its rival, and what they say of each candidate.

    Attributes:
        camera_from_radar: the pose, rough to about a degree.
        score: logarithm of how much better it explains the candidates than chance.
        rival_score: the same of the best pose that differs clearly; 0 if there is none.
        noise: factor on the stated noise of the radar's angles that the dwells show.
        probability: (d, k) that each candidate is the reflector, judged by the other dwells.
        off_sigma: (d, k) distance of each candidate from where the other dwells predict it, in standard deviations.
        share: of the dwells that have candidates, how many agree on the pose.
        rival_share: the same for the rival.
        trials: how many rotations were compared.
    """

    camera_from_radar: RigidTransform
    score: float
    rival_score: float
    noise: float
    probability: Points2
    off_sigma: Points2
    share: float
    rival_share: float
    trials: int

    def __post_init__(self) -> None:
        freeze(self, probability=(None, None), off_sigma=(None, None))

    @property
    def likeliest(self) -> Indices:
        """The most probable candidate of each dwell (d,)."""
        return np.argmax(self.probability, axis=1)

    @property
    def pose_probability(self) -> float:
        """Probability of the pose against its rival."""
        from scipy.special import expit

        return float(expit((self.score - self.rival_score) / _RIVAL_STEP))


def pose_agreement(rays: CandidateRays, prior: MountingPrior, *, most: int = 24) -> PoseAgreement | None:
    """Find the pose; None with fewer than two dwells that have candidates, or if no two of them agree on a mounting.

    Args:
        rays: of all dwells.
        prior: of the mounting.
        most: how many rough rotations are refined.
    """
    if int((rays.odds[rays.first] > 0.0).any(axis=1).sum()) < _LEAST_DWELLS:
        return None
    rough = rotation_consensus(rays, prior, most=most)
    if not len(rough):
        return None
    poses = refined_poses(rays, prior, rough)
    best = int(np.argmax(poses.scores))
    other = np.flatnonzero(_differs(rays, poses, best))
    rival = int(other[np.argmax(poses.scores[other])]) if len(other) else None
    probability, off_sigma = _judged_by_others(rays, prior, _row(poses, best))
    rotation, centre = poses.rotations[best], poses.centres_radar_m[best]
    return PoseAgreement(
        camera_from_radar=RigidTransform(rotation, -rotation @ centre),
        score=float(poses.scores[best]),
        rival_score=0.0 if rival is None else float(poses.scores[rival]),
        noise=float(poses.noise[best]),
        probability=probability,
        off_sigma=off_sigma,
        share=_share(rays, probability),
        rival_share=0.0 if rival is None else _share(rays, _judged_by_others(rays, prior, _row(poses, rival))[0]),
        trials=rough.tried,
    )


def _row(poses: RoughPoses, row: int) -> RoughPoses:
    return RoughPoses(*(getattr(poses, name)[row : row + 1] for name in _OF_POSES))


def _differs(rays: CandidateRays, poses: RoughPoses, best: int) -> Flags:
    """Return which poses (m,) predict clearly other directions than the best one."""
    away = rays.positions_radar_m[None] - poses.centres_radar_m[:, None]
    away = away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-6)
    turned = np.einsum("mij,mnj->mni", poses.rotations, away)
    cosine = np.clip((turned * turned[best]).sum(axis=-1), -1.0, 1.0)
    return np.asarray(np.arccos(cosine).mean(axis=1) > _OTHER_POSE_RAD)


def _judged_by_others(rays: CandidateRays, prior: MountingPrior, pose: RoughPoses) -> tuple[Points2, Points2]:
    """Return the probability of each candidate (d, k) under the pose of the other dwells, and its distance from it."""
    seen = expectation(rays, pose)
    off_rad, jacobian, covariance = seen.off_rad[0], seen.jacobian[0], seen.covariance[0]
    information = normal_equations(rays, prior, pose)[0][0]
    weight = inverse(covariance) * seen.probability[0][..., None, None]
    own = np.add.reduceat(np.einsum("nkap,nkab,nkbq->npq", jacobian, weight, jacobian), rays.first)
    pull = np.add.reduceat(np.einsum("nkap,nkab,nkb->np", jacobian, weight, off_rad), rays.first)
    without = np.linalg.inv(information - own)
    shift = (without @ pull[..., None])[..., 0]
    counts = np.diff(rays.first, append=len(weight))
    without, shift = np.repeat(without, counts, axis=0), np.repeat(shift, counts, axis=0)
    off_rad = off_rad + np.einsum("nkap,np->nka", jacobian, shift)
    covariance = covariance + np.einsum("nkap,npq,nkbq->nkab", jacobian, without, jacobian)
    gain = rays.of_dwells(density(off_rad, covariance) * rays.odds / rays.density)
    squared = np.einsum("nka,nkab,nkb->nk", off_rad, inverse(covariance), off_rad)
    probability = gain / (rays.missing + gain.sum(axis=1))[:, None]
    return probability, np.sqrt(np.maximum(np.minimum.reduceat(squared, rays.first), 0.0))


def _share(rays: CandidateRays, probability: Points2) -> float:
    with_any = (rays.odds[rays.first] > 0.0).any(axis=1)
    return float(probability.max(axis=1)[with_any].sum() / max(with_any.sum(), 1))


_MOST_PAIRED = 600
"""Candidates of which any two give a rotation; of more, so many are drawn by their odds."""

_MOST_TRIED = 6000

_MOST_PREDICTIONS = 1_000_000
"""Rotations times candidates that are compared."""

_LEAST_APART_RAD = np.radians(3.0)
"""Between two dwells that are to give a rotation."""

_TOLERANCE = 3.0
"""Standard deviations by which the angle between two candidates may differ from that between their dwells."""

_ROUGH = 1.6
"""Factor on the radar's standard deviations for a rotation that rests on two dwells."""

_LEVER_M = 0.1
"""What a rotation alone leaves of the lever arm, as a standard deviation."""

_SAME_RAD, _OTHER_RAD = np.radians(1.2), np.radians(4.0)
"""Between the better half of the rotations that are returned, and between the others."""


def rotation_consensus(
    rays: CandidateRays, prior: MountingPrior, *, most: int = 24, tried: int = _MOST_TRIED, seed: int = 0
) -> RoughPoses:
    """Find the rotations that explain the most dwells; none if no two dwells agree within the mounting's reach.

    Args:
        rays: of all dwells.
        prior: of the mounting.
        most: how many to return.
        tried: how many to compare at most.
        seed: of the choice of two-dwell rotations where there are too many to try all.
    """
    away = rays.positions_radar_m - prior.start_m
    directions = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
    rotations = _from_two_dwells(rays, prior, directions, tried, np.random.default_rng(seed))
    scores = _rotation_scores(rays, prior, directions, rotations)
    kept = _best_apart(rotations, scores, most)
    m = len(kept)
    centres = np.tile(prior.start_m, (m, 1))
    return RoughPoses(rotations[kept], centres, np.zeros((m, 2)), np.ones(m), scores[kept], len(rotations))


def _from_two_dwells(
    rays: CandidateRays, prior: MountingPrior, directions: Points3, tried: int, rng: np.random.Generator
) -> np.ndarray:
    """Return the rotations (h, 3, 3) that two candidates of two dwells give, those within the mounting's reach."""
    dwell, which = np.nonzero(rays.odds > 0.0)
    if len(dwell) > _MOST_PAIRED:
        odds = rays.odds[dwell, which]
        drawn = np.sort(rng.choice(len(dwell), _MOST_PAIRED, replace=False, p=odds / odds.sum()))
        dwell, which = dwell[drawn], which[drawn]
    seen, thought = rays.rays[dwell, which], directions[dwell]
    within = np.flatnonzero((seen * (thought @ prior.rotation.T)).sum(axis=1) > np.cos(_MOST_TURNED_RAD))
    dwell, which, seen, thought = dwell[within], which[within], seen[within], thought[within]
    apart_rad = np.arccos(np.clip(directions @ directions.T, -1.0, 1.0))[dwell[:, None], dwell]
    seen_rad = np.arccos(np.clip(seen @ seen.T, -1.0, 1.0))
    range_m = rays.polar[dwell, 0]
    slack = _TOLERANCE * (np.hypot(*rays.sigma_polar[dwell, 1:].T) + prior.centre_sigma_m[1] / np.maximum(range_m, 1.0))
    of = rays.of_positions(np.arange(len(rays)))[dwell]
    agree = (
        (of[:, None] != of) & (apart_rad > _LEAST_APART_RAD) & (np.abs(seen_rad - apart_rad) < slack[:, None] + slack)
    )
    one, other = np.nonzero(np.triu(agree, 1))
    rotations = _frames(seen[one], seen[other]) @ np.swapaxes(_frames(thought[one], thought[other]), 1, 2)
    near = np.flatnonzero(_turned_cosine(rotations, prior.rotation) > np.cos(_MOST_TURNED_RAD))
    most = min(tried, max(_MOST_PREDICTIONS // len(dwell), 500)) if len(dwell) else 0
    if len(near) > most:
        odds = rays.odds[dwell, which]
        likely = odds[one[near]] * odds[other[near]]
        near = rng.choice(near, most, replace=False, p=likely / likely.sum())
    return np.asarray(rotations[near])


def _turned_cosine(rotations: np.ndarray, by: np.ndarray) -> Values:
    """Return the cosines (h,) of the angles between rotations (h, 3, 3) and one (3, 3)."""
    return np.asarray(0.5 * (rotations.reshape(-1, 9) @ by.ravel() - 1.0))


def _frames(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return right-handed axes (h, 3, 3), as columns, that two directions (h, 3) each define symmetrically."""
    middle, across = one + other, np.cross(one, other)
    middle = middle / np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-9)
    across = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
    return np.stack([middle, across, np.cross(middle, across)], axis=-1)


def _rotation_scores(rays: CandidateRays, prior: MountingPrior, directions: Points3, rotations: np.ndarray) -> Values:
    """Return the log-odds (h,) of rotations (h, 3, 3) over chance, with tolerances that do not depend on them."""
    scaled = rays.slopes * rays.sigma_polar[:, None, :] / np.maximum(rays.polar[:, 0], 1e-3)[:, None, None]
    across = rays.tangents @ (prior.rotation @ scaled)[:, None] * _ROUGH
    lever_rad = _LEVER_M / np.maximum(rays.polar[:, 0], 0.3)
    own = rays.sigma_rad**2 + lever_rad[:, None] ** 2
    covariance = across @ np.swapaxes(across, -1, -2) + own[..., None, None] * np.eye(2)
    whitening = np.linalg.inv(np.linalg.cholesky(covariance))
    gain = rays.odds * np.linalg.det(whitening) / (2.0 * np.pi) / rays.density
    n, k = rays.odds.shape
    axes = np.concatenate([rays.rays[:, :, None], whitening @ rays.tangents], axis=2)
    axes = axes.transpose(0, 3, 2, 1).reshape(n, 3, 3 * k)
    turned = (rotations @ directions.T).transpose(2, 0, 1)
    forward, right, down = np.split(turned @ axes, 3, axis=-1)
    near = np.where(forward > 0.5, np.exp(-0.5 * (right**2 + down**2)), 0.0)
    summed = rays.of_dwells((near @ gain[..., None])[..., 0].T[..., None])[..., 0]
    return np.asarray(np.log(rays.missing + summed).sum(axis=1))


def _best_apart(rotations: np.ndarray, scores: Values, most: int) -> Indices:
    """Return the rows of the best rotations: half of them close together, to refine; half far apart, to compare with."""
    kept: list[int] = []
    angle_rad = np.full(len(scores), np.inf)
    for row in np.argsort(-scores, kind="stable").tolist():
        if angle_rad[row] < (_SAME_RAD if len(kept) < most // 2 else _OTHER_RAD):
            continue
        kept.append(row)
        if len(kept) == most:
            break
        cosine = _turned_cosine(rotations, rotations[row])
        angle_rad = np.minimum(angle_rad, np.arccos(np.clip(cosine, -1.0, 1.0)))
    return np.array(kept, dtype=np.int64)


_FREE = 6.0
"""Parameters that a fit adapts to noise: that much a smaller noise level gains by chance, times its logarithm."""

_STEPS = 3

_LEAST_FORWARD = 0.3
"""Cosine of the angle between a predicted and a seen direction below which they have nothing to do with each other."""

_LEAST_SHARE_SQUARED = 0.25
"""Of the range that is left along the plane of the placements."""


def refined_poses(rays: CandidateRays, prior: MountingPrior, rough: RoughPoses) -> RoughPoses:
    """Fit every rough rotation to the dwells, at each noise level, and return the best of each; in the given order."""
    m, poses = len(rough), rough
    best = replace(poses, scores=np.full(m, -np.inf))
    for level in NOISE_LEVELS:
        poses = replace(poses, noise=np.full(m, level))
        for _ in range(_STEPS):
            poses = _stepped(rays, prior, poses)
        scored = replace(poses, scores=_scores(rays, prior, poses))
        better = scored.scores > best.scores
        pairs = [(getattr(scored, name), getattr(best, name)) for name in _OF_POSES]
        best = RoughPoses(*(np.where(better.reshape(m, *[1] * (new.ndim - 1)), new, old) for new, old in pairs))
    return best


def expectation(rays: CandidateRays, poses: RoughPoses) -> Expectation:
    """Predict every dwell with every pose, and weigh the candidates."""
    m, (n, k) = len(poses), rays.odds.shape
    points = _true_positions(rays, poses)
    away = points - poses.centres_radar_m[:, None]
    range_m = np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 0.1)
    turned = away / range_m @ np.swapaxes(poses.rotations, 1, 2)
    forward = (rays.rays @ turned[..., None])[..., 0]
    safe = np.maximum(forward, _LEAST_FORWARD)[..., None]
    by_turn = np.concatenate([skews(-turned), np.broadcast_to(poses.rotations[:, None], (m, n, 3, 3))], axis=-1)
    crossed, by_point = np.split((rays.tangents.reshape(n, 2 * k, 3) @ by_turn).reshape(m, n, k, 2, 6), 2, axis=-1)
    off_rad = (rays.tangents.reshape(n, 2 * k, 3) @ turned[..., None]).reshape(m, n, k, 2) / safe
    by_point = by_point / (safe * range_m[:, :, None])[..., None]
    by_polar = (by_point.reshape(m, n, 2 * k, 3) @ rays.slopes).reshape(m, n, k, 2, 3)
    by_scale = -by_polar[..., 1:] * rays.polar[:, None, None, 1:]
    jacobian = np.concatenate([crossed / safe[..., None], -by_point, by_scale], axis=-1)
    factor = np.stack([np.ones_like(poses.noise), poses.noise, poses.noise], axis=-1)
    across = by_polar * (rays.sigma_polar * factor[:, None])[:, :, None, None]
    covariance = across @ np.swapaxes(across, -1, -2) + (rays.sigma_rad**2)[..., None, None] * np.eye(2)
    gain = density(off_rad, covariance) * np.where(forward > _LEAST_FORWARD, rays.odds / rays.density, 0.0)
    total = rays.missing + rays.of_dwells(gain).sum(axis=-1)
    return Expectation(off_rad, jacobian, covariance, gain / rays.of_positions(total)[..., None], np.log(total))


def density(off: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return the density (...) of offsets (..., 2) with covariances (..., 2, 2)."""
    squared = (off * (inverse(covariance) @ off[..., None])[..., 0]).sum(axis=-1)
    return np.asarray(np.exp(-0.5 * squared) / (2.0 * np.pi * np.sqrt(_determinant(covariance))))


def inverse(matrices: np.ndarray) -> np.ndarray:
    """Return the inverses of symmetric matrices (..., 2, 2)."""
    swapped = matrices[..., ::-1, ::-1] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return np.asarray(swapped / _determinant(matrices)[..., None, None])


def _determinant(matrices: np.ndarray) -> np.ndarray:
    return np.asarray(matrices[..., 0, 0] * matrices[..., 1, 1] - matrices[..., 0, 1] ** 2)


def normal_equations(rays: CandidateRays, prior: MountingPrior, poses: RoughPoses) -> tuple[np.ndarray, np.ndarray]:
    """Return the information (m, 8, 8) of the dwells and the prior, and the gradient (m, 8) of the log-probability."""
    seen = expectation(rays, poses)
    weighted = (inverse(seen.covariance) * seen.probability[..., None, None]) @ seen.jacobian
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
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_matrix(poses.rotations @ prior.rotation.T).as_rotvec()
    offsets = np.concatenate([turned, poses.centres_radar_m - prior.centre_radar_m, poses.scales], axis=1)
    sigma = np.concatenate([np.full(3, prior.rotation_sigma_rad), prior.centre_sigma_m, prior.scale_sigma])
    return offsets, sigma**-2.0


def _true_positions(rays: CandidateRays, poses: RoughPoses) -> np.ndarray:
    """Return positions (m, n, 3) with the scales taken out.

    A radar without elevation reports the range to a plane below it as if it lay in that plane; the height is taken from the
    camera's, which stands next to it.
    """
    scaled = rays.polar[:, 1:] * poses.scales[:, None]
    points = rays.positions_radar_m - (rays.slopes[:, :, 1:] @ scaled[..., None])[..., 0]
    if not rays.is_flat:
        return np.asarray(points)
    height_m = poses.centres_radar_m[:, None, 2] - rays.positions_radar_m[:, 2]
    range_m = np.maximum(rays.polar[:, 0], 1e-3)
    return np.asarray(points * np.sqrt(np.maximum(1.0 - (height_m / range_m) ** 2, _LEAST_SHARE_SQUARED))[..., None])


_BEFORE = 1.0
"""Log-odds before any echo: most recordings contain a reflector."""

_LEAST_SEEN = 3
"""Fewer echoes say nothing."""

_STEADY_DB, _RAYLEIGH_DB, _FADING_SPREAD = 1.0, 5.57, 0.5
"""How far the echo of one surface scatters, by the receiver's noise, and that of many which move (Rayleigh's distribution of
amplitudes, in decibels); and the standard deviation of the logarithm of both."""

_WITHOUT_APEX, _APEX_SHARE, _CHANCE_APEX = 0.3, 0.6, 0.05
"""Share of the reflectors that show no apex anywhere, such as boards; of the places of the others that show one; and of those of
people, by chance."""

_PRESENT = 0.5


def reflector_log_odds(views: Sequence[DwellView], agreement: PoseAgreement) -> float:
    """Return the log-odds that what stood there is a reflector and not a person, whose echo fades and who shows no apex.

    Apexes count only where the radar reports no strength: most that are right are too small to be seen, or none.

    Args:
        views: as the agreement was found for, without a click.
        agreement: the dwells with a probable candidate count.
    """
    shown = np.flatnonzero(agreement.probability.max(axis=1) >= _PRESENT)
    fading_db = np.array([view.placement.fading_db for view in views])[shown]
    known_db = fading_db[np.isfinite(fading_db)]
    if not len(known_db):
        apexes = [views[i].candidates[agreement.likeliest[i]].has_apex for i in shown.tolist()]
        each = np.where(apexes, _APEX_SHARE / _CHANCE_APEX, (1.0 - _APEX_SHARE) / (1.0 - _CHANCE_APEX))
        return _BEFORE + float(np.log(_WITHOUT_APEX + (1.0 - _WITHOUT_APEX) * each.prod()))
    if len(known_db) < _LEAST_SEEN:
        return float("inf")
    steady, faded = np.log([_STEADY_DB, _RAYLEIGH_DB])
    off = float(np.clip(np.log(max(np.median(known_db), 1e-3)), steady, faded))
    return _BEFORE + float((faded - off) ** 2 - (steady - off) ** 2) / (2.0 * _FADING_SPREAD**2)
