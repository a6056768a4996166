"""Pose agreement: the pose on which dwells and candidates agree, and how probable each candidate is under it.

A candidate is judged by the pose that all other dwells give, with its covariance, so that no dwell vouches for itself.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, frozen_array
from calib_core.geometry import RigidTransform
from calib_core.proposing.agreement.candidate_rays import CandidateRays
from calib_core.proposing.agreement.mounting_prior import MountingPrior
from calib_core.proposing.agreement.pose_refinement import (
    RoughPoses,
    densities,
    expectation,
    normal_equations,
    refined_poses,
)
from calib_core.proposing.agreement.rotation_consensus import rotation_consensus

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
        probability: (n, k) that each candidate is the reflector, judged by the other dwells.
        rival_probability: (n, k) the same under the rival.
        off_sigma: (n, k) distance of each candidate from where the other dwells predict it, in standard deviations.
        trials: how many rotations were compared.
    """

    camera_from_radar: RigidTransform
    score: float
    rival_score: float
    noise: float
    probability: Points2
    rival_probability: Points2
    off_sigma: Points2
    trials: int

    def __post_init__(self) -> None:
        for name in ("probability", "rival_probability", "off_sigma"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (None, None)))

    @property
    def likeliest(self) -> Indices:
        """The most probable candidate of each dwell (n,)."""
        return np.argmax(self.probability, axis=1)

    @property
    def pose_probability(self) -> float:
        """Probability of the pose against its rival."""
        return float(1.0 / (1.0 + np.exp(min((self.rival_score - self.score) / _RIVAL_STEP, 50.0))))

    def agreeing(self, rays: CandidateRays) -> float:
        """Return the share of the dwells that have candidates which agree on the pose."""
        return _share(rays, self.probability)

    def agreeing_with_rival(self, rays: CandidateRays) -> float:
        """Return the same for the rival."""
        return _share(rays, self.rival_probability)


def pose_agreement(rays: CandidateRays, prior: MountingPrior, *, most: int = 24) -> PoseAgreement | None:
    """Find the pose; None with fewer than two dwells that have candidates, or if no two of them agree on a mounting.

    Args:
        rays: of all dwells.
        prior: of the mounting.
        most: how many rough rotations are refined.
    """
    if int((rays.odds > 0.0).any(axis=1).sum()) < _LEAST_DWELLS:
        return None
    rough = rotation_consensus(rays, prior, most=most)
    if not len(rough.scores):
        return None
    poses = refined_poses(rays, prior, rough)
    best = int(np.argmax(poses.scores))
    other = np.flatnonzero(_differs(rays, poses, best))
    rival = int(other[np.argmax(poses.scores[other])]) if len(other) else None
    probability, off_sigma = _judged_by_others(rays, prior, _one(poses, best))
    rival_probability = np.zeros_like(probability)
    if rival is not None:
        rival_probability = _judged_by_others(rays, prior, _one(poses, rival))[0]
    rotation, centre = poses.rotations[best], poses.centres_radar_m[best]
    return PoseAgreement(
        camera_from_radar=RigidTransform(rotation, -rotation @ centre),
        score=float(poses.scores[best]),
        rival_score=0.0 if rival is None else float(poses.scores[rival]),
        noise=float(poses.noise[best]),
        probability=probability,
        rival_probability=rival_probability,
        off_sigma=off_sigma,
        trials=rough.tried,
    )


def _one(poses: RoughPoses, row: int) -> RoughPoses:
    keep = slice(row, row + 1)
    return RoughPoses(
        poses.rotations[keep], poses.centres_radar_m[keep], poses.scales[keep], poses.noise[keep], poses.scores[keep]
    )


def _differs(rays: CandidateRays, poses: RoughPoses, best: int) -> Flags:
    """Return which poses (m,) predict clearly other directions than the best one."""
    away = rays.positions_radar_m[None] - poses.centres_radar_m[:, None]
    away = away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-6)
    turned = np.einsum("mij,mnj->mni", poses.rotations, away)
    cosine = np.clip((turned * turned[best]).sum(axis=-1), -1.0, 1.0)
    return np.asarray(np.arccos(cosine).mean(axis=1) > _OTHER_POSE_RAD)


def _judged_by_others(rays: CandidateRays, prior: MountingPrior, pose: RoughPoses) -> tuple[Points2, Points2]:
    """Return the probability of each candidate (n, k) under the pose of the other dwells, and its distance from it."""
    seen = expectation(rays, pose)
    off_rad, jacobian, covariance = seen.off_rad[0], seen.jacobian[0], seen.covariance[0]
    information = normal_equations(rays, prior, pose)[0][0]
    weight = np.linalg.inv(covariance) * seen.weight[0][..., None, None]
    own = np.einsum("nkap,nkab,nkbq->npq", jacobian, weight, jacobian)
    pull = np.einsum("nkap,nkab,nkb->np", jacobian, weight, off_rad)
    without = np.linalg.inv(information - own)
    shift = np.einsum("npq,nq->np", without, pull)
    off_rad = off_rad + np.einsum("nkap,np->nka", jacobian, shift)
    covariance = covariance + np.einsum("nkap,npq,nkbq->nkab", jacobian, without, jacobian)
    gain = sum(densities(off_rad, covariance)) * rays.odds / rays.density
    squared = np.einsum("nka,nkab,nkb->nk", off_rad, np.linalg.inv(covariance), off_rad)
    probability = gain / (rays.missing + gain.sum(axis=1))[:, None]
    return probability, np.sqrt(np.maximum(squared, 0.0))


def _share(rays: CandidateRays, probability: Points2) -> float:
    with_any = (rays.odds > 0.0).any(axis=1)
    return float(probability.max(axis=1)[with_any].sum() / max(int(with_any.sum()), 1))
