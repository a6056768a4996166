"""Plausibility of the input: units, picture and axes that look like something else than what was asked for.

A pose can be solved from ranges in millimetres, from columns and rows in the wrong order or from another frame's axes, and its
residuals may look good. What gives them away is their size: a reflector is clicked between a metre and a hundred from the
radar, inside the picture, and in front of the radar.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Points2, Points3
from calib_core.camera import Camera
from calib_core.options import CalibrationOptions
from calib_core.results import DataWarning

PIXELS_SUSPECTED = "pixels-suspected"

_FARTHEST_M = 100.0  # a reflector of a few decimetres is then a pixel or two wide
_FARTHEST_CAMERA_M = 15.0
_USUAL_RANGE_M = 8.0
_UNITS = {"millimetres": 0.001, "centimetres": 0.01, "feet": 0.3048}
_SIDEWAYS_RAD = np.deg2rad(60.0)
_EDGE_PX = 0.5
_MARGIN_PX = 10.0  # a click may be a few pixels beyond the edge
_PART_OF_PICTURE = 0.5
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
            f"the radar positions are {range_m.min():,.0f} to {range_m.max():,.0f} m away: the ranges look like {unit}",
            f"radar positions must be in metres: multiply them by {_UNITS[unit]:g}",
        )
    ]


def _camera_units(options: CalibrationOptions) -> list[DataWarning]:
    prior = options.solving.camera_position
    away_m = 0.0 if prior is None else float(np.linalg.norm(prior.position_m))
    if away_m <= _FARTHEST_CAMERA_M:
        return []
    return [
        DataWarning(
            "units-suspected",
            f"the measured camera position is {away_m:,.0f} m from the radar: is it in metres?",
            "the camera position must be in metres",
        )
    ]


def _pixels(ids: Sequence[str], pixels_px: Points2, camera: Camera) -> list[DataWarning]:
    size = (camera.width_px, camera.height_px)
    outside = _outside(pixels_px, size)
    if outside.any() and not _outside(pixels_px[:, ::-1], size).any() and camera.width_px != camera.height_px:
        return [
            DataWarning(
                "pixels-suspected",
                f"{int(outside.sum())} of {len(ids)} clicks are outside the {size[0]} x {size[1]} picture, and with column "
                "and row exchanged all are inside",
                "give each pixel as (column, row)",
            )
        ]
    if outside.any():
        name = ids[int(np.argmax(outside))]
        u_px, v_px = pixels_px[int(np.argmax(outside))].tolist()
        return [
            DataWarning(
                "pixels-suspected",
                f"{int(outside.sum())} of {len(ids)} clicks are outside the {size[0]} x {size[1]} picture, such as {name} at "
                f"({u_px:.0f}, {v_px:.0f})",
                "check that the intrinsics belong to a picture of the size that was clicked; remove the pair otherwise",
            )
        ]
    reach_u, reach_v = (pixels_px.max(axis=0) / np.array(size)).tolist()
    if len(ids) < _LEAST_PAIRS or max(reach_u, reach_v) >= _PART_OF_PICTURE:
        return []
    return [
        DataWarning(
            "pixels-suspected",
            f"all clicks are in the upper left {100 * reach_u:.0f} x {100 * reach_v:.0f} % of the {size[0]} x {size[1]} picture: "
            "the clicked picture seems to be smaller",
            "scale the clicks, or the intrinsics, to the same size of the picture",
        )
    ]


def _outside(pixels_px: Points2, size: tuple[int, int]) -> np.ndarray:
    low, high = -_EDGE_PX - _MARGIN_PX, np.array(size) - _EDGE_PX + _MARGIN_PX
    return np.asarray(((pixels_px < low) | (pixels_px > high)).any(axis=1))


def _axes(points_radar_m: Points3) -> list[DataWarning]:
    """Warn if the placements are not in front of the radar: beside it or behind it by its own axes."""
    directions = points_radar_m / np.linalg.norm(points_radar_m, axis=1, keepdims=True)
    forward, left, _ = np.median(directions, axis=0).tolist()
    if len(points_radar_m) < _LEAST_PAIRS or abs(np.arctan2(left, forward)) <= _SIDEWAYS_RAD:
        return []
    where = "behind the radar" if forward < -abs(left) else f"to the {'left' if left > 0 else 'right'} of the radar"
    behind = int((points_radar_m[:, 0] < 0.0).sum())
    return [
        DataWarning(
            "radar-axes-suspected",
            f"the placements are {where}, and {behind} of {len(points_radar_m)} radar positions have x below 0: their frame "
            "seems not to be the radar's",
            "radar axes must be x forward, y left, z up, with the origin at the radar; the pose is right for the given axes, but "
            "a camera position, and the noise of the angles, refer to the radar's own",
        )
    ]
