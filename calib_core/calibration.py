"""The whole of it: clicks and radar returns go in, camera_from_radar comes out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Values
from calib_core.association.pairing import pair_clicks
from calib_core.camera import Camera
from calib_core.diagnostics.checks import warnings_of
from calib_core.diagnostics.clocks import clocks
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.covariance import LeftOut, leave_one_out, pose_covariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, associate, solve_gnc
from calib_core.estimation.influential_pairs import average_over_influential_pairs, find_influential_pairs
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.linearization import Linearization
from calib_core.estimation.measurement_model import PairMeasurements, pair_measurements
from calib_core.estimation.mirror_test import MIRRORED_GAIN, mirror_gain
from calib_core.measurements import MIN_PAIRS, Pair, RadarScans, ReflectorClick, Unpaired, Unsolvable
from calib_core.metrics import distances, metrics_of
from calib_core.options import CalibrationOptions
from calib_core.radar import cartesian_from_polar
from calib_core.results import Calibration, Metrics, PairResult

__all__ = ["calibrate", "calibrate_pairs"]

_INLIER_PROBABILITY = 0.5
_STARTS_MEASURED = 3
_STARTS_FREE = 6
_OPEN_ROTATION_RAD = 0.5  # a rotation less certain than that is not known
_AGREEING_SHARE = 0.9
_PLAUSIBLE_SCALE = 1.8
_NEAR_PRIOR = 4.0  # standard deviations
_PAIRS_TO_START = 150  # more do not make a start better


def calibrate(
    clicks: Sequence[ReflectorClick], scans: RadarScans, camera: Camera, options: CalibrationOptions
) -> Calibration | Unsolvable:
    """Calibrate from clicks and radar scans.

    Args:
        clicks: in any order; excluded ones are paired and shown, but not used.
        scans: at least those around the clicks.
        camera: the intrinsics.
        options: method "paper" is Algorithm 1 as printed.
    """
    if options.method == "paper":
        from calib_core.paper.algorithm_1 import calibrate_as_printed

        return calibrate_as_printed(clicks, scans, camera, options)
    pairing = pair_clicks(clicks, scans, options)
    excluded = frozenset(click.id for click in clicks if click.excluded)
    outcome = _solved(pairing.pairs, pairing.unpaired, excluded, camera, options)
    if isinstance(outcome, Unsolvable):
        return replace(outcome, unpaired=pairing.unpaired)
    return replace(outcome, warnings=(*outcome.warnings, *clocks(outcome, scans)))


def calibrate_pairs(
    pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions, excluded: frozenset[str] = frozenset()
) -> Calibration | Unsolvable:
    """Calibrate from pairs that exist already, such as those of a pairs file.

    Args:
        pairs: in any order; results come in order of image time, pairs without a time in the order given.
        camera: the intrinsics.
        options: method "paper" is Algorithm 1 as printed, from its RANSAC on.
        excluded: ids of pairs that are shown, but not used.
    """
    if options.method == "paper":
        from calib_core.paper.algorithm_1 import solve_pairs_as_printed

        return solve_pairs_as_printed(pairs, camera, options, excluded)
    shown = sorted(pairs, key=lambda pair: (pair.image_time is not None, pair.image_time or 0))
    return _solved(tuple(shown), (), excluded, camera, options)


def _solved(
    shown: tuple[Pair, ...],
    unpaired: tuple[Unpaired, ...],
    excluded: frozenset[str],
    camera: Camera,
    options: CalibrationOptions,
) -> Calibration | Unsolvable:
    used = sorted((pair for pair in shown if pair.id not in excluded), key=_canonical)
    if len(used) < MIN_PAIRS:
        return _too_few(len(used), len(excluded), len(unpaired))
    measurements = pair_measurements(used, camera, options)
    fit = _best_fit(measurements, options)
    if isinstance(fit, Unsolvable):
        return fit
    refined = fit.refined
    uncertainty = pose_covariance(refined)
    open_rad = float(np.sqrt(uncertainty.covariance[3:, 3:].diagonal().max()))
    if not open_rad < _OPEN_ROTATION_RAD:
        return _no_shape(len(used))
    left_out = leave_one_out(refined, uncertainty.information)
    doubts = find_influential_pairs(measurements, refined, uncertainty.information)
    refined, uncertainty = average_over_influential_pairs(refined, uncertainty, doubts)
    metrics = _metrics(measurements, refined, left_out)
    findings = SolvedFit(
        ids=tuple(pair.id for pair in used),
        measurements=measurements,
        refined=refined,
        uncertainty=uncertainty,
        left_out=left_out,
        doubts=doubts,
        inliers=_inliers(refined),
        alternatives=fit.found,
        mirror_gain=fit.mirror_gain,
        chi2_per_degree=metrics.chi2 / max(metrics.degrees_of_freedom, 1),
    )
    results = _used_results(used, refined, left_out) | _excluded_results(shown, excluded, refined, camera, options)
    return Calibration(
        camera_from_radar=refined.camera_from_radar,
        covariance=uncertainty.covariance,
        camera=camera,
        metrics=metrics,
        pairs=tuple(results[pair.id] for pair in shown),
        unpaired=unpaired,
        warnings=warnings_of(findings),
        options=options,
        noise_scale=_four(refined.noise_scale),
        covariance_quantile=uncertainty.quantile,
    )


def _four(values: Values) -> tuple[float, float, float, float]:
    click, range_, azimuth, elevation = values.tolist()
    return click, range_, azimuth, elevation


def _canonical(pair: Pair) -> tuple[int, str, float, float]:
    """Order pairs so that the order they came in cannot change a bit of the result."""
    return (pair.image_time or 0, pair.id, float(pair.pixel_px[0]), float(pair.pixel_px[1]))


def _too_few(used: int, excluded: int, unpaired: int) -> Unsolvable:
    aside = "".join(f", {count} {what}" for count, what in ((excluded, "excluded"), (unpaired, "unpaired")) if count)
    return Unsolvable(
        "too-few-pairs",
        f"{used} of at least {MIN_PAIRS} pairs{aside}",
        "click the reflector at more placements; ten or more, spread over the picture, near and far, are a good set",
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """The fit, the poses the other starts ended in, and what mirrored axes would gain."""

    refined: ErrorsInVariablesFit
    found: tuple[GncSolution, ...]
    mirror_gain: float


def _best_fit(measurements: PairMeasurements, options: CalibrationOptions) -> _Fit | Unsolvable:
    """Start from several poses, keep what the pairs agree on most, and fit it."""
    estimate_scale, seed = options.noise.estimate_scale, options.solving.seed
    few = _some_pairs(measurements)
    most = _STARTS_MEASURED if measurements.prior.measured else _STARTS_FREE
    starts = initial_poses(few, most=most, rng=np.random.default_rng(seed))
    found = solve_gnc(few, starts, estimate_scale=estimate_scale)
    if not found:
        return _no_shape(len(measurements))
    refined = fit_errors_in_variables(measurements, found[0], estimate_scale=estimate_scale)
    gain = -np.inf
    if not _beyond_doubt(measurements, refined):
        fitted = refined if few is measurements else None
        gain = mirror_gain(few, found[0], plain=fitted, estimate_scale=estimate_scale, seed=seed)
    inliers = int(_inliers(refined).sum())
    if inliers < MIN_PAIRS:
        reason = f"only {inliers} of {len(measurements)} pairs agree on any pose"
        return _mirrored(reason) if gain > MIRRORED_GAIN else _no_pose(reason)
    return _Fit(refined, found, gain)


def _inliers(refined: ErrorsInVariablesFit) -> Flags:
    return np.asarray(refined.weights > _INLIER_PROBABILITY)


def _beyond_doubt(measurements: PairMeasurements, refined: ErrorsInVariablesFit) -> bool:
    """Tell whether pairs and a measured camera position agree so well that mirrored axes are out of the question."""
    agreeing = _inliers(refined).mean() >= _AGREEING_SHARE and float(refined.noise_scale.max()) < _PLAUSIBLE_SCALE
    assumed = associate(measurements, refined.camera_from_radar)[1].squared.mean() / 2.0
    agreeing = agreeing and float(assumed) < _PLAUSIBLE_SCALE**2
    prior_residual = measurements.prior.rows(refined.camera_from_radar)[0]
    return measurements.prior.measured and bool(agreeing) and float(np.linalg.norm(prior_residual)) < _NEAR_PRIOR


def _mirrored(reason: str) -> Unsolvable:
    return Unsolvable(
        "mirrored-axes",
        f"{reason}; with one radar axis mirrored they fit better",
        "radar axes must be x forward, y left, z up: flip the sign of y (or of the elevation) where the positions come from",
    )


def _some_pairs(measurements: PairMeasurements) -> PairMeasurements:
    if len(measurements) <= _PAIRS_TO_START:
        return measurements
    return measurements.some(np.linspace(0, len(measurements) - 1, _PAIRS_TO_START).round().astype(np.int64))


def _no_shape(count: int) -> Unsolvable:
    return Unsolvable(
        "degenerate-placements",
        f"the {count} placements do not fix the pose: they lie at one place or along one line",
        "spread the placements: near and far, left and right",
    )


def _no_pose(reason: str) -> Unsolvable:
    return Unsolvable(
        "no-pose",
        reason,
        "check that clicks and radar belong to the same moments, that the intrinsics are of this camera at this image "
        "size, and that the placements are spread over the picture",
    )


def _metrics(measurements: PairMeasurements, refined: ErrorsInVariablesFit, left_out: LeftOut) -> Metrics:
    """Measure the inlier pairs; chi2 is by the noise as assumed, so that a wrong assumption shows."""
    inliers = _inliers(refined)
    points = cartesian_from_polar(measurements.polar[refined.rows])
    projected = measurements.camera.project(refined.camera_from_radar @ points)
    errors = distances(projected, measurements.pixels_px)
    assumed = associate(measurements, refined.camera_from_radar)[1]
    return metrics_of(
        errors[inliers],
        held_out_distances_px=left_out.distance_px[inliers],
        chi2=float(assumed.squared[inliers].sum()),
        degrees_of_freedom=2 * int(inliers.sum()) - (3 if measurements.prior.measured else 6),
    )


def _used_results(used: Sequence[Pair], refined: ErrorsInVariablesFit, left_out: LeftOut) -> dict[str, PairResult]:
    measurements = refined.measurements
    points = cartesian_from_polar(measurements.polar[refined.rows])
    projected = measurements.camera.project(refined.camera_from_radar @ points)
    inliers, expected = _inliers(refined), _residual_covariances(refined.model)
    return {
        pair.id: PairResult(
            id=pair.id,
            pixel_px=pair.pixel_px,
            projected_px=projected[i],
            point_radar_m=pair.candidates[chosen].position_radar_m,
            inlier=bool(inliers[i]),
            outlier_probability=float(1.0 - refined.weights[i]),
            influence=float(left_out.influence[i]),
            candidate=chosen,
            expected_covariance_px2=expected[i],
            image_time=pair.image_time,
        )
        for i, pair in enumerate(used)
        for chosen in (int(refined.rows[i] - measurements.first[i]),)
    }


def _residual_covariances(model: Linearization) -> np.ndarray:
    """Recover S = W^-1 W^-T of each pair (n, 2, 2); NaN where the camera does not see the position."""
    unseen = np.asarray(~model.whitening.any(axis=(1, 2)))
    inverse = np.linalg.inv(np.where(unseen[:, None, None], np.eye(2), model.whitening))
    inverse[unseen] = np.nan
    return np.asarray(inverse @ np.swapaxes(inverse, 1, 2))


def _excluded_results(
    shown: Sequence[Pair],
    excluded: frozenset[str],
    refined: ErrorsInVariablesFit,
    camera: Camera,
    options: CalibrationOptions,
) -> dict[str, PairResult]:
    """Show the pairs left out by a person under the pose, each with the candidate that suits it best."""
    aside = [pair for pair in shown if pair.id in excluded]
    if not aside:
        return {}
    measurements = pair_measurements(aside, camera, options).scaled(refined.noise_scale)
    rows, model = associate(measurements, refined.camera_from_radar)
    expected = _residual_covariances(model)
    results = {}
    for i, pair in enumerate(aside):
        chosen = int(rows[i] - measurements.first[i])
        point = pair.candidates[chosen].position_radar_m
        results[pair.id] = PairResult(
            id=pair.id,
            pixel_px=pair.pixel_px,
            projected_px=camera.project(refined.camera_from_radar @ point[None])[0],
            point_radar_m=point,
            inlier=False,
            excluded=True,
            candidate=chosen,
            expected_covariance_px2=expected[i],
            image_time=pair.image_time,
        )
    return results
