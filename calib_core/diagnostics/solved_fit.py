"""The input of the checks of a calibration, in one value."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.arrays import Flags
from calib_core.estimation.beyond_the_fit import BeyondTheFit
from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import GncSolution
from calib_core.estimation.influential_pairs import InfluentialPair
from calib_core.estimation.leave_one_out import LeaveOneOut
from calib_core.estimation.measured_position import ContradictedPosition
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.options import CalibrationOptions


@dataclass(frozen=True, slots=True, eq=False)
class SolvedFit:
    """The input of the checks.

    Attributes:
        ids: of the used pairs, in the order of the measurements.
        measurements: with the assumed noise.
        refined: the fit.
        uncertainty: of its pose.
        left_out: leave-one-out.
        influential_pairs: the pairs that the pose depends on and the others contradict.
        inliers: (n,) which pairs took part.
        alternatives: the GNC solutions of all starts, the most likely first.
        mirror_gain: gain in twice the log-likelihood with mirrored radar axes; negative if they fit worse.
        chi2_per_degree: chi2 per degree of freedom under the assumed noise.
        options: of the calibration.
        beyond: what the fit and its covariance do not show.
        contradicted: the measured camera position, if the pairs contradict it; it is then a weak prior of the fit.
    """

    ids: tuple[str, ...]
    measurements: PairMeasurements
    refined: ErrorsInVariablesFit
    uncertainty: PoseCovariance
    left_out: LeaveOneOut
    influential_pairs: Sequence[InfluentialPair]
    inliers: Flags
    alternatives: Sequence[GncSolution]
    mirror_gain: float
    chi2_per_degree: float
    options: CalibrationOptions
    beyond: BeyondTheFit
    contradicted: ContradictedPosition | None
