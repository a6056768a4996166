"""The warning about a radar that measures no elevation."""

import numpy as np

from calib_core.diagnostics.uncertainty_map import picture_sigma_px
from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.options import RadarOptions
from calib_core.results import DataWarning
from calib_core.results.radar_axes import sigma_in_radar_axes, without_mounting


def flat_radar(refined: ErrorsInVariablesFit, uncertainty: PoseCovariance, radar: RadarOptions) -> list[DataWarning]:
    """Say what the pairs of a radar without elevation determine, and what depends on how it is mounted.

    Args:
        refined: the fit.
        uncertainty: its covariance.
        radar: priors of the mounting.
    """
    if not refined.measurements.flat:
        return []
    pose, stated = refined.camera_from_radar, uncertainty.covariance
    firm = sigma_in_radar_axes(pose, without_mounting(pose, stated, refined.placements_z_m, radar))
    (forward, left), yaw = 100.0 * firm.position_m[:2], np.rad2deg(firm.rotation_rad[2])
    assumed = sigma_in_radar_axes(pose, stated)
    up, (roll, pitch) = 100.0 * assumed.position_m[2], np.rad2deg(assumed.rotation_rad[:2])
    return [
        DataWarning(
            "flat-radar",
            f"this radar measures no elevation. One sigma: the pairs determine forward ± {forward:.0f} cm, left ± {left:.0f} cm "
            f"and yaw ± {yaw:.1f} deg in the plane of the placements, and where its returns appear in the picture, "
            f"± {picture_sigma_px(refined, uncertainty):.0f} px; up ± {up:.0f} cm, pitch ± {pitch:.1f} and roll "
            f"± {roll:.1f} deg are assumptions about how it is mounted",
            "state among the options how well the radar's tilt and height are known, or measure the camera position; if the "
            "radar does measure elevation, find out why it is missing",
        )
    ]
