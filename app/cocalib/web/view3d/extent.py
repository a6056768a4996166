"""How far the data reach, range rings to suit, and viewpoints from which all of it is in sight. In the radar frame, all pure."""

import math
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Values, Vector3
from cocalib.web.messages.incoming import Viewpoint

_MOST = 0.98
"""The extent holds this share of the static returns; the rest may be ghosts or multipath."""
_MOST_HEIGHTS = (0.05, 0.95)
_NEAREST_M, _LEAST_ANGLE_RAD = 2.0, math.radians(15.0)
_RINGS = 6
_BEYOND = 1.1
"""The extent reaches this much beyond the farthest reflector or the farthest of most returns."""
_FILLED = 0.9
"""The data fill this share of the view."""
_DIRECTIONS: dict[Viewpoint, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "behind": ((math.cos(0.42), 0.0, -math.sin(0.42)), (0.0, 0.0, 1.0)),
    "above": ((1e-3, 0.0, -1.0), (1.0, 0.0, 0.0)),
    "side": ((0.0, math.cos(0.2), -math.sin(0.2)), (0.0, 0.0, 1.0)),
}
"""In which direction each viewpoint looks, and what is up."""


@dataclass(frozen=True, slots=True)
class Extent:
    """The part of the radar's surroundings that the data fill.

    Attributes:
        range_m: the farthest.
        left_rad: azimuth of the left edge.
        right_rad: azimuth of the right edge.
        low_m: height of the lowest.
        high_m: height of the highest.
    """

    range_m: float
    left_rad: float
    right_rad: float
    low_m: float
    high_m: float

    def corners(self) -> Points3:
        """Return points (n, 3) around it: the radar, and the arc at full range, at both heights."""
        azimuths = np.linspace(self.right_rad, self.left_rad, 7)
        arc = self.range_m * np.stack([np.cos(azimuths), np.sin(azimuths), np.zeros_like(azimuths)], axis=1)
        flat = np.concatenate([np.zeros((1, 3)), arc])
        return np.concatenate([flat + np.array([0.0, 0.0, height_m]) for height_m in (self.low_m, self.high_m)])


UNKNOWN = Extent(12.0, math.radians(45.0), math.radians(-45.0), -1.0, 1.0)
"""What is assumed before anything is known."""


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """Where a viewer stands.

    Attributes:
        position_m: (3,).
        look_at_m: (3,) in the middle of the data, so that the view turns about it.
        up: (3,).
    """

    position_m: Vector3
    look_at_m: Vector3
    up: Vector3


def extent_of(points_radar_m: Points3, weights: Values, reflectors_radar_m: Points3) -> Extent:
    """Return what holds 98 % of the static returns by weight, and every reflector.

    Args:
        points_radar_m: (n, 3) static returns.
        weights: (n,) of each.
        reflectors_radar_m: (m, 3) placements.
    """
    points = np.concatenate([points_radar_m, reflectors_radar_m])
    weight = np.concatenate([weights, np.zeros(len(reflectors_radar_m))])
    known = np.isfinite(points).all(axis=1)
    points, weight = points[known], weight[known]
    if not len(points):
        return UNKNOWN
    if not weight.sum() > 0:
        weight = np.ones(len(points))
    ranges, azimuths = np.linalg.norm(points, axis=1), np.arctan2(points[:, 1], points[:, 0])
    placed = reflectors_radar_m[np.isfinite(reflectors_radar_m).all(axis=1)]
    far = max([_quantile(ranges, weight, _MOST), *np.linalg.norm(placed, axis=1).tolist()])
    sides = np.arctan2(placed[:, 1], placed[:, 0]).tolist()
    left = max([_quantile(azimuths, weight, 0.5 + _MOST / 2), *sides, _LEAST_ANGLE_RAD])
    right = min([_quantile(azimuths, weight, 0.5 - _MOST / 2), *sides, -_LEAST_ANGLE_RAD])
    low, high = (_quantile(points[:, 2], weight, share) for share in _MOST_HEIGHTS)
    heights = placed[:, 2].tolist()
    return Extent(
        max(_NEAREST_M, float(f"{_BEYOND * far:.2g}")), _whole_degrees(left), _whole_degrees(right),
        round(min([low, *heights, 0.0]), 1), round(max([high, *heights, 0.0]), 1),
    )  # fmt: skip


def ring_ranges_m(range_m: float) -> tuple[float, ...]:
    """Return the ranges of rings up to a range: steps of 1, 2 or 5 times a power of ten, at most six."""
    rough = range_m / _RINGS
    power = 10.0 ** math.floor(math.log10(rough) + 1e-9)
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= rough * (1.0 - 1e-9))
    count = math.ceil(range_m / step - 1e-9)
    return tuple(round(step * number, 9) for number in range(1, count + 1))


def fitted_stand(extent: Extent, viewpoint: Viewpoint, field_of_view_rad: float, aspect: float) -> Stand:
    """Return where to stand so that the whole extent is in sight, as near as possible.

    With camera coordinates x to the right, y up and z ahead, a corner is in sight if |x - x0| <= tan(half the angle) (z - z0),
    and so for y; the largest z0 that leaves room for all corners follows directly.

    Args:
        extent: to be seen.
        viewpoint: from which side.
        field_of_view_rad: the vertical angle of the view.
        aspect: width of the view divided by its height.
    """
    direction, up = (np.array(vector) for vector in _DIRECTIONS[viewpoint])
    direction = direction / np.linalg.norm(direction)
    right = np.cross(direction, up)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, direction), direction])
    corners = extent.corners() @ axes.T
    tangents = _FILLED * math.tan(field_of_view_rad / 2.0) * np.array([aspect, 1.0])
    beyond_m = (corners[:, :2] - tangents * corners[:, 2:]).max(axis=0)
    before_m = (-corners[:, :2] - tangents * corners[:, 2:]).max(axis=0)
    ahead_m = float((-(beyond_m + before_m) / (2.0 * tangents)).min())
    position = np.array([*((beyond_m - before_m) / 2.0), ahead_m])
    middle_m = float(corners[:, 2].mean())
    target = np.array([position[0], position[1], middle_m])
    return Stand(position @ axes, target @ axes, up)


def _whole_degrees(angle_rad: float) -> float:
    """Round an angle, so that a recording that grows does not change the view every second."""
    return math.radians(round(math.degrees(angle_rad)))


def _quantile(values: Values, weights: Values, share: float) -> float:
    """Return the value that this share of the weight is not above."""
    order = np.argsort(values, kind="stable")
    summed = np.cumsum(weights[order])
    return float(values[order][min(int(np.searchsorted(summed, share * summed[-1])), len(values) - 1)])
