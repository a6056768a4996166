"""Pair results: the residual and influence of each pair and click under a fit, and the metrics over the inliers."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calib_core.association.placement_groups import PlacementGroup, click_sigmas, steps_of_sigma
from calib_core.camera import Camera
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import associate
from calib_core.estimation.leave_one_out import LeaveOneOut
from calib_core.estimation.linearization import Linearization
from calib_core.estimation.measurement_model import PairMeasurements, pair_measurements
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions
from calib_core.radar import cartesian_from_polar
from calib_core.results import Calibration, Metrics, PairResult
from calib_core.results.metrics import distances, metrics_of


def fit_metrics(measurements: PairMeasurements, refined: ErrorsInVariablesFit, left_out: LeaveOneOut) -> Metrics:
    """Compute the metrics of the inlier pairs; chi2 uses the assumed noise, so that a wrong assumption shows."""
    inliers = refined.inliers
    measurements = measurements.with_errors(refined.measurements.errors.values)
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


def used_pair_results(
    used: Sequence[Pair], refined: ErrorsInVariablesFit, left_out: LeaveOneOut
) -> dict[str, PairResult]:
    """Return the result of each used pair, by its id."""
    measurements = refined.measurements
    points = cartesian_from_polar(measurements.polar[refined.rows])
    projected = measurements.camera.project(refined.camera_from_radar @ points)
    inliers, expected = refined.inliers, residual_covariances(refined.model)
    return {
        pair.id: PairResult(
            id=pair.id,
            pixel_px=pair.pixel_px,
            projected_px=projected[i],
            point_radar_m=pair.candidates[chosen].position_radar_m,
            inlier=bool(inliers[i]),
            outlier_probability=float(1.0 - refined.weights[i]),
            influence=float(left_out.influence[i]),
            held_out_px=float(left_out.distance_px[i]),
            candidate=chosen,
            expected_covariance_px2=expected[i],
            image_time=pair.image_time,
            measured=pair,
        )
        for i, pair in enumerate(used)
        for chosen in (int(refined.rows[i] - measurements.first[i]),)
    }


def residual_covariances(model: Linearization) -> np.ndarray:
    """Recover S = W^-1 W^-T of each pair (n, 2, 2); NaN where the camera does not see the position."""
    unseen = np.asarray(~model.whitening.any(axis=(1, 2)))
    inverse = np.linalg.inv(np.where(unseen[:, None, None], np.eye(2), model.whitening))
    inverse[unseen] = np.nan
    return np.asarray(inverse @ np.swapaxes(inverse, 1, 2))


def excluded_pair_results(
    shown: Sequence[Pair],
    excluded: frozenset[str],
    refined: ErrorsInVariablesFit,
    camera: Camera,
    options: CalibrationOptions,
) -> dict[str, PairResult]:
    """Return the results of the excluded pairs under the pose, each with its best candidate."""
    omitted = [pair for pair in shown if pair.id in excluded]
    if not omitted:
        return {}
    measurements = pair_measurements(omitted, camera, options).scaled(refined.noise_scale)
    measurements = replace(measurements, errors=refined.measurements.errors)
    rows, model = associate(measurements, refined.camera_from_radar)
    expected = residual_covariances(model)
    results = {}
    for i, pair in enumerate(omitted):
        chosen = int(rows[i] - measurements.first[i])
        point = pair.candidates[chosen].position_radar_m
        true_point = refined.measurements.errors.radar.corrected(point[None])
        results[pair.id] = PairResult(
            id=pair.id,
            pixel_px=pair.pixel_px,
            projected_px=camera.project(refined.camera_from_radar @ true_point)[0],
            point_radar_m=point,
            inlier=False,
            excluded=True,
            candidate=chosen,
            expected_covariance_px2=expected[i],
            image_time=pair.image_time,
            measured=pair,
        )
    return results


def click_results(
    calibration: Calibration, groups: Sequence[PlacementGroup], shown: Sequence[Pair]
) -> tuple[PairResult, ...]:
    """Return one result per click: its own pixel and residual, with the return and the weight of its placement.

    Args:
        calibration: with one result per placement, and those of the excluded clicks.
        groups: the placements.
        shown: the pairs of all clicks, in the order wanted.
    """
    results = {result.id: result for result in calibration.pairs}
    for group in groups:
        if len(group.clicks) > 1:
            of_pair = results[group.pair.id]
            for click, off in zip(group.clicks, group.off, strict=True):
                results[click.id] = _click_result(calibration, of_pair, group.pair, click, off=bool(off))
    return tuple(results[pair.id] for pair in shown)


def _click_result(calibration: Calibration, result: PairResult, pair: Pair, click: Pair, *, off: bool) -> PairResult:
    steps = steps_of_sigma(click.candidates) - steps_of_sigma(pair.candidates)[result.candidate]
    chosen = int((steps**2).sum(axis=1).argmin())
    point = click.candidates[chosen].position_radar_m
    own_px, pair_px = click_sigmas((click, pair), calibration.options).tolist()
    more_px2 = max(own_px**2 - pair_px**2, 0.0) * calibration.noise_scale[0] ** 2
    return replace(
        result,
        id=click.id,
        pixel_px=click.pixel_px,
        projected_px=calibration.reproject(point[None])[0],
        point_radar_m=point,
        inlier=result.inlier and not off,
        outlier_probability=1.0 if off else result.outlier_probability,
        candidate=chosen,
        expected_covariance_px2=result.expected_covariance_px2 + more_px2 * np.eye(2),
        image_time=click.image_time,
        measured=click,
    )
