"""The input of the checks of a calibration, in one value."""

from dataclasses import dataclass

from calib_core.arrays import Flags
from calib_core.estimation.alternative_poses import PoseAlternatives
from calib_core.estimation.best_fit import BestFit
from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.leave_one_out import LeaveOneOut
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.measurements import TimeNs
from calib_core.options import CalibrationOptions


@dataclass(frozen=True, slots=True, eq=False)
class SolvedFit:
    """The input of the checks.

    Attributes:
        ids: of the used pairs, in the order of the measurements.
        times: of their frames, ascending; None for pairs from a pairs file.
        measurements: with the assumed noise.
        refined: the fit.
        uncertainty: of its pose.
        left_out: leave-one-out.
        inliers: (n,) which pairs took part.
        best: the fit and the solutions of other starts, as the solver found them.
        chi2_per_degree: chi2 per degree of freedom under the assumed noise.
        options: of the calibration.
        alternatives: what the fit and its covariance do not show.
    """

    ids: tuple[str, ...]
    times: tuple[TimeNs | None, ...]
    measurements: PairMeasurements
    refined: ErrorsInVariablesFit
    uncertainty: PoseCovariance
    left_out: LeaveOneOut
    inliers: Flags
    best: BestFit
    chi2_per_degree: float
    options: CalibrationOptions
    alternatives: PoseAlternatives
