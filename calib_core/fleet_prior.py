"""What a fleet says about its next vehicle, as a prior, and what that prior did to a calibration."""

from dataclasses import dataclass

from calib_core.arrays import Matrix66, frozen_array
from calib_core.covariance_parts import CovarianceParts
from calib_core.geometry import RigidTransform


@dataclass(frozen=True, slots=True, eq=False)
class FleetPrior:
    """The distribution of camera_from_radar over the vehicles of one type, as a prior for another one.

    Attributes:
        vehicle_type: its name.
        camera_from_radar: the mean pose of the type.
        covariance: (6, 6) of a further vehicle about that mean: the scatter of the mountings and the uncertainty of the mean
            [m, rad], in the order and convention of `Calibration.covariance`; widened for the scatter being an estimate.
        vehicles: names of the vehicles it rests on, in order.
        left_out: names of those that were not counted, in order.
        widened: the factor by which that made the covariance wider; at least 1.
        freedom: degrees of freedom of the estimated scatter; infinite if it is known.
    """

    vehicle_type: str
    camera_from_radar: RigidTransform
    covariance: Matrix66
    vehicles: tuple[str, ...]
    left_out: tuple[str, ...] = ()
    widened: float = 1.0
    freedom: float = float("inf")

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", frozen_array(self.covariance, (6, 6)))

    @property
    def named(self) -> str:
        """Which prior it is, within a sentence: "prior of type van (5 vehicles)"."""
        count = len(self.vehicles)
        return f"prior of type {self.vehicle_type} ({count} {'vehicle' if count == 1 else 'vehicles'})"


@dataclass(frozen=True, slots=True, eq=False)
class DataAlone:
    """The answer of the pairs without the fleet's prior.

    Attributes:
        camera_from_radar: the pose.
        covariance: (6, 6) of its error, as `Calibration.covariance`.
        covariance_quantile: the factor on covariance that gives the 95 % ellipsoid.
        verdict: the level of the verdict on it, such as "usable"; "" if nobody judged it.
        reason: why it is of that level, or the error that it states; "" if unknown.
        covariance_parts: what of the covariance rests on stated standard deviations; None if unknown.
    """

    camera_from_radar: RigidTransform
    covariance: Matrix66
    covariance_quantile: float
    verdict: str = ""
    reason: str = ""
    covariance_parts: CovarianceParts | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", frozen_array(self.covariance, (6, 6)))


@dataclass(frozen=True, slots=True, eq=False)
class FleetAnswer:
    """What a fleet's prior did to a calibration.

    Attributes:
        prior: the prior that was given.
        used: the pose rests on it; False if the vehicle is off its kind, so that the pose is that of the data alone.
        data_alone: the answer without it; None if the data alone give no pose, so that nothing tests the prior.
        squared: squared Mahalanobis distance of that answer from the prior's mean; NaN if it was not tested.
        limit: its 1-in-10,000 point; NaN if it was not tested.
    """

    prior: FleetPrior
    used: bool
    data_alone: DataAlone | None
    squared: float = float("nan")
    limit: float = float("nan")
