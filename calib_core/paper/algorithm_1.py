"""Algorithm 1 of the paper as printed, one public function per line (docs/paper.md has the table).

Cheng, Sengupta, Cao: "3D Radar and Camera Co-Calibration". It serves for comparison; the default method does not use it.
Choices that the paper leaves open are in PaperOptions.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Points2, Points3, Values, Vector3, frozen_array
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import (
    MIN_PAIRS,
    NS_PER_S,
    Candidate,
    Pair,
    RadarScans,
    ReflectorClick,
    TimeNs,
    Unpaired,
    Unsolvable,
)
from calib_core.options import CalibrationOptions, PaperOptions
from calib_core.paper.checks import about_placements, judged_by_noise
from calib_core.paper.pnp import PnPSolver, refine_lm, solve_pnp_ransac, spans_a_plane
from calib_core.results import Calibration, PairResult
from calib_core.results.metrics import aed, distances, metrics_of

_ROUNDING = 1e-9  # the z-scores of two returns are exactly 1, up to rounding


@dataclass(frozen=True, slots=True, eq=False)
class ScoredPose:
    """A RANSAC pose and its mean reprojection error.

    Attributes:
        camera_from_radar: the pose.
        inliers: (n,) RANSAC's.
        mean_error_px: over all n pairs; NaN if the pose puts one of them behind the camera.
    """

    camera_from_radar: RigidTransform
    inliers: Flags
    mean_error_px: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "inliers", frozen_array(self.inliers, (None,), dtype=np.bool_))


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Where the reflector stood at a click, as far as the radar shows.

    Attributes:
        position_radar_m: (3,) [m].
        chosen: a person chose it; otherwise it is the radar's candidate with the highest score.
    """

    position_radar_m: Vector3
    chosen: bool


def clicks_by_time(clicks: Iterable[ReflectorClick]) -> tuple[ReflectorClick, ...]:
    """Algorithm 1, line 1: list the clicked pixels with the recorded stamps of their frames, sorted by time.

    The stamp is the frame's own, never "frame number over frame rate" of a video made from the recording.
    """
    return tuple(sorted(clicks))


def static_returns_as_printed(scans: RadarScans, options: PaperOptions) -> RadarScans:
    """Algorithm 1, line 2: keep the returns with velocity = 0 and range < 20 m; drop the scans left empty.

    The range is computed from x, y, z, because common drivers leave the message's own range at 0. A return without position
    or velocity (NaN) is dropped entirely; its click keeps the remaining returns.
    """
    range_m = np.linalg.norm(scans.points_radar_m, axis=1)
    with np.errstate(invalid="ignore"):
        keep = (np.abs(scans.doppler_mps) <= options.max_speed_mps) & (range_m < options.max_range_m)
    return _kept(scans, keep)


def nearest_stamp(static: RadarScans, image_time: TimeNs) -> TimeNs:
    """Algorithm 1, line 3: find the radar stamp nearest to the click's.

    Raises:
        ValueError: there are no scans.
    """
    return TimeNs(int(static.times_ns[static.nearest(image_time)]))


def window_of(static: RadarScans, radar_time: TimeNs, options: PaperOptions) -> RadarScans:
    """Algorithm 1, line 4: take the returns of the 3 s around that stamp."""
    if options.window == "whole-second":
        second = int(radar_time) // NS_PER_S * NS_PER_S
        return static.between(TimeNs(second - NS_PER_S), TimeNs(second + NS_PER_S))
    half_ns = round(options.window_s * NS_PER_S / 2)
    return static.between(TimeNs(radar_time - half_ns), TimeNs(radar_time + half_ns))


def in_placement_range(window: RadarScans, placement: Placement | None, options: PaperOptions) -> RadarScans:
    """Keep the returns within `region_m` of the placement, as the text after the z-score asks: "filtered based on whether the
    calibration target is static and its placement range". The pseudocode has no such line.
    """
    if placement is None or not options.region_m:
        return window
    near = np.linalg.norm(window.points_radar_m - placement.position_radar_m, axis=1) <= options.region_m
    return _kept(window, near)


def z_score_inliers(points_radar_m: Points3, options: PaperOptions) -> Flags:
    """Algorithm 1, line 5: keep the returns whose z-score is small on x, on y and on z: (n,).

    z = (value - mean) / standard deviation, divided by N as SciPy's zscore does; an axis without spread rejects nothing.
    """
    keep = np.ones(len(points_radar_m), dtype=np.bool_)
    judged = keep
    for axis in range(3):
        values = points_radar_m[judged, axis]
        passed = np.zeros_like(keep)
        passed[judged] = np.abs(_z_scores(values)) <= options.z_score_threshold + _ROUNDING
        keep = keep & passed
        if options.z_score_axes == "in-turn":
            judged = keep
    return keep


def mean_position(points_radar_m: Points3, inliers: Flags) -> Vector3:
    """Algorithm 1, line 6: average the inliers: the click's radar position (3,) [m].

    The mean of a window that contains two objects lies between them. This is kept as the paper prints it.
    """
    return np.asarray(points_radar_m[inliers].mean(axis=0), dtype=np.float64)


def pose_by_iterative_ransac(
    points_radar_m: Points3, pixels_px: Points2, camera: Camera, options: PaperOptions
) -> ScoredPose | None:
    """Algorithm 1, line 7: solve PnP by RANSAC with the iterative solver; None if RANSAC finds nothing."""
    return _pose_by_ransac(points_radar_m, pixels_px, camera, options, "iterative")


def pose_by_sqpnp_ransac(
    points_radar_m: Points3, pixels_px: Points2, camera: Camera, options: PaperOptions
) -> ScoredPose | None:
    """Algorithm 1, line 8: solve PnP by RANSAC with SQPnP; None if RANSAC finds nothing."""
    return _pose_by_ransac(points_radar_m, pixels_px, camera, options, "sqpnp")


def pose_of_smaller_error(iterative: ScoredPose | None, sqpnp: ScoredPose | None) -> ScoredPose | None:
    """Algorithm 1, line 9: take the pose with the smaller mean reprojection error; of two equal ones, as printed, SQPnP's."""
    if iterative is None or sqpnp is None:
        return iterative or sqpnp
    first, second = (np.inf if np.isnan(pose.mean_error_px) else pose.mean_error_px for pose in (iterative, sqpnp))
    return iterative if first < second else sqpnp


def refined_on_all_pairs(
    points_radar_m: Points3, pixels_px: Points2, camera: Camera, camera_from_radar: RigidTransform
) -> RigidTransform | None:
    """Algorithm 1, line 10: refine by Levenberg-Marquardt on ALL pairs, RANSAC's outliers included, as printed."""
    return refine_lm(points_radar_m, pixels_px, camera, camera_from_radar)


def pair_as_printed(
    click: ReflectorClick, static: RadarScans, options: CalibrationOptions, placement: Placement | None = None
) -> Pair | Unpaired:
    """Algorithm 1, lines 3 to 6 for one click: return its pair, or why it has none.

    Args:
        click: one click.
        static: the returns kept by line 2.
        options: the paper's, and the largest time gap to a scan, which the paper does not give.
        placement: where the reflector stood; None for no placement range.
    """
    if not len(static):
        return _nothing_static(click, options)
    radar_time = nearest_stamp(static, click.image_time)
    gap_s = abs(int(radar_time) - int(click.image_time)) / NS_PER_S
    if gap_s > options.locating.max_time_gap_s:
        return _nothing_static(click, options, gap_s)
    window = window_of(static, radar_time, options.paper)
    around = in_placement_range(window, placement, options.paper)
    if placement is not None and len(window.points_radar_m) and not len(around.points_radar_m):
        facts = {"returns": len(window.points_radar_m), "region_m": options.paper.region_m}
        return Unpaired("nothing-in-range", facts, id=click.id)
    window = around
    inliers = z_score_inliers(window.points_radar_m, options.paper)
    if not inliers.any():
        return Unpaired(
            "no-z-score-inlier",
            {"returns": len(inliers), "z_score_threshold": options.paper.z_score_threshold},
            id=click.id,
        )
    snr_db = window.snr_db[inliers]
    position = Candidate(
        position_radar_m=mean_position(window.points_radar_m, inliers),
        sigma_polar=np.full(3, np.nan),
        covariance_m2=np.full((3, 3), np.nan),
        returns=int(inliers.sum()),
        scans=len(np.unique(window.scan_of_return()[inliers])),
        snr_db=float(snr_db[np.isfinite(snr_db)].mean()) if np.isfinite(snr_db).any() else float("nan"),
    )
    return Pair(
        id=click.id,
        pixel_px=np.array([click.u_px, click.v_px]),
        candidates=(position,),
        sigma_px=click.sigma_px,
        image_time=click.image_time,
        radar_time=radar_time,
        mark=click.mark,
        chosen=click.chosen,
    )


def calibrate_as_printed(
    clicks: Iterable[ReflectorClick],
    scans: RadarScans,
    camera: Camera,
    options: CalibrationOptions,
    placements: Mapping[str, Placement] | None = None,
) -> Calibration | Unsolvable:
    """Run Algorithm 1, lines 1 to 10. The order of the clicks does not matter.

    Args:
        clicks: excluded ones are not used, but appear in the result.
        scans: of the radar, as recorded.
        camera: intrinsics.
        options: `paper` contains the choices that the paper leaves open.
        placements: where the reflector stood, by the ids of clicks; a click without one has no placement range.
    """
    placements = placements or {}
    ordered = clicks_by_time(clicks)
    static = static_returns_as_printed(scans, options.paper)
    found = [pair_as_printed(click, static, options, placements.get(click.id)) for click in ordered]
    unpaired = tuple(pair for pair in found if isinstance(pair, Unpaired))
    outcome = _solved(
        [pair for pair in found if isinstance(pair, Pair)],
        camera,
        options,
        excluded=frozenset(click.id for click in ordered if not click.counts),
        unpaired=unpaired,
    )
    if isinstance(outcome, Unsolvable):
        return replace(outcome, unpaired=unpaired, pairs=tuple(pair for pair in found if isinstance(pair, Pair)))
    used = [placements[click.id].chosen for click in ordered if click.id in placements]
    return replace(outcome, warnings=(*outcome.warnings, *about_placements(ordered, used, options.paper)))


def solve_pairs_as_printed(
    pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions, excluded: frozenset[str] = frozenset()
) -> Calibration | Unsolvable:
    """Run Algorithm 1, lines 7 to 10, on existing pairs, using the first radar position of each.

    Args:
        pairs: in any order; results come by image time, pairs without a time in the order given.
        camera: intrinsics.
        options: `paper` contains the choices that the paper leaves open.
        excluded: ids of pairs that are not used, but appear in the result.
    """
    return _solved(pairs, camera, options, excluded=excluded, unpaired=())


def _solved(
    pairs: Sequence[Pair],
    camera: Camera,
    options: CalibrationOptions,
    *,
    excluded: frozenset[str],
    unpaired: tuple[Unpaired, ...],
) -> Calibration | Unsolvable:
    ordered = sorted(pairs, key=lambda pair: pair.image_time or 0)  # stable: pairs without a time stay as given
    used = sorted(
        (pair for pair in pairs if pair.id not in excluded), key=lambda pair: (pair.image_time or 0, pair.id)
    )  # RANSAC draws the same samples whatever the order of the input
    if len(used) < MIN_PAIRS:
        facts = {
            "used": len(used),
            "needed": MIN_PAIRS,
            "excluded": len(ordered) - len(used),
            "unpaired": len(unpaired),
        }
        return Unsolvable("too-few-pairs", facts)
    points_radar_m = np.stack([pair.candidates[0].position_radar_m for pair in used])
    pixels_px = np.stack([pair.pixel_px for pair in used])
    if not spans_a_plane(points_radar_m):
        return Unsolvable("points-in-one-line", {"pairs": len(used)})
    iterative = pose_by_iterative_ransac(points_radar_m, pixels_px, camera, options.paper)
    sqpnp = pose_by_sqpnp_ransac(points_radar_m, pixels_px, camera, options.paper)
    better = pose_of_smaller_error(iterative, sqpnp)
    if better is None:
        return Unsolvable("no-consensus", {"pairs": len(used), "threshold_px": options.paper.ransac_threshold_px})
    camera_from_radar = refined_on_all_pairs(points_radar_m, pixels_px, camera, better.camera_from_radar)
    if camera_from_radar is None:
        return Unsolvable("refinement-diverged")
    agreeing, warnings = judged_by_noise(
        [pair.id for pair in used], points_radar_m, pixels_px, camera, camera_from_radar, better.inliers, options
    )
    agree = frozenset(pair.id for pair, agrees in zip(used, agreeing, strict=True) if agrees)
    results = tuple(_result(pair, camera, camera_from_radar, pair.id in agree, excluded) for pair in ordered)
    distances_px = np.sort([result.distance_px for result in results if not result.excluded])
    return Calibration(
        camera_from_radar=camera_from_radar,
        covariance=np.full((6, 6), np.nan),
        camera=camera,
        metrics=metrics_of(distances_px[np.isfinite(distances_px)]),
        pairs=results,
        unpaired=unpaired,
        warnings=warnings,
        options=options,
        iterative_px=float("nan") if iterative is None else iterative.mean_error_px,
        sqpnp_px=float("nan") if sqpnp is None else sqpnp.mean_error_px,
    )


def _result(
    pair: Pair, camera: Camera, camera_from_radar: RigidTransform, inlier: bool, excluded: frozenset[str]
) -> PairResult:
    point_radar_m = pair.candidates[0].position_radar_m
    return PairResult(
        id=pair.id,
        pixel_px=pair.pixel_px,
        projected_px=camera.project(camera_from_radar @ point_radar_m[None])[0],
        point_radar_m=point_radar_m,
        inlier=inlier,
        excluded=pair.id in excluded,
        image_time=pair.image_time,
        measured=pair,
    )


def _pose_by_ransac(
    points_radar_m: Points3, pixels_px: Points2, camera: Camera, options: PaperOptions, solver: PnPSolver
) -> ScoredPose | None:
    solution = solve_pnp_ransac(
        points_radar_m,
        pixels_px,
        camera,
        solver,
        threshold_px=options.ransac_threshold_px,
        iterations=options.ransac_iterations,
        confidence=options.ransac_confidence,
    )
    if solution is None:
        return None
    projected_px = camera.project(solution.camera_from_radar @ points_radar_m)
    return ScoredPose(solution.camera_from_radar, solution.inliers, aed(distances(projected_px, pixels_px)))


def _kept(scans: RadarScans, keep: Flags) -> RadarScans:
    """Keep some returns; scans left empty are dropped."""
    kept = scans.take(np.flatnonzero(keep))
    filled = np.diff(kept.first_return) > 0
    first_return = np.append(kept.first_return[:-1][filled], len(kept.points_radar_m))
    return replace(kept, times_ns=kept.times_ns[filled], first_return=first_return)


def _z_scores(values: Values) -> Values:
    if not len(values):
        return values
    spread = float(values.std())
    return (values - values.mean()) / spread if spread > 0.0 else np.zeros_like(values)


def _nothing_static(click: ReflectorClick, options: CalibrationOptions, gap_s: float | None = None) -> Unpaired:
    return Unpaired(
        "no-static-return",
        {
            "paper": True,
            "gap_s": gap_s,
            "fastest_mps": options.paper.max_speed_mps,
            "farthest_m": options.paper.max_range_m,
        },
        id=click.id,
    )
