"""PMM, the paper's baseline by mounting: rotation and offset as designed or measured, and no data at all."""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Matrix33
from calib_core.baselines.judging import judged
from calib_core.camera import Camera
from calib_core.geometry import OPTICAL_FROM_LINK, RigidTransform, rotation_from_euler
from calib_core.measurements import Pair, Unpaired, Unsolvable
from calib_core.options import CalibrationOptions, MountingOptions
from calib_core.results import Calibration


def mounting_rotation(options: MountingOptions) -> Matrix33:
    """Return the rotation of camera_from_radar of a camera that is mounted at these angles."""
    angles = np.deg2rad([options.roll_deg, options.pitch_deg, options.yaw_deg])
    return np.asarray(OPTICAL_FROM_LINK @ rotation_from_euler(*angles).T)


def calibrate_by_mounting(
    pairs: Sequence[Pair],
    camera: Camera,
    options: CalibrationOptions,
    *,
    excluded: frozenset[str] = frozenset(),
    unpaired: tuple[Unpaired, ...] = (),
) -> Calibration | Unsolvable:
    """Return the pose of the mounting, judged on pairs that it does not depend on; there may be none.

    Args:
        pairs: in the order of the results.
        camera: the intrinsics.
        options: the mounting's angles, and the measured position of the camera.
        excluded: ids of pairs that are shown, but not judged on.
        unpaired: clicks without a radar position.
    """
    measured = options.solving.camera_position
    if measured is None:
        return Unsolvable(
            "no-camera-position",
            "the method pmm takes the camera's position from a tape measure, and none is given",
            "measure from the radar's antennas to the lens: forward, left, up, in metres, and state it (--camera-position-m)",
            unpaired,
            tuple(pairs),
        )
    rotation = mounting_rotation(options.mounting)
    pose = RigidTransform(rotation, -rotation @ np.array(measured.position_m))
    return judged(pose, pairs, unpaired, excluded, camera, options)
