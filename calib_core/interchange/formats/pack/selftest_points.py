"""The ten radar points of a pack's self-test: reported positions and the pixels they project to."""

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Points3
from calib_core.errors import InputError
from calib_core.interchange.syntax.yaml_text import number_text
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration

_POINTS = 10
_PICTURE_SHARES = (0.06, 0.28, 0.5, 0.72, 0.94)
_RANGES_M = (4.0, 8.0, 15.0, 30.0, 60.0, 11.0, 22.0)  # as many as have no divisor in common with the rows and columns
_SAME = 1e-3
_COLUMNS = "x_m,y_m,z_m,u_raw_px,v_raw_px,u_px,v_px"


def selftest_csv(calibration: Calibration) -> str:
    """Write ten reported radar positions, their pixels by the pose alone, and with the radar's errors taken out.

    They are inliers spread over directions and ranges; where there are fewer than ten, points spread over the picture follow.

    Raises:
        InputError: the lens images no point.
    """
    inliers = sorted((pair for pair in calibration.pairs if pair.inlier), key=lambda pair: pair.id)
    measured_m = np.round(np.array([pair.point_radar_m for pair in inliers]).reshape(-1, 3), 3)
    over_the_picture_m = _points_over_the_picture(calibration)
    points_radar_m = np.zeros((0, 3))
    for candidates_m in (measured_m[_imaged(calibration, measured_m)], over_the_picture_m):
        points_radar_m = _spread(points_radar_m, candidates_m)
    if not len(points_radar_m):
        raise InputError(
            "the lens images no point of the picture, so the pack's self-test has nothing to project; correct the camera, "
            "or export json"
        )
    raw_px, corrected_px = _pixels(calibration, points_radar_m)
    rows = np.hstack([points_radar_m, raw_px, corrected_px])
    return "\n".join([_COLUMNS, *(",".join(map(number_text, row)) for row in rows), ""])


def _pixels(calibration: Calibration, points_radar_m: Points3) -> tuple[Points2, Points2]:
    """Return the pixels of reported positions by the pose alone, and with the radar's errors taken out."""
    true_m = calibration.radar_errors.corrected(points_radar_m)
    if calibration.angle_map is not None:
        true_m = calibration.angle_map.corrected(true_m)
    pose, camera = calibration.camera_from_radar, calibration.camera
    return camera.project(pose @ points_radar_m), camera.project(pose @ true_m)


def _points_over_the_picture(calibration: Calibration) -> Points3:
    """Return points at several ranges on a grid of pixels that the lens images; the corrected ones may be outside the picture."""
    camera = calibration.camera
    u, v = np.meshgrid(np.array(_PICTURE_SHARES) * camera.width_px, np.array(_PICTURE_SHARES) * camera.height_px)
    rays = camera.rays(np.stack([u.ravel(), v.ravel()], axis=1))
    points_camera_m = rays * np.resize(_RANGES_M, len(rays))[:, None]
    points_radar_m = np.round(calibration.camera_from_radar.inverse() @ points_camera_m, 3)
    return points_radar_m[_imaged(calibration, points_radar_m)]


def _imaged(calibration: Calibration, points_radar_m: Points3) -> Flags:
    """Return which reported positions the lens images by the pose alone, and project to a pixel when corrected, too."""
    raw_px, corrected_px = _pixels(calibration, points_radar_m)
    seen = calibration.camera.sees(calibration.camera_from_radar @ points_radar_m)
    return seen & np.isfinite(raw_px).all(axis=1) & np.isfinite(corrected_px).all(axis=1)


def _spread(chosen_m: Points3, candidates_m: Points3) -> Points3:
    """Add to the chosen points those candidates that are farthest from all chosen so far, until there are ten."""
    points_m = np.vstack([chosen_m, candidates_m])
    polar = polar_from_cartesian(points_m)
    places = np.column_stack([np.log(np.maximum(polar[:, 0], 1e-6)) / 2.0, polar[:, 1:]])
    indices: Indices = np.arange(len(chosen_m))
    while len(indices) < min(_POINTS, len(points_m)):
        if len(indices):
            distances = np.linalg.norm(places[:, None] - places[indices], axis=2).min(axis=1)
        else:
            distances = np.linalg.norm(places - places.mean(axis=0), axis=1) + _SAME
        farthest = int(np.argmax(distances))
        if distances[farthest] < _SAME:
            break
        indices = np.append(indices, farthest)
    return points_m[indices]
