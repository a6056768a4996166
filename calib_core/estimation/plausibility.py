"""Plausibility of the input: units, image and axes that look like something else than what was asked for.

A pose can be solved from ranges in millimetres, from columns and rows in the wrong order or from another frame's axes, and its
residuals may look good. What gives them away is their size: a reflector is clicked between a metre and a hundred from the
radar, inside the image, and in front of the radar, near ones in other rows than far ones; a principal point is near the middle
of the image.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Points2, Points3
from calib_core.camera import Camera
from calib_core.measurements import DataWarning, Facts
from calib_core.options import CalibrationOptions
from calib_core.results.systematic_errors import OFF_MIDDLE, off_middle_px

UNITS_M = {"centimeters": 0.01, "millimeters": 0.001, "feet": 0.3048}
"""Meters per unit, by definition."""

_FARTHEST_M = 100.0  # a reflector of a few decimetres is then a pixel or two wide
_FARTHEST_CAMERA_M = 15.0  # a choice: sensors of one vehicle are closer, and 20 cm read as meters are not
_USUAL_RANGE_M = 8.0  # a choice: the unit that brings the median range nearest to it is named
_SIDEWAYS_RAD = np.deg2rad(60.0)  # degrees, a choice: within a usual field of view; exchanged axes make it 90
_EDGE_PX = 0.5
_MARGIN_PX = 10.0  # a click may be a few pixels beyond the edge
_PART_OF_IMAGE = 0.5
_FAR_OFF_MIDDLE, _FARTHEST_OFF_MIDDLE = 0.05, 0.12
"""Of the width or height: KITTI, TUM RGB-D, EuRoC, nuScenes and Cityscapes publish up to 4.6 %, webcams up to 8 %."""
_ONE_ROW = 0.005  # share of the height, a choice: a reflector on a tripod that is moved stands within some centimeters
_NEAR_AND_FAR = 1.5  # ratio of ranges, a choice: on the ground the rows would be as different
# ratios of width to height that sensors and screens have, by name
_ASPECT_RATIOS = {"4:3": 4.0 / 3.0, "16:9": 16.0 / 9.0, "3:2": 1.5, "16:10": 1.6, "5:4": 1.25, "1:1": 1.0}
_BETTER, _NEAR_MIDDLE = 9.2, 4.0
"""By how much another image fits the principal point better (a likelihood ratio of 100), and how well at least, both squared."""
_LEAST_PAIRS = 8  # a choice: fewer are on one side of an image or radar by chance


def implausible_input(
    ids: Sequence[str], points_radar_m: Points3, pixels_px: Points2, camera: Camera, options: CalibrationOptions
) -> tuple[DataWarning, ...]:
    """Return warnings about input that looks like something else, whether or not a pose can be solved from it.

    Args:
        ids: (n,) of the pairs.
        points_radar_m: (m, 3) the radar positions of all pairs.
        pixels_px: (n, 2) the clicks.
        camera: the intrinsics.
        options: the camera position, if measured.
    """
    return (
        *_units(points_radar_m),
        *_camera_units(options),
        *_pixels(ids, pixels_px, camera),
        *_one_row(points_radar_m, pixels_px, camera),
        *_another_image(camera),
        *_axes(points_radar_m),
    )


def _units(points_radar_m: Points3) -> list[DataWarning]:
    range_m = np.linalg.norm(points_radar_m, axis=1)
    if np.median(range_m) <= _FARTHEST_M:
        return []
    unit = min(UNITS_M, key=lambda name: abs(np.log(np.median(range_m) * UNITS_M[name] / _USUAL_RANGE_M)))
    return [
        DataWarning(
            "units-suspected",
            {"nearest": float(range_m.min()), "farthest": float(range_m.max()), "unit": unit, "factor": UNITS_M[unit]},
        )
    ]


def _camera_units(options: CalibrationOptions) -> list[DataWarning]:
    prior = options.solving.camera_position
    away_m = 0.0 if prior is None else float(np.linalg.norm(prior.position_m))
    if away_m <= _FARTHEST_CAMERA_M:
        return []
    return [DataWarning("units-suspected", {"camera_away": away_m})]


def _pixels(ids: Sequence[str], pixels_px: Points2, camera: Camera) -> list[DataWarning]:
    size = (camera.width_px, camera.height_px)
    image: Facts = {"clicks": len(ids), "width_px": size[0], "height_px": size[1]}
    outside = _outside(pixels_px, size)
    if outside.any() and not _outside(pixels_px[:, ::-1], size).any() and camera.width_px != camera.height_px:
        return [DataWarning("pixels-suspected", {**image, "outside": int(outside.sum()), "exchanged": True})]
    if outside.any():
        first = int(np.argmax(outside))
        return [
            DataWarning(
                "pixels-suspected",
                {**image, "outside": int(outside.sum()), "pair": ids[first], "pixel_px": pixels_px[first].tolist()},
            )
        ]
    reach_u, reach_v = (pixels_px.max(axis=0) / np.array(size)).tolist()
    if len(ids) < _LEAST_PAIRS or max(reach_u, reach_v) >= _PART_OF_IMAGE:
        return []
    return [DataWarning("pixels-suspected", {**image, "reach": (reach_u, reach_v)})]


def _one_row(points_radar_m: Points3, pixels_px: Points2, camera: Camera) -> list[DataWarning]:
    """Warn if near and far placements were clicked in one row: the camera is then taken to be as high as they are."""
    range_m, rows_px = np.linalg.norm(points_radar_m, axis=1), pixels_px[:, 1]
    alike = len(rows_px) >= _LEAST_PAIRS and float(rows_px.std()) < _ONE_ROW * camera.height_px
    if not alike or range_m.max() < _NEAR_AND_FAR * range_m.min():
        return []
    return [DataWarning("one-row", {"row_px": float(rows_px.mean()), "spread_px": float(rows_px.std())})]


def _another_image(camera: Camera) -> list[DataWarning]:
    """Warn if the principal point is outside the image, or far from its middle, and of what image it seems to be."""
    off_px, size = off_middle_px(camera), np.array([camera.width_px, camera.height_px], dtype=np.float64)
    share = np.abs(off_px) / size
    modes = {name: _off_another(camera, ratio) for name, ratio in _ASPECT_RATIOS.items()}
    mode = min(modes, key=modes.__getitem__)
    better = float(share @ share) / OFF_MIDDLE**2 - modes[mode] > _BETTER
    if not (better or share.max() > _FAR_OFF_MIDDLE):
        return []
    if not (better or share.max() > _FARTHEST_OFF_MIDDLE):
        right, down = (off_px / size).tolist()
        return [DataWarning("principal-point-off", {"right": right, "down": down})]
    facts = {
        "principal_point_px": camera.matrix_px[:2, 2].tolist(),
        "width_px": camera.width_px,
        "height_px": camera.height_px,
        "mode": mode if better and modes[mode] < _NEAR_MIDDLE else "",
    }
    outside = share.max() > _PART_OF_IMAGE
    return [DataWarning("pixels-suspected" if outside else "intrinsics-suspected", facts)]


def _off_another(camera: Camera, ratio: float) -> float:
    """Return the squared distance of the principal point from the middle, in standard deviations, of the nearest image with
    another aspect ratio: as wide, or as high."""
    width, height = camera.width_px, camera.height_px
    sizes = np.array([(width, width / ratio), (height * ratio, height)])
    shares = (camera.matrix_px[:2, 2] - (sizes - 1.0) / 2.0) / sizes
    return float((shares**2).sum(axis=1).min()) / OFF_MIDDLE**2


def _outside(pixels_px: Points2, size: tuple[int, int]) -> np.ndarray:
    low, high = -_EDGE_PX - _MARGIN_PX, np.array(size) - _EDGE_PX + _MARGIN_PX
    return np.asarray(((pixels_px < low) | (pixels_px > high)).any(axis=1))


def _axes(points_radar_m: Points3) -> list[DataWarning]:
    """Warn if the placements are not in front of the radar: beside it or behind it by its own axes."""
    directions = points_radar_m / np.linalg.norm(points_radar_m, axis=1, keepdims=True)
    forward, left, _ = np.median(directions, axis=0).tolist()
    if len(points_radar_m) < _LEAST_PAIRS or abs(np.arctan2(left, forward)) <= _SIDEWAYS_RAD:
        return []
    where = "behind" if forward < -abs(left) else "left" if left > 0 else "right"
    behind = int((points_radar_m[:, 0] < 0.0).sum())
    return [DataWarning("radar-axes-suspected", {"side": where, "behind": behind, "pairs": len(points_radar_m)})]
