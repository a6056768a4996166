"""Is a vehicle off its kind by the fleet's prior alone, as when the other vehicles' calibrations are not at hand?"""

import numpy as np

from calib_core.fleet.deviation import Deviation, departure
from calib_core.fleet.mounting_coordinates import coordinate_jacobian, coordinates
from calib_core.fleet_prior import DataAlone, FleetPrior
from calib_core.stated_error import degrees_of_freedom


def prior_test(prior: FleetPrior, alone: DataAlone) -> Deviation:
    """Test a calibration that was made without the prior against it.

    Args:
        prior: of the vehicle's type, without this vehicle.
        alone: the calibration from the data alone.
    """
    mean = prior.camera_from_radar
    to_mounting = coordinate_jacobian(mean, mean)
    own = coordinate_jacobian(alone.camera_from_radar, mean)
    return departure(
        coordinates(alone.camera_from_radar, mean),
        np.asarray(to_mounting @ prior.covariance @ to_mounting.T) / prior.widened,
        np.asarray(own @ alone.covariance @ own.T),
        predicted_freedom=prior.freedom,
        freedom=degrees_of_freedom(alone.covariance_quantile),
    )
