"""Radar polar coordinates, the covariance of a radar position, and the map of a radar's angle errors.

Radar frame: x forward, y left, z up (docs/conventions.md). Azimuth is positive to the left, elevation upwards.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Values, Vector3, frozen_array
from calib_core.json_forms import Measured, Scale
from calib_core.options import NoiseOptions

_LEAST_SHARE_SQUARED = 0.25  # of the range that is left along the plane of the placements

_LARGEST_AED_RATIO = 0.97
"""Ratio of the AED with the map to the AED without it; above this the gain may be due to chance."""


def cartesian_from_polar(polar: Points3) -> Points3:
    """Convert (range [m], azimuth [rad], elevation [rad]) rows to x, y, z [m] (paper section III: polar to Cartesian)."""
    polar = np.asarray(polar, dtype=np.float64)
    range_m, azimuth_rad, elevation_rad = polar[..., 0], polar[..., 1], polar[..., 2]
    across = range_m * np.cos(elevation_rad)
    return np.stack(
        [across * np.cos(azimuth_rad), across * np.sin(azimuth_rad), range_m * np.sin(elevation_rad)], axis=-1
    )


def position_planes(polar: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Convert polar planes (3, n) to positions (3, n) [m] and d position / d polar (3, 3, n), position axis first.

    The same as `cartesian_from_polar` and `cartesian_jacobian`, with one row per coordinate for speed.
    """
    range_m = polar[0]
    (cos_azimuth, cos_elevation), (sin_azimuth, sin_elevation) = np.cos(polar[1:]), np.sin(polar[1:])
    direction = np.array([cos_elevation * cos_azimuth, cos_elevation * sin_azimuth, sin_elevation])
    position = range_m * direction
    jacobian = np.zeros((3, 3, polar.shape[1]))
    jacobian[:, 0] = direction
    jacobian[0, 1], jacobian[1, 1] = -position[1], position[0]
    jacobian[0, 2], jacobian[1, 2] = -position[2] * cos_azimuth, -position[2] * sin_azimuth
    jacobian[2, 2] = range_m * cos_elevation
    return position, jacobian


def polar_from_cartesian(points_radar_m: Points3) -> Points3:
    """Convert x, y, z [m] rows to (range [m], azimuth [rad], elevation [rad]); the origin maps to zeros."""
    points = np.asarray(points_radar_m, dtype=np.float64)
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    across = np.hypot(x, y)
    return np.stack([np.hypot(across, z), np.arctan2(y, x), np.arctan2(z, across)], axis=-1)


def direction_cosines(points_radar_m: Points3) -> Points3:
    """Convert x, y, z [m] rows to (r [m], u, w): u = y / r, w = z / r, in which a radar's errors are about constant."""
    points = np.asarray(points_radar_m, dtype=np.float64)
    range_m = np.linalg.norm(points, axis=-1)
    safe_m = np.where(range_m > 0, range_m, 1.0)
    return np.stack([range_m, points[..., 1] / safe_m, points[..., 2] / safe_m], axis=-1)


def cartesian_jacobian(polar: Points3) -> np.ndarray:
    """Return d(x, y, z) / d(range, azimuth, elevation) at each row: (n, 3, 3)."""
    polar = np.asarray(polar, dtype=np.float64)
    range_m, azimuth_rad, elevation_rad = polar[..., 0], polar[..., 1], polar[..., 2]
    ca, sa, ce, se = np.cos(azimuth_rad), np.sin(azimuth_rad), np.cos(elevation_rad), np.sin(elevation_rad)
    zero = np.zeros_like(range_m)
    rows = [
        np.stack([ce * ca, -range_m * ce * sa, -range_m * se * ca], axis=-1),
        np.stack([ce * sa, range_m * ce * ca, -range_m * se * sa], axis=-1),
        np.stack([se, zero, range_m * ce], axis=-1),
    ]
    return np.stack(rows, axis=-2)


def sigma_polar_of(noise: NoiseOptions) -> Vector3:
    """Return the standard deviations of range [m], azimuth and elevation [rad] that the options assume: (3,)."""
    return np.array([noise.sigma_range_m, *np.deg2rad([noise.sigma_azimuth_deg, noise.sigma_elevation_deg])])


def covariance_from_sigma_polar(points_radar_m: Points3, sigma_polar: Points3) -> np.ndarray:
    """Convert standard deviations of range [m], azimuth and elevation [rad] to Cartesian covariances (n, 3, 3) [m^2]."""
    jacobian = cartesian_jacobian(polar_from_cartesian(points_radar_m))
    scaled = jacobian * np.asarray(sigma_polar, dtype=np.float64)[..., None, :]
    return scaled @ np.swapaxes(scaled, -1, -2)


@dataclass(frozen=True, slots=True)
class RadarErrors:
    """What the radar gets wrong at every position alike, to be taken out of a reported position before the pose is applied.

    range = range - range_bias_m, then sqrt(range^2 - squared_height_m2); azimuth / (1 + azimuth_scale); elevation likewise.

    Attributes:
        azimuth_scale: reported azimuth over the true one, minus 1.
        elevation_scale: the same of the elevation.
        range_bias_m: reported range minus the true one [m].
        squared_height_m2: squared height of the placements above or below a radar that measures no elevation [m^2].
    """

    azimuth_scale: Scale = 0.0
    elevation_scale: Scale = 0.0
    range_bias_m: Measured = 0.0
    squared_height_m2: Measured = 0.0

    @classmethod
    def named(cls, values: dict[str, float]) -> "RadarErrors":
        """Take the errors of these names; other names are ignored."""
        return cls(**{name: value for name, value in values.items() if name in cls.__dataclass_fields__})

    def corrected(self, points_radar_m: Points3) -> Points3:
        """Return reported positions (n, 3) with these errors taken out."""
        if self == RadarErrors():
            return np.asarray(points_radar_m, dtype=np.float64)
        return cartesian_from_polar(self.corrected_polar(polar_from_cartesian(points_radar_m).T).T)

    def corrected_polar(self, polar: np.ndarray) -> np.ndarray:
        """Return reported range [m], azimuth and elevation [rad] (3, n) with these errors taken out."""
        range_m = polar[0] - self.range_bias_m
        if self.squared_height_m2:
            range_m = np.sqrt(np.maximum(range_m**2 - self.squared_height_m2, _LEAST_SHARE_SQUARED * range_m**2))
        return np.array([range_m, polar[1] / (1.0 + self.azimuth_scale), polar[2] / (1.0 + self.elevation_scale)])


@dataclass(frozen=True, slots=True, eq=False)
class AngleMap:
    """Corrections to the radar's angles on a grid of directions: linear in between, constant beyond the edge.

    Attributes:
        azimuth_rad: (a,) of the columns, ascending.
        elevation_rad: (e,) of the rows, ascending.
        correction_rad: (e, a, 2) to add to a measured (azimuth, elevation).
        sigma_rad: (e, a, 2) standard deviation of the remaining smooth error.
        raw_aed_px: AED of the pairs it was learnt from, without the map.
        corrected_aed_px: the same with each pair corrected as the others predict.
    """

    azimuth_rad: Values
    elevation_rad: Values
    correction_rad: np.ndarray
    sigma_rad: np.ndarray
    raw_aed_px: float
    corrected_aed_px: float

    def __post_init__(self) -> None:
        rows, columns = len(self.elevation_rad), len(self.azimuth_rad)
        shapes: dict[str, tuple[int, ...]] = {"azimuth_rad": (columns,), "elevation_rad": (rows,)}
        shapes |= {"correction_rad": (rows, columns, 2), "sigma_rad": (rows, columns, 2)}
        for name, shape in shapes.items():
            object.__setattr__(self, name, frozen_array(getattr(self, name), shape))
        for lines in (self.azimuth_rad, self.elevation_rad):
            if len(lines) < 2 or not (np.diff(lines) > 0).all():
                raise ValueError("an angle map needs two or more grid lines per axis, in ascending order")

    @property
    def largest_rad(self) -> float:
        """The largest correction anywhere on the map."""
        return float(np.abs(self.correction_rad).max())

    @property
    def pays(self) -> bool:
        """Whether the map clearly reduces the held-out residuals."""
        return self.corrected_aed_px < _LARGEST_AED_RATIO * self.raw_aed_px

    def corrected(self, points_radar_m: Points3) -> Points3:
        """Return the positions (n, 3) with their angles corrected and their ranges kept."""
        polar = polar_from_cartesian(points_radar_m)
        row, row_share = _cell(self.elevation_rad, polar[:, 2])
        column, column_share = _cell(self.azimuth_rad, polar[:, 1])
        grid = self.correction_rad
        lower = grid[row, column] * (1 - column_share) + grid[row, column + 1] * column_share
        upper = grid[row + 1, column] * (1 - column_share) + grid[row + 1, column + 1] * column_share
        polar[:, 1:] += lower * (1 - row_share) + upper * row_share
        return cartesian_from_polar(polar)


def _cell(lines: Values, values: Values) -> tuple[np.ndarray, np.ndarray]:
    """Return the index (n,) of the line below each value, and its share (n, 1) of the way to the next; NaN stays NaN."""
    clamped = np.clip(values, lines[0], lines[-1])
    below = np.clip(np.searchsorted(lines, clamped, side="right") - 1, 0, len(lines) - 2)
    return below, ((clamped - lines[below]) / (lines[below + 1] - lines[below]))[:, None]
