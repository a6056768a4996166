"""Plausibility of the input: units, image and axes that look like something else than what was asked for.

A pose can be solved from ranges in millimetres, from columns and rows in the wrong order or from another frame's axes, and its
residuals may look good. What gives them away is their size: a reflector is clicked between a metre and a hundred from the
radar, inside the image, and in front of the radar.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Points2, Points3
from calib_core.camera import Camera
from calib_core.measurements import DataWarning, Facts
from calib_core.options import CalibrationOptions

_FARTHEST_M = 100.0  # a reflector of a few decimetres is then a pixel or two wide
_FARTHEST_CAMERA_M = 15.0
_USUAL_RANGE_M = 8.0
_UNITS = {"millimetres": 0.001, "centimetres": 0.01, "feet": 0.3048}
_SIDEWAYS_RAD = np.deg2rad(60.0)
_EDGE_PX = 0.5
_MARGIN_PX = 10.0  # a click may be a few pixels beyond the edge
_PART_OF_IMAGE = 0.5
_LEAST_PAIRS = 8


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
        *_axes(points_radar_m),
    )


def _units(points_radar_m: Points3) -> list[DataWarning]:
    range_m = np.linalg.norm(points_radar_m, axis=1)
    if np.median(range_m) <= _FARTHEST_M:
        return []
    unit = min(_UNITS, key=lambda name: abs(np.log(np.median(range_m) * _UNITS[name] / _USUAL_RANGE_M)))
    return [
        DataWarning(
            "units-suspected",
            {"nearest": float(range_m.min()), "farthest": float(range_m.max()), "unit": unit, "factor": _UNITS[unit]},
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
