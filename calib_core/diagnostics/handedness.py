"""Handedness: is one radar axis mirrored?

Placements near one plane fit a radar with a mirrored axis exactly as well, with the camera reflected in that plane. Radar and
camera stand on the same side of the floor on which the reflector is placed, so a fit that puts them on different sides has
a mirrored axis, however far apart they are. Without a plane, or with a measured camera position, the likelihoods of both
decide (`mirror_test`).
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values, Vector3
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.best_fit import MIRRORED_GAIN, NOT_MIRRORED_GAIN
from calib_core.geometry import camera_position_jacobian
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar
from calib_core.results import DataWarning

_PLANE_ROUNDS = 6  # steps of reweighting: variances along the normal change little once it is about right
_NORMAL_QUANTILE_99 = 2.33  # standard deviations, rounded up
_WRONG_SHARE = 0.1  # of the inliers
_LOW_RADAR_M = 0.5  # a choice: as far as a radar in a bumper may be below a reflector on a stand
_CLEAR_SIGMAS, _VERY_CLEAR_SIGMAS = 2.0, 3.0  # of a height above the plane: of right and of mirrored axes (a choice)


@dataclass(frozen=True, slots=True, eq=False)
class _Plane:
    """The plane through the inlier placements, in the radar frame.

    Attributes:
        origin_m: (3,) their weighted mean.
        axes: (3, 3) rows: two directions in the plane and its normal, which points up.
        covariance: (3, 3) of its height at the origin [m] and its slopes along both directions.
        distances: (n,) squared distances of the placements from it, in standard deviations.
    """

    origin_m: Vector3
    axes: np.ndarray
    covariance: np.ndarray
    distances: Values

    @property
    def redundancy(self) -> int:
        """The number of placements beyond the three that determine it."""
        return max(len(self.distances) - 3, 1)

    def height_m(self, point_m: Vector3) -> tuple[float, float]:
        """Return a point's signed height above the plane, and the standard deviation that the plane adds to it."""
        along, across, height = self.axes @ (point_m - self.origin_m)
        row = np.array([1.0, along, across])
        return float(height), float(np.sqrt(row @ self.covariance @ row))


@dataclass(frozen=True, slots=True)
class GroundSides:
    """Where radar and camera are relative to the plane of the placements.

    Attributes:
        radar_m: height of the radar above the plane, by its own axes.
        radar_sigma_m: its standard deviation.
        camera_m: the same for the camera.
        camera_sigma_m: its standard deviation.
    """

    radar_m: float
    radar_sigma_m: float
    camera_m: float
    camera_sigma_m: float

    @property
    def same(self) -> bool:
        """Whether both are on the same side, as expected."""
        return self._sigmas() > _CLEAR_SIGMAS

    @property
    def opposite(self) -> bool:
        """Whether they are clearly on different sides."""
        return self._sigmas() < -_VERY_CLEAR_SIGMAS

    @property
    def low_radar(self) -> bool:
        """Whether the radar is so little below the plane that it may stand lower than the reflector."""
        return -_LOW_RADAR_M < self.radar_m < 0.0

    def _sigmas(self) -> float:
        """Return how clear the less certain side is, negative if the sides differ."""
        radar, camera = self.radar_m / self.radar_sigma_m, self.camera_m / self.camera_sigma_m
        return float(np.sign(radar * camera) * min(abs(radar), abs(camera)))


def handedness(fit: SolvedFit) -> list[DataWarning]:
    """Warn if mirrored radar axes are more likely, or about as likely, or ruled out by the expected camera distance only.

    They are fitted only if the sides of the plane on which radar and camera are do not tell.
    """
    if fit.measurements.flat:
        return []  # a mirrored axis is then a rotation, which the pose absorbs
    plane = _plane(fit)
    sides, heights_decide = _expected_sides(plane, fit), _heights_decide(plane)
    if sides is not None and sides.same and not heights_decide:
        return []
    if not heights_decide and not _is_measured(fit) and not _mirrored_on_rig(plane, fit):
        return []
    if sides is not None and sides.opposite and not sides.low_radar and not heights_decide:
        return [DataWarning("mirrored-axes", {"camera_m": sides.camera_m, "radar_m": sides.radar_m})]
    gain = fit.best.mirror_gain(fit.options)
    if gain > MIRRORED_GAIN:
        return [DataWarning("mirrored-axes", {"log_likelihood_ratio": gain / 2.0})]
    if gain > NOT_MIRRORED_GAIN or (sides is not None and sides.opposite):
        return [DataWarning("handedness-open")]
    prior = fit.measurements.prior
    if _is_measured(fit) or heights_decide or (sides is not None and sides.same):
        return []
    return [DataWarning("handedness-assumed", {"within_m": prior.sigma_m})]


def _is_measured(fit: SolvedFit) -> bool:
    """Return whether the camera position was measured, and is more probably right than not."""
    return fit.best.position is not None and fit.best.position.probability > 0.5


def _mirrored_on_rig(plane: _Plane, fit: SolvedFit) -> bool:
    """Return whether the camera, reflected in the plane of the placements, is as near to the radar as one rig allows."""
    centre_m = fit.refined.camera_from_radar.inverse().translation_m
    reflected_m = centre_m - 2.0 * plane.height_m(centre_m)[0] * plane.axes[2]
    return float(np.linalg.norm(reflected_m)) <= fit.options.solving.reach_m


def _expected_sides(plane: _Plane, fit: SolvedFit) -> GroundSides | None:
    """Return the sides if they tell something: the sensors are above the placements, and the camera is not measured."""
    if not fit.options.solving.sensors_above_placements or _is_measured(fit):
        return None
    return _sides_of(plane, fit)


def _sides_of(plane: _Plane, fit: SolvedFit) -> GroundSides:
    pose = fit.refined.camera_from_radar
    centre_m = pose.inverse().translation_m
    normal = camera_position_jacobian(pose).T @ plane.axes[2]
    radar_m, radar_sigma_m = plane.height_m(np.zeros(3))
    camera_m, plane_sigma_m = plane.height_m(centre_m)
    camera_sigma_m = float(np.sqrt(plane_sigma_m**2 + normal @ fit.uncertainty.covariance @ normal))
    return GroundSides(radar_m, radar_sigma_m, camera_m, camera_sigma_m)


def _heights_decide(plane: _Plane) -> bool:
    """Return whether the placements are far enough from any plane that the pairs alone rule out mirrored axes.

    Mirrored axes with a rotated camera are a reflection in some plane, which moves a placement by twice its height h above
    that plane. Twice the log-likelihood therefore falls by about sum (2 h / sigma)^2 with the true heights, by
    2^2 (chi2 - (n - 3)) with measured ones; the limit includes the 99 % quantile of the noise of that figure. The placements
    farthest from the plane are left out: among them may be a wrong pair.
    """
    wrong = int(np.ceil(_WRONG_SHARE * len(plane.distances)))
    chi2 = float(np.sort(plane.distances)[: len(plane.distances) - wrong].sum())
    limit = MIRRORED_GAIN + 2.0**2 * _NORMAL_QUANTILE_99 * np.sqrt(2.0 * plane.redundancy)
    return bool(2.0**2 * (chi2 - plane.redundancy) > limit)


def _plane(fit: SolvedFit) -> _Plane:
    measurements, inliers = fit.refined.measurements, fit.refined.rows[fit.inliers]
    points = cartesian_from_polar(measurements.polar[inliers])
    covariances = covariance_from_sigma_polar(points, measurements.sigma_polar[inliers])
    weights = np.ones(len(points))
    for _ in range(_PLANE_ROUNDS):
        origin_m = (weights @ points) / weights.sum()
        offsets = points - origin_m
        axes = np.linalg.svd(offsets * np.sqrt(weights)[:, None], full_matrices=False)[2]
        axes[2] *= 1.0 if axes[2, 2] >= 0.0 else -1.0
        weights = 1.0 / np.einsum("i,nij,j->n", axes[2], covariances, axes[2])
    distances = weights * (offsets @ axes[2]) ** 2
    excess = float(distances.sum()) / max(len(points) - 3, 1)
    rows = np.concatenate([np.ones((len(points), 1)), offsets @ axes[:2].T], axis=1)
    covariance = np.linalg.pinv((rows * weights[:, None]).T @ rows) * max(excess, 1.0)
    return _Plane(origin_m, axes, covariance, distances)
