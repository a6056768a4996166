"""How far the data reach, range rings to suit, and viewpoints from which all of it is in sight. In the radar frame, all pure."""

import math
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points2, Points3, Values, Vector3
from cocalib.web.messages.incoming import Viewpoint

_MOST = 0.98
"""The extent holds this share of the static returns along each axis; the rest may be ghosts or multipath."""
_MOST_HEIGHTS = (0.05, 0.95)
_NEAREST_M = 2.0
_RINGS = 6
_BEYOND = 1.1
"""The range reaches this much beyond the farthest reflector or the farthest of most returns."""
_STEPS = 50
"""The field has corners at whole steps, this part of the range: a recording that grows does not move the view every second."""
_FILLED = 0.8
"""The data fill this share of the view along one axis."""
_ENOUGH = 0.5
"""A viewer looks as level as leaves the data this share of the view along the other axis; else as steeply as is tried."""
_DIRECTIONS: dict[Viewpoint, tuple[Vector3, Vector3, Values]] = {
    "behind": (np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.linspace(0.35, 0.95, 7)),
    "above": (np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([math.pi / 2 - 1e-3])),
    "side": (np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.linspace(0.2, 0.8, 7)),
}
"""In which direction each viewpoint looks, what is up, and how far below the horizon it may look [rad]."""


@dataclass(frozen=True, slots=True)
class Extent:
    """The part of the radar's surroundings that the data fill.

    Attributes:
        range_m: the farthest.
        outline_m: corners (x, y) of a convex field around what is to be looked at; the radar is in it.
        low_m: height of the lowest.
        high_m: height of the highest.
    """

    range_m: float
    outline_m: tuple[tuple[float, float], ...]
    low_m: float
    high_m: float

    def corners(self) -> Points3:
        """Return the corners (n, 3) of the field at both heights."""
        return np.array([(x_m, y_m, z_m) for x_m, y_m in self.outline_m for z_m in (self.low_m, self.high_m)])


UNKNOWN = Extent(12.0, ((0.0, 0.0), (12.0, -8.0), (12.0, 8.0)), -1.0, 1.0)
"""What is assumed before anything is known."""


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """Where a viewer stands.

    Attributes:
        position_m: (3,).
        look_at_m: (3,) in the middle of the data, so that the view turns about it.
        up: (3,).
        filled: shares of the view's width and height that the data fill.
    """

    position_m: Vector3
    look_at_m: Vector3
    up: Vector3
    filled: Values

    @property
    def distance_m(self) -> float:
        """From the middle of the data."""
        return float(np.linalg.norm(self.look_at_m - self.position_m))


def extent_of(points_radar_m: Points3, weights: Values, reflectors_radar_m: Points3) -> Extent:
    """Return a range that holds 98 % of the static returns by weight, and a field around the reflectors, or else the returns.

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
    ranges = np.linalg.norm(points, axis=1)
    placed = reflectors_radar_m[np.isfinite(reflectors_radar_m).all(axis=1)]
    far_m = max([_quantile(ranges, weight, _MOST), *np.linalg.norm(placed, axis=1).tolist()])
    range_m = max(_NEAREST_M, float(f"{_BEYOND * far_m:.2g}"))
    low_m, high_m = (_quantile(points[:, 2], weight, share) for share in _MOST_HEIGHTS)
    low_m, high_m = min([0.0, low_m, *placed[:, 2].tolist()]), max([0.0, high_m, *placed[:, 2].tolist()])
    field_m = placed[:, :2]
    if not len(placed):
        sides = [[_quantile(points[:, axis], weight, share) for axis in (0, 1)] for share in (1.0 - _MOST, _MOST)]
        field_m = points[((points[:, :2] >= sides[0]) & (points[:, :2] <= sides[1])).all(axis=1), :2]
    step_m = range_m / _STEPS
    outline_m = _outline(np.round(np.concatenate([np.zeros((1, 2)), field_m]) / step_m) * step_m)
    return Extent(range_m, outline_m, math.floor(10.0 * low_m) / 10.0, (math.floor(10.0 * high_m) + 1.0) / 10.0)


def ring_ranges_m(range_m: float) -> tuple[float, ...]:
    """Return the ranges of rings up to a range: steps of 1, 2 or 5 times a power of ten, at most six."""
    rough = range_m / _RINGS
    power = 10.0 ** math.floor(math.log10(rough) + 1e-9)
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= rough * (1.0 - 1e-9))
    count = math.ceil(range_m / step - 1e-9)
    return tuple(round(step * number, 9) for number in range(1, count + 1))


def fitted_stand(extent: Extent, viewpoint: Viewpoint, field_of_view_rad: float, aspect: float) -> Stand:
    """Return where to stand so that the whole field is in sight, as near as possible, and no strip.

    Args:
        extent: to be seen.
        viewpoint: from which side.
        field_of_view_rad: the vertical angle of the view.
        aspect: width of the view divided by its height.
    """
    forward, up, tilts_rad = _DIRECTIONS[viewpoint]
    tangents = math.tan(field_of_view_rad / 2.0) * np.array([aspect, 1.0])
    down = np.array([0.0, 0.0, -1.0])
    stands = [
        _nearest_stand(extent, math.cos(tilt) * forward + math.sin(tilt) * down, up, tangents) for tilt in tilts_rad
    ]
    return next((stand for stand in stands if stand.filled.min() >= _ENOUGH), stands[-1])


def _nearest_stand(extent: Extent, direction: Vector3, up: Vector3, tangents: Values) -> Stand:
    """Return the nearest stand from which the field fills no more than its share of the view.

    With camera coordinates x to the right, y up and z ahead, a corner is in sight if |x - x0| <= tan(half the angle) (z - z0),
    and so for y; the largest z0 that leaves room for all corners follows directly.
    """
    right = np.cross(direction, up)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, direction), direction])
    corners = extent.corners() @ axes.T
    inner = _FILLED * tangents
    beyond_m = (corners[:, :2] - inner * corners[:, 2:]).max(axis=0)
    before_m = (-corners[:, :2] - inner * corners[:, 2:]).max(axis=0)
    ahead_m = float((-(beyond_m + before_m) / (2.0 * inner)).min())
    position = np.array([*((beyond_m - before_m) / 2.0), ahead_m])
    seen = (corners[:, :2] - position[:2]) / (corners[:, 2:] - ahead_m) / tangents
    target = np.array([position[0], position[1], float(corners[:, 2].mean())])
    return Stand(position @ axes, target @ axes, up, np.ptp(seen, axis=0) / 2.0)


def _outline(points_m: Points2) -> tuple[tuple[float, float], ...]:
    """Return the corners of the convex hull of points (n, 2)."""
    import cv2

    return tuple((float(x_m), float(y_m)) for x_m, y_m in cv2.convexHull(points_m.astype(np.float32))[:, 0])


def _quantile(values: Values, weights: Values, share: float) -> float:
    """Return the value that this share of the weight is not above."""
    order = np.argsort(values, kind="stable")
    summed = np.cumsum(weights[order])
    return float(values[order][min(int(np.searchsorted(summed, share * summed[-1])), len(values) - 1)])
