"""The prior that a fleet gives its next vehicle."""

from calib_core.fleet.mounting_coordinates import pose_covariance
from calib_core.fleet.mounting_scatter import MountingScatter
from calib_core.fleet_prior import FleetPrior


def fleet_prior_of(scatter: MountingScatter) -> FleetPrior:
    """Return the distribution of a further vehicle's camera_from_radar.

    Its covariance is scatter plus uncertainty of the mean, widened by the ratio of two 95 % quantiles: that of the squared
    distance of a further vehicle, whose tails are wide because the scatter was estimated, and that of chi2. So the
    ellipsoid of a normal distribution with this covariance contains the next vehicle in 95 % of fleets, averaged over the
    scatters that the data allow.

    Args:
        scatter: of the vehicle type.
    """
    effects, pose = scatter.effects, scatter.camera_from_radar
    wider = effects.widened
    counted = {one.vehicle for one in scatter.mountings}
    return FleetPrior(
        vehicle_type=scatter.vehicle_type,
        camera_from_radar=pose,
        covariance=pose_covariance(wider * effects.covariance, pose),
        vehicles=tuple(sorted(counted)),
        left_out=tuple(sorted({one.mounting.vehicle for one in scatter.left_out} - counted)),
        widened=wider,
        freedom=effects.freedom,
    )
