"""Next placement: where a further pair would reduce the pose's uncertainty most, and when to stop.

Before any pose it is the radar alone that tells where placements are missing: its field is divided into bearings and
ranges.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from calib_core.arrays import Points3, Values
from calib_core.association.placement_groups import placement_groups
from calib_core.estimation.measurement_model import MeasurementPlanes, pair_measurements
from calib_core.measurements import Pair
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration, NextPlacement
from calib_core.results.systematic_errors import SystematicErrors

_ENOUGH_GAIN = 1.04  # factor on the standard deviations; a placement that gains less is not worth the effort (a choice)
_MARGIN_SHARE = 0.04  # of the image, kept free at its edges


@dataclass(frozen=True, slots=True)
class PlacementLimits:
    """Where the reflector can be put, on the plane of the existing placements."""

    min_range_m: float = 2.0
    """Nearest place [m]."""
    max_range_m: float = 15.0
    """Farthest place [m]."""
    max_azimuth_deg: float = 40.0
    """Largest bearing to either side [deg]; beyond it a radar's angles get worse."""
    separation_m: float = 0.5
    """Smallest distance to a place that has been used [m]."""


def next_placement(calibration: Calibration, *, limits: PlacementLimits | None = None) -> NextPlacement | None:
    """Find the place whose pair would reduce the uncertainty most (A-optimal design); None if no place is free.

    Places are true positions. Every error that the pairs share is an unknown next to the pose, so that no placement is said to
    remove what placements cannot show; what no pair can show, such as the tilt of a radar without elevation, is left out.

    Args:
        calibration: of the default method, with its covariance.
        limits: where the reflector can go.
    """
    clicks = [
        replace(pair.measured, candidates=pair.measured.candidates[pair.candidate : pair.candidate + 1])
        for pair in calibration.pairs
        if pair.inlier and pair.measured is not None
    ]
    if not clicks or not np.isfinite(calibration.covariance).all():
        return None
    design = _design([group.pair for group in placement_groups(clicks, calibration.options)], calibration)
    limits, used = limits or PlacementLimits(), cartesian_from_polar(design.planes.polar.T)
    places = _free_places(calibration, used, limits)
    if not len(places):
        return None
    distance_m = float(np.median(np.linalg.norm(used, axis=1)))
    now = _spread(design.covariance.diagonal()[None, :6], distance_m)[0]
    then = _spread(_variances_after(design, calibration, places), distance_m)
    best = int(np.argmin(then))
    gain = float(np.sqrt(now / then[best]))
    pixel = calibration.camera.project(calibration.camera_from_radar @ places[best : best + 1])[0]
    return NextPlacement(places[best], pixel, gain, may_stop=gain < _ENOUGH_GAIN)


@dataclass(frozen=True, slots=True, eq=False)
class _Design:
    """The used places at their true positions, and the covariance (6 + k, 6 + k) of the pose and all k shared errors."""

    planes: MeasurementPlanes
    covariance: np.ndarray


def _design(used: Sequence[Pair], calibration: Calibration) -> _Design:
    """Invert the information of the used pairs and of all priors, with the estimated noise."""
    pose, camera = calibration.camera_from_radar, calibration.prior_camera
    measurements = pair_measurements(used, camera, calibration.options)
    measurements = measurements.scaled(calibration.noise_scale)
    shared = measurements.errors
    errors = SystematicErrors((*shared.estimated, *shared.widening), lens=shared.lens)
    planes = MeasurementPlanes(
        measurements.pixels_px.T,
        measurements.sigma_px,
        calibration.radar_errors.corrected_polar(measurements.reported.T),
        measurements.sigma_polar.T,
        errors,
    )
    jacobian = planes.linearize(camera, pose.rotation, pose.translation_m).jacobian.reshape(-1, 6 + len(errors))
    information = jacobian.T @ jacobian
    position = measurements.prior.rows(pose)[1]
    information[:6, :6] += position.T @ position
    information[6:, 6:] += np.diag(errors.sigma**-2.0)
    return _Design(planes, np.linalg.inv(information))


def _free_places(calibration: Calibration, used: Points3, limits: PlacementLimits) -> Points3:
    """Return the points of a polar grid on the plane of the used places that both sensors see and that are not used yet."""
    range_m = np.geomspace(limits.min_range_m, limits.max_range_m, 10)  # steps of a quarter of the range, by default
    # steps of 4 degrees by default: finer ones than people place a reflector by are no use
    azimuth_rad = np.deg2rad(np.linspace(-limits.max_azimuth_deg, limits.max_azimuth_deg, 21))
    grid = np.stack(np.meshgrid(range_m, azimuth_rad, indexing="ij"), axis=-1).reshape(-1, 2)
    flat = cartesian_from_polar(np.column_stack([grid, np.zeros(len(grid))]))
    flat[:, 2] = _heights(flat[:, :2], used)
    camera_from_radar, camera = calibration.camera_from_radar, calibration.camera
    margin_px = -_MARGIN_SHARE * min(camera.width_px, camera.height_px)
    points_camera = camera_from_radar @ flat
    seen = camera.sees(points_camera) & camera.in_image(camera.project(points_camera), margin_px=margin_px)
    apart = np.linalg.norm(flat[:, None] - used[None], axis=2).min(axis=1) >= limits.separation_m
    return flat[seen & apart]


def _heights(places: np.ndarray, used: Points3) -> Values:
    """Return z on the plane z = a x + b y + c through the used places, with regularized slopes."""
    design = np.column_stack([used[:, :2], np.ones(len(used))])
    regularized = np.vstack([design, np.diag([1.0, 1.0, 0.0])])
    plane = np.linalg.lstsq(regularized, np.concatenate([used[:, 2], np.zeros(3)]), rcond=None)[0]
    return np.asarray(np.column_stack([places, np.ones(len(places))]) @ plane)


def _variances_after(design: _Design, calibration: Calibration, places: Points3) -> np.ndarray:
    """Return the variances (n, 6) of the pose after one more pair at each place: P - P J^T (I + J P J^T)^-1 J P."""
    pose, count = calibration.camera_from_radar, len(places)
    planes = MeasurementPlanes(
        np.zeros((2, count)),
        np.full(count, np.median(design.planes.sigma_px)),
        polar_from_cartesian(places).T,
        np.tile(np.median(design.planes.sigma_polar, axis=1)[:, None], count),
        design.planes.errors,
    )
    jacobian = planes.linearize(calibration.camera, pose.rotation, pose.translation_m).jacobian
    moved = jacobian @ design.covariance
    innovation = np.eye(2) + moved @ np.swapaxes(jacobian, 1, 2)
    removed = (moved * np.linalg.solve(innovation, moved)).sum(axis=1)
    return np.asarray((design.covariance.diagonal() - removed)[:, :6])


def _spread(variances: np.ndarray, distance_m: float) -> Values:
    """Reduce variances (n, 6) to (n,) [rad^2]: rotation variance, plus position variance at the typical distance."""
    return np.asarray(variances[:, 3:].sum(axis=1) + variances[:, :3].sum(axis=1) / distance_m**2)


ENOUGH_PLACEMENTS = 20
"""The number of placements that docs/tour.md advises to record."""

_RANGES_M = tuple(pairwise((2.0, 5.0, 10.0, 15.0)))  # near, middle, far of what docs/tour.md advises (a choice)
_SIDES = ("left", "ahead", "right")
_EDGE_SHARE = 1.0 / 3.0  # of the half view: left, ahead and right are equally wide
_SAME_PLACE_M = 0.5
_TWO_HEIGHTS_M = 0.3  # a smaller span is one height: less than a box under the reflector adds (a choice)


@dataclass(frozen=True, slots=True)
class Place:
    """A part of the field.

    Attributes:
        side: "left", "ahead" or "right".
        near_m: nearest range [m].
        far_m: farthest range [m].
    """

    side: str
    near_m: float
    far_m: float


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the placements so far cover.

    Attributes:
        placements: number of different ones.
        next: where the next one should be; None once there are enough and no part of the field is empty.
        one_height: all of them are at one height, of those a radar with elevation has measured.
    """

    placements: int
    next: Place | None
    one_height: bool


def placement_coverage(positions_radar_m: Points3, *, half_view_rad: float) -> Coverage:
    """Say what placements cover and where the next one should be.

    Args:
        positions_radar_m: (n, 3) of the placements.
        half_view_rad: largest bearing to either side that the camera sees [rad].
    """
    places = _different(np.asarray(positions_radar_m, dtype=np.float64).reshape(-1, 3))
    polar = polar_from_cartesian(places)
    counts = Counter(map(_place, polar[:, 0], polar[:, 1] / half_view_rad))
    every = [Place(side, *limits) for limits, side in product(_RANGES_M, _SIDES)]
    emptiest = min(every, key=lambda place: (counts[place], _from_the_others(place, counts)))
    heights_m = places[:, 2]
    flat = len(places) > 1 and float(np.ptp(heights_m)) < _TWO_HEIGHTS_M and bool(np.ptp(heights_m) > 0)
    needed = len(places) < ENOUGH_PLACEMENTS or counts[emptiest] == 0
    return Coverage(len(places), emptiest if needed else None, flat)


def _different(places: Points3) -> Points3:
    """Return the places without those next to an earlier one."""
    kept: list[np.ndarray] = []
    for place in places:
        if all(np.linalg.norm(place - other) >= _SAME_PLACE_M for other in kept):
            kept.append(place)
    return np.array(kept).reshape(-1, 3)


def _place(range_m: float, share: float) -> Place:
    """Return the part of the field at a range and a share of the half view, positive to the left."""
    side = "left" if share > _EDGE_SHARE else "right" if share < -_EDGE_SHARE else "ahead"
    limits = next((limits for limits in _RANGES_M if range_m < limits[1]), _RANGES_M[-1])
    return Place(side, *limits)


def _from_the_others(place: Place, counts: "Counter[Place]") -> int:
    """Rank parts of the field with equally many placements: those whose side and whose range have the fewest come first."""
    return sum(count for other, count in counts.items() if other.side == place.side or other.near_m == place.near_m)
