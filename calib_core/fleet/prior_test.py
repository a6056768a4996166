"""Is a vehicle off its kind by the fleet's prior alone, as when the other vehicles' calibrations are not at hand?"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.fleet.session_pose import CHI2_95
from calib_core.fleet.tails import FALSE_RATE, quantile
from calib_core.fleet_prior import FleetPrior
from calib_core.geometry import RigidTransform

__all__ = ["PriorTest", "prior_test"]

_WHOLE, _MOST_OF_FREEDOM, _LEAST_FREEDOM = 5.0, 0.8, 2.0


@dataclass(frozen=True, slots=True)
class PriorTest:
    """A calibration compared with a fleet's prior.

    Attributes:
        squared: squared Mahalanobis distance from the prior's mean, under the sum of both covariances.
        limit: the 1-in-10,000 point over six degrees of freedom.
    """

    squared: float
    limit: float

    @property
    def is_off(self) -> bool:
        """Whether the vehicle is off its kind."""
        return self.squared > self.limit


def prior_test(prior: FleetPrior, camera_from_radar: RigidTransform, covariance: Matrix66) -> PriorTest:
    """Test a calibration that was made without the prior.

    The prior's covariance is widened so that its normal ellipsoid holds 95 % of further vehicles; the limit is as much farther
    out as the 1-in-10,000 point is in a fleet of its size, with one degree of freedom for each vehicle but one.

    Args:
        prior: of the vehicle's type, without this vehicle.
        camera_from_radar: from the data alone.
        covariance: (6, 6) of that [m, rad].
    """
    error = camera_from_radar.error_from(prior.camera_from_radar)
    squared = float(error @ np.linalg.solve(prior.covariance + covariance, error))
    freedom = max(len(prior.vehicles) - 1.0, _LEAST_FREEDOM)
    whole = min(_WHOLE, _MOST_OF_FREEDOM * freedom)
    ratio = quantile(1.0 - FALSE_RATE, freedom, whole=whole) / quantile(0.95, freedom, whole=whole)
    return PriorTest(squared, CHI2_95 * ratio)
