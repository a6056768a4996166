"""Agreeing outliers: pairs that were set aside, but agree among themselves on another pose.

Wrong pairs are wrong in different ways. If several agree, something stands where they say: a companion of the reflector such
as a cart, or a second reflector; or the pairs that were used are the wrong ones. Whether the agreement is more than chance is
told by the ratio of two probabilities of the outliers' pixels, with a common pose and without one. The first is integrated
over the pose by Laplace's method, from a prior in which all rotations are equally likely:

    log B = log p(pixels | pose, prior of the camera) - log(8 pi^2) + 3 log(2 pi) - log det(H) / 2.                     (7)

Outliers without a common pose reach a ratio of B in at most one of B sets.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Values
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import solve_gnc
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.posterior.modes import Modes, refine_poses
from calib_core.estimation.posterior.pose_batch import batch_of
from calib_core.estimation.posterior.pose_posterior import pose_posterior
from calib_core.geometry import RigidTransform

_LEAST_PAIRS = 4  # three always agree
_LEAST_LOG_RATIO = float(np.log(100.0))
_STARTS = 12
_ROUNDS = 15
_SHARE = 0.5  # of the outliers that may belong to the group
_MOST_OUTLIERS = 150


@dataclass(frozen=True, slots=True, eq=False)
class AgreeingOutliers:
    """Outliers with a pose in common.

    Attributes:
        pairs: their indices in the measurements.
        camera_from_radar: their pose.
        difference: (6,) of that pose from the fit, (dt, dtheta) [m, rad].
        camera_move_m: distance between the two camera centres.
        log_ratio: logarithm of the ratio of their probabilities with and without a common pose.
    """

    pairs: Indices
    camera_from_radar: RigidTransform
    difference: Values
    camera_move_m: float
    log_ratio: float


def find_agreeing_outliers(
    measurements: PairMeasurements, refined: ErrorsInVariablesFit, *, rng: "np.random.Generator"
) -> AgreeingOutliers | None:
    """Look among the outliers of a fit for pairs that agree on another pose.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        rng: random generator of the hypotheses.
    """
    outliers = np.flatnonzero(~refined.inliers)
    if not _LEAST_PAIRS <= len(outliers) <= _MOST_OUTLIERS:
        return None
    # a companion's camera may be anywhere
    free = replace(measurements, prior=measurements.prior.weakened()).some(outliers)
    starts = _starts(free, refined.camera_from_radar, rng)
    used = np.ones((len(starts), len(free)), dtype=bool)
    posterior = pose_posterior(free, refined.camera_from_radar, np.zeros(3))
    as_assumed = np.zeros((len(starts), 4))
    modes = refine_poses(posterior, batch_of(starts), as_assumed, share=_SHARE, used=used, rounds=_ROUNDS)
    agree = modes.inlier > 0.5
    ratios = np.where(agree.sum(axis=1) >= _LEAST_PAIRS, _log_ratios(modes, free.prior.sigma_m), -np.inf)
    best = int(np.argmax(ratios))
    if not ratios[best] > _LEAST_LOG_RATIO:
        return None
    pose = modes.poses.transform(best)
    centres = [one.inverse().translation_m for one in (pose, refined.camera_from_radar)]
    return AgreeingOutliers(
        pairs=outliers[agree[best]],
        camera_from_radar=pose,
        difference=pose.error_from(refined.camera_from_radar),
        camera_move_m=float(np.linalg.norm(centres[0] - centres[1])),
        log_ratio=float(ratios[best]),
    )


def _starts(
    outliers: PairMeasurements, fitted: RigidTransform, rng: "np.random.Generator"
) -> tuple[RigidTransform, ...]:
    """Return hypotheses from few pairs, as drawn and refined, and the fit: a companion's pose is often near it."""
    drawn = initial_poses(outliers, most=_STARTS, rng=rng)
    return (fitted, *drawn, *(one.camera_from_radar for one in solve_gnc(outliers, drawn, estimate_scale=False)))


def _log_ratios(modes: Modes, sigma_m: float) -> Values:
    """Return equation (7) of each mode; the camera prior's density is 1 / (pi^2 sigma^3) at its centre."""
    prior = -np.log(8.0 * np.pi**2) - np.log(np.pi**2 * sigma_m**3)
    return np.asarray(modes.evidence + prior + 3.0 * np.log(2.0 * np.pi) - 0.5 * np.linalg.slogdet(modes.hessians)[1])
