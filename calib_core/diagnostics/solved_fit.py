"""All that the checks of a calibration look at, in one value."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.arrays import Flags
from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import GncSolution
from calib_core.estimation.influential_pairs import InfluentialPair
from calib_core.estimation.leave_one_out import LeaveOneOut
from calib_core.estimation.measurement_model import PairMeasurements

__all__ = ["SolvedFit"]


@dataclass(frozen=True, slots=True, eq=False)
class SolvedFit:
    """All that the checks look at.

    Attributes:
        ids: of the used pairs, in the order of the measurements.
        measurements: with the noise as assumed.
        refined: the fit.
        uncertainty: of its pose.
        left_out: leave-one-out.
        doubts: the pairs that the others contradict.
        inliers: (n,) which pairs took part.
        alternatives: where the other starts ended, the most likely first.
        mirror_gain: by how much mirrored radar axes explain the pairs better; negative: worse.
        chi2_per_degree: by the noise as assumed.
    """

    ids: tuple[str, ...]
    measurements: PairMeasurements
    refined: ErrorsInVariablesFit
    uncertainty: PoseCovariance
    left_out: LeaveOneOut
    doubts: Sequence[InfluentialPair]
    inliers: Flags
    alternatives: Sequence[GncSolution]
    mirror_gain: float
    chi2_per_degree: float
