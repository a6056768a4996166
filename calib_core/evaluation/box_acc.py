"""Acc (paper, equation 6): the share of targets' returns that a calibration puts into the boxes of those targets."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Points3, TimesNs, Values, Vector3
from calib_core.camera import Camera
from calib_core.evaluation.counted_returns import CountedReturns
from calib_core.evaluation.figures import (
    Axis,
    BoxedReturns,
    BoxFigures,
    ClassFigure,
    FrameFigure,
    Sensitivity,
    Share,
    edges_of,
)
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.radar import RadarErrors

ANGLES_DEG = (-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0)
AXES: dict[Axis, tuple[float, float, float]] = {
    "roll": (0.0, 0.0, 1.0),
    "pitch": (1.0, 0.0, 0.0),
    "yaw": (0.0, 1.0, 0.0),
}
"""The camera's own axes: x right, y down, z forward."""

_MOST_DEG = 16.0
_STEPS_DEG = (2.0, 1.0, 0.5, 0.25)  # toward the top of a curve, once it is inside
_LOW = 0.25  # Acc in all of a curve says nothing of where its top is
_NORMAL_95 = 1.96
_CHANCE_DEG = 10.0
_GROUPS_S = (1.0, 2.0, 5.0, 10.0)
_LEAST_GROUPS = 6
_MARGIN = 1.1  # of the angle from the axis to the corner of the image


def judged_by_boxes(
    camera_from_radar: RigidTransform,
    camera: Camera,
    counted: CountedReturns,
    *,
    radar_errors: RadarErrors | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> BoxFigures:
    """Compute Acc of a pose from the returns that count.

    Args:
        camera_from_radar: the pose.
        camera: the lens.
        counted: returns and boxes; the same for every pose.
        radar_errors: taken out before the projection.
        progress: called with the poses tried and their number.
    """
    points_camera_m = camera_from_radar @ (radar_errors or RadarErrors()).corrected(counted.points_radar_m)
    pixels_px = seen_pixels(points_camera_m, camera)
    inside = inside_own_boxes(pixels_px, counted.boxes_px)
    shares, rows = _shares(inside, counted.frames)
    error, groups = grouped_error(shares, counted.image_times[rows])
    above = shares[shares > 0]
    return BoxFigures(
        acc=float(shares.mean()) if len(shares) else None,
        acc_standard_error=error,
        acc_without_zero_frames=float(above.mean()) if len(above) else None,
        frames=_frames(counted, inside),
        classes=_acc_by_name(counted.labels, counted, inside),
        objects=_acc_by_name(counted.targets, counted, inside),
        ranges=_ranges(counted, inside),
        sensitivity=_sensitivity(points_camera_m, camera, counted, error, progress) if len(shares) else (),
        chance=_chance(points_camera_m, camera, counted) if len(shares) else None,
        rule=counted.rule,
        source=counted.source,
        by_cuboid=counted.by_cuboid,
        groups=groups,
        area_chance=_area_chance(counted, camera) if len(shares) else None,
        targets=counted.found_targets,
        matched_targets=counted.matched_targets,
        returns=BoxedReturns(
            np.searchsorted(_shown_frames(counted), counted.frames),
            counted.points_radar_m,
            pixels_px,
            counted.boxes_px,
            inside,
            counted.targets,
            counted.labels,
        ),
    )


def inside_own_boxes(pixels_px: Points2, boxes_px: np.ndarray) -> Flags:
    """Return which pixels (n,) lie in their own box (n, 4), edges included; without a box or behind the camera none does."""
    with np.errstate(invalid="ignore"):
        within = (pixels_px >= boxes_px[:, :2]) & (pixels_px <= boxes_px[:, 2:])
    return np.asarray(within.all(axis=1))


def seen_pixels(points_camera_m: Points3, camera: Camera) -> Points2:
    """Project points (n, 3) to pixels (n, 2); NaN beyond what the lens images, where its distortion may fold back.

    Args:
        points_camera_m: in the camera frame.
        camera: the lens.
    """
    right, bottom = camera.width_px - 0.5, camera.height_px - 0.5
    columns, rows = np.linspace(-0.5, right, 17), np.linspace(-0.5, bottom, 17)
    border = [(column, row) for column in columns for row in (-0.5, bottom)]
    border += [(column, row) for column in (-0.5, right) for row in rows]
    widest = np.cos(min(np.pi, _MARGIN * float(np.nan_to_num(np.arccos(camera.rays(np.array(border))[:, 2])).max())))
    pixels = camera.project(points_camera_m)
    length = np.linalg.norm(points_camera_m, axis=1)
    beyond = points_camera_m[:, 2] < widest * length
    return np.asarray(np.where(beyond[:, None], np.nan, pixels))


def frame_groups(image_times: TimesNs, length_s: float) -> Indices:
    """Number the groups of neighboring frames (f,): those of one interval of this length since the first frame."""
    if not len(image_times):
        return np.zeros(0, dtype=np.int64)
    return np.unique((image_times - image_times[0]) // round(length_s * NS_PER_S), return_inverse=True)[1]


def grouped_error(values: Values, image_times: TimesNs) -> tuple[float, int]:
    """Return the standard error of the mean of one value per frame, and the number of independent groups of frames.

    Neighboring frames show the same targets, so they are taken together: the largest of the errors with groups of 1, 2, 5
    and 10 s that leave enough groups. As many groups count as the longest of these leave, whatever the values. NaN below two.

    Args:
        values: (f,).
        image_times: (f,) ascending.
    """
    best, count = float("nan"), 0
    for length_s in _GROUPS_S:
        group = frame_groups(image_times, length_s)
        groups = int(group.max(initial=-1)) + 1
        if groups < 2 or (count and groups < _LEAST_GROUPS):
            break
        sums = np.bincount(group, weights=values - values.mean())
        error = float(np.sqrt(groups / (groups - 1) * (sums**2).sum()) / len(values))
        best, count = error if not error <= best else best, groups
    return best, count


def _shares(inside: Flags, frames: Indices) -> tuple[Values, Indices]:
    """Return the share of each frame that has returns, and which frames these are."""
    rows, own = np.unique(frames, return_inverse=True)
    return np.bincount(own, weights=inside) / np.maximum(np.bincount(own), 1), rows


def _turn_points(points_camera_m: Points3, axis: Vector3, angle_deg: float) -> np.ndarray:
    return points_camera_m @ rotation_exp(np.deg2rad(angle_deg) * np.asarray(axis)).T


def _sensitivity(
    points_camera_m: Points3,
    camera: Camera,
    counted: CountedReturns,
    standard_error: float,
    progress: Callable[[int, int], None] | None,
) -> tuple[Sensitivity, ...]:
    curves = []
    for number, (name, axis) in enumerate(AXES.items()):
        curve = _Curve(points_camera_m, camera, counted, np.array(axis))
        curve.search()
        low, high = curve.interval_deg()
        angles = tuple(sorted(curve.shares))
        accs = tuple(curve.acc(angle) for angle in angles)
        curves.append(Sensitivity(name, angles, accs, standard_error, low, high))
        if progress is not None:
            progress(number + 1, len(AXES))
    return tuple(curves)


class _Curve:
    """Acc of a calibration turned about one axis, as far as its top.

    Attributes:
        shares: (f,) of each frame, by angle [deg].
    """

    def __init__(self, points_camera_m: Points3, camera: Camera, counted: CountedReturns, axis: Vector3) -> None:
        self._points_camera_m, self._camera, self._counted, self._axis = points_camera_m, camera, counted, axis
        self.shares: dict[float, Values] = {}

    def acc(self, angle_deg: float) -> float:
        """Return Acc at an angle."""
        return float(self._at(angle_deg).mean())

    def _at(self, angle_deg: float) -> Values:
        if angle_deg not in self.shares:
            pixels = seen_pixels(_turn_points(self._points_camera_m, self._axis, angle_deg), self._camera)
            inside = inside_own_boxes(pixels, self._counted.boxes_px)
            self.shares[angle_deg] = _shares(inside, self._counted.frames)[0]
        return self.shares[angle_deg]

    @property
    def top_deg(self) -> float:
        """The angle at which Acc is highest; of several, the one nearest to 0."""
        return max(self.shares, key=lambda angle: (self.acc(angle), -abs(angle)))

    def search(self) -> None:
        """Widen the angles until the top is inside, or at most 16 deg away, and then step toward it."""
        reach_deg = max(map(self._known, ANGLES_DEG))
        while reach_deg < _MOST_DEG:
            top = self.top_deg
            if abs(top) < reach_deg and self.acc(top) >= _LOW:
                break
            for side in (-1.0, 1.0) if self.acc(top) < _LOW else (np.sign(top),):
                for factor in (1.5, 2.0):
                    self._at(float(side * factor * reach_deg))
            reach_deg *= 2.0
        if reach_deg == max(ANGLES_DEG):
            return
        for step in _STEPS_DEG:
            top = self.top_deg
            for near in (top - step, top + step):
                self._at(float(np.clip(near, -_MOST_DEG, _MOST_DEG)))

    def _known(self, angle_deg: float) -> float:
        self._at(angle_deg)
        return angle_deg

    def interval_deg(self) -> tuple[float, float]:
        """Return the nearest angles on either side of the top at which Acc is clearly lower, by pairs of frames (95 %)."""
        rows = np.unique(self._counted.frames)
        times, best = self._counted.image_times[rows], self._at(self.top_deg)

        def is_lower(angle: float) -> bool:
            apart = best - self.shares[angle]
            return bool(apart.mean() > _NORMAL_95 * grouped_error(apart, times)[0])

        angles = sorted(self.shares)
        below = [angle for angle in angles if angle < self.top_deg and is_lower(angle)]
        above = [angle for angle in angles if angle > self.top_deg and is_lower(angle)]
        return max(below, default=-np.inf), min(above, default=np.inf)


def _chance(points_camera_m: Points3, camera: Camera, counted: CountedReturns) -> float:
    """Return the mean Acc of the calibration turned by 10 deg to the left and to the right."""
    yaw = np.array(AXES["yaw"])
    pixels = [seen_pixels(_turn_points(points_camera_m, yaw, side * _CHANCE_DEG), camera) for side in (-1.0, 1.0)]
    means = [_shares(inside_own_boxes(pixel, counted.boxes_px), counted.frames)[0].mean() for pixel in pixels]
    return float(np.mean(means))


def _area_chance(counted: CountedReturns, camera: Camera) -> float:
    """Return what returns at random pixels would score: the share of the image that each one's own box covers."""
    last = np.array([camera.width_px, camera.height_px]) - 0.5
    low, high = np.clip(counted.boxes_px[:, :2], -0.5, last), np.clip(counted.boxes_px[:, 2:], -0.5, last)
    areas = np.nan_to_num(np.prod(high - low, axis=1)) / (camera.width_px * camera.height_px)
    own = np.unique(counted.frames, return_inverse=True)[1]
    return float((np.bincount(own, weights=areas) / np.bincount(own)).mean())


def _frames(counted: CountedReturns, inside: Flags) -> tuple[FrameFigure, ...]:
    count = len(counted.image_times)
    returns = np.bincount(counted.frames, minlength=count)
    within = np.bincount(counted.frames, weights=inside, minlength=count).astype(np.int64)
    range_m = np.linalg.norm(counted.points_radar_m, axis=1)
    ends = np.concatenate([[0], np.cumsum(returns)])
    return tuple(
        FrameFigure(
            image_time=TimeNs(int(counted.image_times[i])),
            radar_time=TimeNs(int(counted.radar_times[i])),
            returns=int(returns[i]),
            inside=int(within[i]),
            boxes=int(counted.box_counts[i]),
            range_m=float(np.median(range_m[ends[i] : ends[i + 1]])) if returns[i] else float("nan"),
        )
        for i in _shown_frames(counted).tolist()
    )


def _shown_frames(counted: CountedReturns) -> Indices:
    """Return the frames that have returns or boxes; the others are left out of the figures."""
    returns = np.bincount(counted.frames, minlength=len(counted.image_times))
    return np.flatnonzero((returns > 0) | (counted.box_counts > 0))


def _acc_by_name(names: Sequence[str], counted: CountedReturns, inside: Flags) -> tuple[ClassFigure, ...]:
    """Return Acc by the names of the returns (n,): their classes, or their targets."""
    of_return = np.array(names, dtype=object)
    figures = []
    for label in sorted(set(names), key=lambda name: (not name, name)):
        own = of_return == label
        shares, rows = _shares(inside[own], counted.frames[own])
        figures.append(ClassFigure(label, float(shares.mean()), len(rows), int(own.sum()), int(inside[own].sum())))
    return tuple(figures)


def _ranges(counted: CountedReturns, inside: Flags) -> tuple[Share, ...]:
    range_m = np.linalg.norm(counted.points_radar_m, axis=1)
    edges = edges_of(range_m)
    rows = np.clip(np.searchsorted(edges, range_m, side="right") - 1, 0, max(len(edges) - 2, 0))
    return tuple(
        Share(float(low), float(high), int((rows == i).sum()), int(inside[rows == i].sum()))
        for i, (low, high) in enumerate(itertools.pairwise(edges))
    )
