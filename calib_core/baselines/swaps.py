"""The paper's swaps: the rotation of one calibration with the translation of another, to see which of the two matters."""

import numpy as np

from calib_core.baselines.judging import judged_again
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.results import Calibration, DataWarning


def swapped(rotation_of: Calibration, translation_of: Calibration) -> Calibration:
    """Combine two calibrations of one rig, and judge the result on the pairs of the first; no uncertainty is stated.

    The translation is that of camera_from_radar, in camera axes, as the paper swaps it.

    Args:
        rotation_of: gives rotation, pairs, camera and options.
        translation_of: gives the translation.

    Raises:
        InputError: the two were made with different intrinsics, so they cannot be of one camera.
    """
    first, second = rotation_of.camera, translation_of.camera
    kinds = [(camera.model, camera.width_px, camera.height_px, camera.distortion.shape) for camera in (first, second)]
    one_lens, other_lens = (np.append(camera.matrix_px, camera.distortion) for camera in (first, second))
    if kinds[0] != kinds[1] or not np.allclose(one_lens, other_lens):
        raise InputError(
            "rotation and translation can be combined only for one camera: the two calibrations have different intrinsics; "
            "solve both with the same camera file"
        )
    pose = RigidTransform(rotation_of.camera_from_radar.rotation, translation_of.camera_from_radar.translation_m)
    one, other = rotation_of.options.method, translation_of.options.method
    note = DataWarning(
        "swapped-parts",
        f"this pose has the rotation of a calibration by the method {one}, and the translation of one by the method {other}",
        "use it to see which part causes an error, not as a calibration",
    )
    return judged_again(rotation_of, pose, [note])
