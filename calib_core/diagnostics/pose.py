"""Warnings about the pose as a whole: a second pose, also among the peaks of the posterior or of the pairs set aside, and an
implausible camera position."""

from dataclasses import replace

import numpy as np

from calib_core.arrays import Indices, Values
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.errors_in_variables import fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, associate, mixture_cost
from calib_core.geometry import CM_PER_M, RigidTransform
from calib_core.measurements import Facts
from calib_core.results import DataWarning

_ALMOST_AS_LIKELY = 6.0  # a difference of twice the log-likelihood: a likelihood ratio of 20
_WORTH_REFINING = 40.0  # the same of coarse poses: beyond a ratio of e^20, refining is not worth a fit (a choice)
_AS_A_WHOLE = 12.0  # the same, of the posterior's other peaks and of pairs that were set aside
_OTHER_POSE_SIGMAS, _OTHER_PEAK_SIGMAS = 6.0, 4.0  # nearer ones are the same pose, as its covariance says (a choice)


def two_poses(fit: SolvedFit) -> list[DataWarning]:
    """Warn if two poses explain the pairs about equally well, or if only the expected distance of the camera decides.

    A plane seen from far away has two poses, and so have returns with a constant companion. The scores of the candidates are
    left out of one comparison: what makes the companion echo more than the reflector does so at every placement.
    """
    for other in fit.best.found[1:]:
        if not on_rig(fit, other.camera_from_radar):
            continue
        error = other.camera_from_radar.error_from(fit.refined.camera_from_radar)
        sigmas = _sigmas_away(fit, other.camera_from_radar)
        if sigmas <= _OTHER_POSE_SIGMAS:
            continue
        away = {
            "away_deg": float(np.rad2deg(np.linalg.norm(error[3:]))),
            "away_cm": CM_PER_M * _moved_m(fit, other),
            "sigmas": sigmas,
        }
        if min(other.cost - fit.best.found[0].cost, _cost_without_scores(fit, other)) < _ALMOST_AS_LIKELY:
            return [_two_poses(fit, other, away)]
        if _cost_without_prior(fit, other) < _ALMOST_AS_LIKELY:
            return [_assumed_distance(fit, other, away)]
    return []


def _sigmas_away(fit: SolvedFit, camera_from_radar: RigidTransform) -> float:
    """Return how many standard deviations of the pairs' noise a pose is away from the solved one."""
    error = camera_from_radar.error_from(fit.refined.camera_from_radar)
    return float(np.sqrt(error @ fit.uncertainty.pose_information @ error))


def on_rig(fit: SolvedFit, camera_from_radar: RigidTransform) -> bool:
    """Return whether a pose has the camera as near to the radar as one rig allows; a measured position says where it is."""
    near = float(np.linalg.norm(_camera_centre(camera_from_radar))) <= fit.options.solving.reach_m
    return near or fit.measurements.prior.measured


def _is_as_likely(fit: SolvedFit, camera_from_radar: RigidTransform) -> bool:
    """Return whether a pose explains all pairs about as well as the solved one."""
    here, there = (
        mixture_cost(fit.refined.measurements, one) for one in (fit.refined.camera_from_radar, camera_from_radar)
    )
    return there - here < _AS_A_WHOLE


def _two_poses(fit: SolvedFit, other: GncSolution, away: Facts) -> DataWarning:
    measurements = fit.refined.measurements
    changed = associate(measurements, other.camera_from_radar)[0] != fit.refined.rows
    names = [name for name, differs, inlier in zip(fit.ids, changed, fit.inliers, strict=True) if differs and inlier]
    return DataWarning("two-poses", {**away, "other_returns": names})


def _assumed_distance(fit: SolvedFit, other: GncSolution, away: Facts) -> DataWarning:
    here_m, there_m = (
        float(np.linalg.norm(_camera_centre(one.camera_from_radar))) for one in (fit.best.found[0], other)
    )
    return DataWarning(
        "camera-far-away",
        {**away, "here_m": here_m, "there_m": there_m, "expected_m": fit.measurements.prior.sigma_m},
    )


def _cost_without_scores(fit: SolvedFit, other: GncSolution) -> float:
    """Return how much less likely another pose is if all candidates of a pair are equally plausible."""
    if fit.measurements.one_to_one:
        return np.inf
    share = -np.log(np.diff(fit.measurements.first))[fit.measurements.owner]
    cost = mixture_cost(replace(fit.refined.measurements, log_score=share), fit.refined.camera_from_radar)
    coarse = mixture_cost(replace(fit.refined.measurements, log_score=share), other.camera_from_radar) - cost
    if not _ALMOST_AS_LIKELY <= coarse < _WORTH_REFINING:
        return coarse
    estimate_scale = fit.options.noise.estimate_scale
    equal = replace(fit.measurements, log_score=share)
    there = fit_errors_in_variables(equal, other, estimate_scale=estimate_scale, coarse=True)
    if _sigmas_away(fit, there.camera_from_radar) <= _OTHER_POSE_SIGMAS:
        return np.inf  # refined, it is the same pose
    return mixture_cost(there.measurements, there.camera_from_radar) - cost


def _cost_without_prior(fit: SolvedFit, other: GncSolution) -> float:
    """Return how much less likely another pose is by the pairs alone."""
    prior = fit.measurements.prior
    if prior.measured:
        return np.inf
    by_pairs = [
        one.cost - float(prior.costs(one.camera_from_radar.rotation, one.camera_from_radar.translation_m))
        for one in (other, fit.best.found[0])
    ]
    return by_pairs[0] - by_pairs[1]


def _moved_m(fit: SolvedFit, other: GncSolution) -> float:
    """Return the distance between the camera centers of the solved pose and another."""
    here, there = _camera_centre(fit.refined.camera_from_radar), _camera_centre(other.camera_from_radar)
    return float(np.linalg.norm(here - there))


def possible_poses(fit: SolvedFit) -> list[DataWarning]:
    """Warn if the posterior has several separate peaks."""
    for other in fit.alternatives.possible:
        if other.sigmas > _OTHER_PEAK_SIGMAS and on_rig(fit, other.camera_from_radar):
            error = other.camera_from_radar.error_from(fit.refined.camera_from_radar)
            return [DataWarning("two-poses", {**_away(error), "probability": other.probability})]
    return []


def agreeing_outliers(fit: SolvedFit) -> list[DataWarning]:
    """Name the outliers that agree among themselves on another pose."""
    outliers = fit.alternatives.agreeing
    if outliers is None:
        return []
    names = [fit.ids[i] for i in outliers.pairs]
    pose = outliers.camera_from_radar
    if on_rig(fit, pose) and _is_as_likely(fit, pose):
        return [DataWarning("two-poses", {**_away(outliers.difference), "agreeing": names, "pairs": len(fit.ids)})]
    return [DataWarning("agreeing-outliers", {"ids": names, "in_time": _in_time(fit, outliers.pairs)})]


def _in_time(fit: SolvedFit, pairs: Indices) -> str:
    """Return whether pairs are the "first" or the "last" in time, as after a turn of a sensor; "" if others lie between."""
    times = np.array([time or 0 for time in fit.times])
    aside, used = times[pairs], times[fit.inliers]
    if not (0 < aside.max() < used.min() or 0 < used.max() < aside.min()):
        return ""
    return "first" if aside.max() < used.min() else "last"


def _away(error: Values) -> Facts:
    """Return how far a pose error (6,) is."""
    return {
        "away_deg": float(np.rad2deg(np.linalg.norm(error[3:]))),
        "away_cm": CM_PER_M * float(np.linalg.norm(error[:3])),
    }


_DOUBTFUL, _CONTRADICTED = 0.02, 0.001
"""Shares of right positions that are as far from the camera of the pairs."""


def camera_position(fit: SolvedFit) -> list[DataWarning]:
    """Say that the pairs doubt or contradict the measured camera position, and how much the pose still uses it."""
    position = fit.best.position
    if position is None or position.chance >= _DOUBTFUL:
        return []
    facts = {
        "away_cm": CM_PER_M * position.away_m,
        "sigmas": position.sigmas,
        "misread": position.misread,
        "unit": position.unit,
        "weight": position.probability,
    }
    if position.chance < _CONTRADICTED:
        return [DataWarning("camera-position-contradicted", facts)]
    return [DataWarning("camera-position-doubtful", facts | {"one_in": round(1.0 / position.chance)})]


def _camera_centre(camera_from_radar: RigidTransform) -> np.ndarray:
    return camera_from_radar.inverse().translation_m
