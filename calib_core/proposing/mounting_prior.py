"""Mounting prior: where a camera next to a radar may be, and how far it may be turned from its nominal mounting."""

from dataclasses import astuple, dataclass

import numpy as np

from calib_core.arrays import Matrix33, Values, Vector3, freeze
from calib_core.geometry import mounting_rotation
from calib_core.options import CalibrationOptions

MOST_TURNED_RAD = float(np.radians(26.0))
"""Largest rotation away from the nominal mounting."""
_TURNED_SIGMA_RAD = np.radians(9.0)
_LEVER_SIGMA_M = 0.25
"""Standard deviation per axis of the camera's position about the radar's, if nobody measured it."""
_HEIGHTS_M = (0.3, 0.8, 1.3, 1.9)
"""Heights of the camera above the plane of the placements that are tried with a radar that measures no elevation."""


@dataclass(frozen=True, slots=True, eq=False)
class MountingPrior:
    """What is known of the pose before any dwell.

    Attributes:
        rotation: (3, 3) camera from radar, nominal.
        rotation_sigma_rad: per axis.
        centre_radar_m: (3,) the camera's position.
        centre_sigma_m: (3,) per radar axis.
        starts_m: (s, 3) positions of the camera to start from.
        scale_sigma: (2,) of the scales of azimuth and elevation.
    """

    rotation: Matrix33
    rotation_sigma_rad: float
    centre_radar_m: Vector3
    centre_sigma_m: Vector3
    starts_m: np.ndarray
    scale_sigma: Values

    def __post_init__(self) -> None:
        freeze(self, rotation=(3, 3), centre_radar_m=(3,), centre_sigma_m=(3,), starts_m=(None, 3), scale_sigma=(2,))


def mounting_prior(options: CalibrationOptions, *, is_flat: bool) -> MountingPrior:
    """Return the prior of the mounting that the options state.

    Args:
        options: nominal angles, measured position, scale errors of the radar.
        is_flat: the radar measures no elevation, so that its height above the placements is open.
    """
    measured = options.solving.camera_position
    centre = np.zeros(3) if measured is None else np.array(measured.position_m)
    sigma = np.full(3, _LEVER_SIGMA_M if measured is None else max(measured.sigma_m, 0.02))
    starts = centre[None]
    if is_flat:
        sigma = np.array([sigma[0], sigma[1], np.hypot(sigma[2], options.radar.height_sigma_m)])
        starts = centre + np.outer(_HEIGHTS_M, [0.0, 0.0, 1.0])
    return MountingPrior(
        rotation=mounting_rotation(*astuple(options.mounting)),
        rotation_sigma_rad=float(_TURNED_SIGMA_RAD),
        centre_radar_m=centre,
        centre_sigma_m=sigma,
        starts_m=starts,
        scale_sigma=np.maximum([options.radar.azimuth_scale_sigma, options.radar.elevation_scale_sigma], 1e-4),
    )
