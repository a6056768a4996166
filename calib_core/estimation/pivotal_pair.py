"""Pivotal pair: the pair without which the others, judged anew, agree on another pose.

A wrong pair can agree with a few others, right or wrong, on a wrong pose and so have pairs set aside that contradict it.
Leaving it out by one Newton step, or with the weights of the others kept, does not show that. Every pair is left out in turn,
all fits run as one batch, and in each the others decide again which of them are inliers.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.pose_posterior import batch_of, pose_posterior
from calib_core.estimation.posterior_samples import refine_poses

_LEAST_MOVE = 2.6  # standard deviations without the pair; sets of right pairs exceed it in at most one of a hundred
_LEAST_PAIRS = 6.0
_MOST_PAIRS = 100  # in larger sets no single pair matters
_ROUNDS = 8


@dataclass(frozen=True, slots=True, eq=False)
class PivotalPair:
    """One pair, and what the pose does without it.

    Attributes:
        pair: its index in the measurements.
        camera_move_m: distance by which the camera centre moves.
        standard_deviations: length of the pose's move under the covariance without it.
        switched: indices of the pairs that are inliers either with it or without it, but not both.
    """

    pair: int
    camera_move_m: float
    standard_deviations: float
    switched: tuple[int, ...] = ()


def find_pivotal_pair(measurements: PairMeasurements, refined: ErrorsInVariablesFit) -> PivotalPair | None:
    """Return the pair on which the pose depends most, if the pose moves far without it.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
    """
    inliers = np.flatnonzero(refined.inliers)
    if refined.weights.sum() < _LEAST_PAIRS or len(measurements) > _MOST_PAIRS:
        return None
    posterior = pose_posterior(measurements, refined.camera_from_radar, np.zeros(3))
    used = np.ones((len(inliers) + 1, len(measurements)), dtype=bool)
    used[1 + np.arange(len(inliers)), inliers] = False
    log_scales = np.tile(np.log(refined.noise_scale), (len(used), 1))
    starts = batch_of([refined.camera_from_radar] * len(used))
    modes = refine_poses(posterior, starts, log_scales, share=refined.inlier_share, used=used, rounds=_ROUNDS)
    whole = modes.poses.transform(0)
    moves = np.array([modes.poses.transform(1 + k).error_from(whole) for k in range(len(inliers))])
    lengths = np.sqrt(np.einsum("ki,kij,kj->k", moves, modes.hessians[1:], moves))
    most = int(np.argmax(lengths))
    if not lengths[most] > _LEAST_MOVE:
        return None
    agree = modes.inlier > 0.5
    switched = np.flatnonzero(agree[0] != agree[1 + most])
    centres = [modes.poses.transform(k).inverse().translation_m for k in (0, 1 + most)]
    return PivotalPair(
        pair=int(inliers[most]),
        camera_move_m=float(np.linalg.norm(centres[1] - centres[0])),
        standard_deviations=float(lengths[most]),
        switched=tuple(switched[switched != inliers[most]].tolist()),
    )
