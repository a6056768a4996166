"""Solve a public set by three methods, and judge it by what its authors published."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np

from benchmarks.real.converters import Contents
from calib_core import acc, pairs_from_arrays
from calib_core.arrays import Points2, Points3
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import ReflectorClick, Unsolvable
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.paper.pnp import refine_lm, solve_pnp_ransac
from calib_core.recordings import Recording, RecordingOptions, open_recording
from calib_core.results import Calibration, Metrics
from calib_core.results.metrics import distances
from calib_core.results.verdict import verdict_on
from cocalib.evaluation import evaluating
from cocalib.evaluation.boxes import find_boxes
from cocalib.session.state import Outcome
from cocalib.solving.automatic import place_clicks, solve_placed_clicks
from cocalib.solving.solving import required_camera, solve_clicks

METHODS = ("ours", "Algorithm 1", "OpenCV")
TURNS_DEG = (0.0, 1.0, 2.0, 5.0)
_FOLDS = 10
_Ids: TypeAlias = Sequence[str]
_Fit: TypeAlias = tuple[RigidTransform, dict[str, float]] | str
"""A pose with the reprojection error of each pair, or the code why there is none."""
_Fitting: TypeAlias = Callable[[frozenset[str]], _Fit]
"""From the ids that are left out."""


@dataclass(frozen=True, slots=True)
class PoseFigures:
    """One method's pose.

    Attributes:
        rotation_deg: angle from the published rotation; NaN without one.
        position_cm: distance of the camera centres.
        error_px: mean reprojection error of all pairs, those set aside included.
        left_out_px: median distance to the pairs of a tenth that the pose was solved without; NaN if one has none.
    """

    rotation_deg: float
    position_cm: float
    error_px: float
    left_out_px: float


@dataclass(frozen=True, slots=True)
class Judged:
    """The figures of one set.

    Attributes:
        pairs: their number.
        set_aside: how many of them ours calls outliers.
        poses: by method, or the code why it gave none.
        published_px: mean reprojection error of all pairs under the published pose.
        reach: distance of the published pose in our covariance, of the 95 % ellipsoid's radius: inside up to 1.
        verdict: level of ours, or the code why there is no pose.
        codes: of ours' warnings.
        acc: of the published pose turned by `TURNS_DEG`, mean of yaw and pitch to both sides, 0 to 1.
        returns: that Acc counts.
    """

    pairs: int = 0
    set_aside: int = 0
    poses: dict[str, PoseFigures | str] = field(default_factory=dict)
    published_px: float = float("nan")
    reach: float = float("nan")
    verdict: str = ""
    codes: tuple[str, ...] = ()
    acc: tuple[float, ...] = ()
    returns: int = 0


def judged(contents: Contents, noise: NoiseOptions) -> Judged:
    """Solve and judge what a set contains.

    Raises:
        CalibrationError: the recording cannot be read.
    """
    if contents.recording is None:
        assert contents.camera is not None
        pairs = pairs_from_arrays(contents.points_radar_m, contents.pixels_px, noise=noise)
        return _judged_poses(
            partial(calibrate_pairs, pairs, contents.camera), contents.camera, contents.published, noise
        )
    options = RecordingOptions(confirm_assumptions=True)
    with open_recording(contents.recording, options, require=("radar",)) as recording:
        camera = contents.camera or required_camera(recording, None)
        if contents.boxes is not None and contents.published is not None:
            return _judged_boxes(contents.boxes, recording, camera, contents.published)
        solve = partial(_solved, recording, contents.clicks, camera)
        return _judged_poses(solve, camera, contents.published, noise)


def _solved(
    recording: Recording,
    clicks: Sequence[ReflectorClick],
    camera: Camera,
    options: CalibrationOptions,
    excluded: frozenset[str] = frozenset(),
) -> Outcome:
    """Solve a recording by its clicks, or without any."""
    if clicks:
        given = [replace(click, excluded=click.id in excluded) for click in clicks]
        return solve_clicks(recording, given, camera, options)
    placed = place_clicks(recording, camera, options)
    return placed if isinstance(placed, Unsolvable) else solve_placed_clicks(recording, placed, camera, options)


def _judged_poses(
    solve: Callable[..., Outcome], camera: Camera, published: RigidTransform | None, noise: NoiseOptions
) -> Judged:
    """Solve by the three methods; OpenCV gets the radar positions of ours."""
    ours = solve(CalibrationOptions(noise=noise))
    if isinstance(ours, Unsolvable):
        return Judged(verdict=ours.code)
    points = np.array([pair.point_radar_m for pair in ours.pairs])
    pixels = np.array([pair.pixel_px for pair in ours.pairs])
    ids = [pair.id for pair in ours.pairs]
    fits: tuple[_Fitting, ...] = (
        partial(_fit, solve, CalibrationOptions(noise=noise)),
        partial(_fit, solve, CalibrationOptions(method="paper")),
        partial(_opencv_fit, ids, points, pixels, camera),
    )
    return Judged(
        pairs=len(ids),
        set_aside=sum(not pair.inlier for pair in ours.pairs),
        poses={method: _figures(fit, ids, published) for method, fit in zip(METHODS, fits, strict=True)},
        published_px=float(distances(camera.project(published @ points), pixels).mean()) if published else np.nan,
        reach=_reach(ours, published) if published else np.nan,
        verdict=verdict_on(ours).level,
        codes=tuple(dict.fromkeys(warning.code for warning in ours.warnings)),
    )


def _fit(solve: Callable[..., Outcome], options: CalibrationOptions, excluded: frozenset[str]) -> _Fit:
    outcome = solve(options, excluded=excluded)
    if isinstance(outcome, Unsolvable):
        return outcome.code
    return outcome.camera_from_radar, {pair.id: pair.distance_px for pair in outcome.pairs}


def _opencv_fit(ids: Sequence[str], points: Points3, pixels: Points2, camera: Camera, excluded: frozenset[str]) -> _Fit:
    used = np.array([name not in excluded for name in ids])
    ransac = solve_pnp_ransac(points[used], pixels[used], camera, "sqpnp")
    if ransac is None:
        return "none"
    kept = np.flatnonzero(used)[ransac.inliers]
    pose = refine_lm(points[kept], pixels[kept], camera, ransac.camera_from_radar) or ransac.camera_from_radar
    return pose, dict(zip(ids, distances(camera.project(pose @ points), pixels).tolist(), strict=True))


def _figures(fit: _Fitting, ids: _Ids, published: RigidTransform | None) -> PoseFigures | str:
    whole = fit(frozenset())
    if isinstance(whole, str):
        return whole
    pose, distances_px = whole
    left_out_px: list[float] = []
    for fold in filter(None, (ids[i::_FOLDS] for i in range(_FOLDS))):
        others = fit(frozenset(fold))
        left_out_px += [np.nan if isinstance(others, str) else others[1][name] for name in fold]
    error_px, median_px = float(np.mean(list(distances_px.values()))), float(np.median(left_out_px))
    if published is None:
        return PoseFigures(np.nan, np.nan, error_px, median_px)
    turned = np.linalg.norm(published.error_from(pose)[3:])
    apart_m = np.linalg.norm(pose.inverse().translation_m - published.inverse().translation_m)
    return PoseFigures(float(np.rad2deg(turned)), float(100.0 * apart_m), error_px, median_px)


def _reach(ours: Calibration, published: RigidTransform) -> float:
    error = published.error_from(ours.camera_from_radar)
    return float(np.sqrt(error @ np.linalg.solve(ours.covariance, error) / ours.covariance_quantile))


def _judged_boxes(boxes: Path, recording: Recording, camera: Camera, published: RigidTransform) -> Judged:
    """Count the returns in boxes under the published pose, and turned."""
    drawn = find_boxes(str(boxes), recording)
    unknown = np.full((6, 6), np.nan)
    stated = Calibration(published, unknown, camera, Metrics(), (), (), (), CalibrationOptions())
    figures = evaluating.judged(stated, evaluating.evidence_in(recording, camera, boxes=drawn)).boxes
    counted = None if figures is None else figures.returns
    if counted is None:
        return Judged(verdict="no returns in boxes")
    low, high = counted.boxes_px[:, :2], counted.boxes_px[:, 2:]

    def share(turn_rad: np.ndarray) -> float:
        turned = RigidTransform(rotation_exp(turn_rad), np.zeros(3)) @ published
        pixels = camera.project(turned @ counted.points_radar_m)
        inside = np.asarray(((pixels >= low) & (pixels <= high)).all(axis=1))
        return acc([inside[counted.frames == frame] for frame in np.unique(counted.frames)]) or 0.0

    axes = np.concatenate([np.eye(3)[:2], -np.eye(3)[:2]])  # pitch and yaw, to both sides
    shares = tuple(float(np.mean([share(np.deg2rad(degrees) * axis) for axis in axes])) for degrees in TURNS_DEG)
    return Judged(acc=shares, returns=len(counted.targets))
