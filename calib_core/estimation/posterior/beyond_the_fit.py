"""Beyond the fit: the posterior away from the fitted peak, at the systematic errors that the fit found."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import GncSolution
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.posterior.agreeing_outliers import AgreeingOutliers, find_agreeing_outliers
from calib_core.estimation.posterior.pivotal_pair import PivotalPair, find_pivotal_pair
from calib_core.estimation.posterior.samples import sample_posterior
from calib_core.estimation.posterior.summary import PossiblePose, possible_poses, summarize_posterior

_MOST_PAIRS = 150  # in larger sets the posterior has one peak, and samples cost seconds


@dataclass(frozen=True, slots=True, eq=False)
class BeyondTheFit:
    """What the fit and its covariance do not show.

    Attributes:
        refined: the fit, at the mean of the posterior where the peak does not describe it.
        uncertainty: of its pose, from the samples where the local one does not hold.
        possible: separate poses, the most probable first; empty if the posterior was not sampled.
        pivotal: the pair without which the others agree on another pose.
        agreeing: outliers that agree among themselves on another pose.
    """

    refined: ErrorsInVariablesFit
    uncertainty: PoseCovariance
    possible: tuple[PossiblePose, ...] = ()
    pivotal: PivotalPair | None = None
    agreeing: AgreeingOutliers | None = None


def look_beyond(
    measurements: PairMeasurements,
    refined: ErrorsInVariablesFit,
    uncertainty: PoseCovariance,
    others: Sequence[GncSolution],
    *,
    seed: int,
) -> BeyondTheFit:
    """Sample the posterior, and look for the pair that all rests on and for outliers that agree.

    The posterior is that of the pose at the fitted systematic errors; what these add to the covariance is added to each sample.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        uncertainty: of its pose.
        others: the solutions of other starts.
        seed: of the random draws.
    """
    rng = np.random.default_rng(seed)
    corrected = measurements.with_errors(refined.measurements.errors.values)
    beyond = BeyondTheFit(
        refined,
        uncertainty,
        pivotal=find_pivotal_pair(corrected, refined),
        agreeing=find_agreeing_outliers(corrected, refined, rng=rng),
    )
    if measurements.prior.measured or measurements.flat or len(measurements) > _MOST_PAIRS:
        return beyond
    alone = np.linalg.inv(uncertainty.information[:6, :6])
    poses = [one.camera_from_radar for one in others]
    drawn = sample_posterior(corrected, refined, alone, poses, rng=rng)
    shared = _positive(uncertainty.covariance - alone)
    summary = summarize_posterior(
        drawn, refined.camera_from_radar, uncertainty.covariance, uncertainty.quantile, shared=shared, rng=rng
    )
    beyond = replace(beyond, possible=possible_poses(drawn))
    if summary.local_holds:
        return beyond
    return replace(
        beyond,
        refined=replace(refined, camera_from_radar=summary.camera_from_radar),
        uncertainty=replace(uncertainty, covariance=summary.covariance, quantile=summary.quantile),
    )


def _positive(covariance: Matrix66) -> Matrix66:
    """Return the nearest covariance without negative variances."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
