"""The uncertainty in the picture: how far off the reprojection of a placement may be."""

import numpy as np

from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit


def picture_sigma_px(refined: ErrorsInVariablesFit, uncertainty: PoseCovariance) -> float:
    """Return the standard deviation per axis [px] of a reprojection, root mean square over the inlier placements.

    Pose and radar errors are uncertain together, and mostly cancel in the picture: a radar without elevation may be tilted by
    degrees, but where its returns appear is known to pixels. The noise of a single radar position is not included.
    """
    inliers = refined.inliers
    jacobian = refined.model.jacobian[inliers].copy()
    for k, error in enumerate(refined.measurements.errors.estimated):
        if error.axis is not None:  # the reflector's offset moves the click, not the reprojection
            jacobian[:, :, 6 + k] = 0.0
    jacobian_px = np.linalg.solve(refined.model.whitening[inliers], jacobian)
    variances = (jacobian_px @ np.linalg.inv(uncertainty.information)) * jacobian_px
    return float(np.sqrt(variances.sum(axis=(1, 2)).mean() / 2.0)) * uncertainty.growth
