"""Pair results: the residual and influence of each pair and click under a fit, and the metrics over the inliers.

Under a solved pose also how well each radar return that may belong to a click explains it (`candidate_fits`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Points3, Values, Vector2, Vector3, frozen_array
from calib_core.association.placement_groups import PlacementGroup, click_sigmas, placement_groups, steps_of_sigma
from calib_core.camera import Camera
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import associate
from calib_core.estimation.leave_one_out import LeaveOneOut
from calib_core.estimation.measurement_model import LEAST_SCORE, Linearization, PairMeasurements, pair_measurements
from calib_core.measurements import Candidate, DataWarning, Pair
from calib_core.options import CalibrationOptions
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar, sigma_polar_of
from calib_core.results import Calibration, Metrics, PairResult
from calib_core.results.calibration import CHI2_999_2
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
            rival=max(int(refined.rivals[i] - measurements.first[i]), -1),
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
    own, others = steps_of_sigma(click.candidates), steps_of_sigma(pair.candidates)
    chosen, rival = (
        int(((own - others[k]) ** 2).sum(axis=1).argmin()) if k >= 0 else -1 for k in (result.candidate, result.rival)
    )
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
        rival=rival if rival != chosen else -1,
        expected_covariance_px2=result.expected_covariance_px2 + more_px2 * np.eye(2),
        image_time=click.image_time,
        measured=click,
    )


def excluded_by_residual(calibration: Calibration) -> list[DataWarning]:
    """Warn of pairs that the user left out because of their residuals: they would agree, and are longer than chance makes them.

    Residuals are compared as predictions: an excluded pair has no part in the pose, of the others leave-one-out counts. By chance
    the ranks of k among n have a sum more than two standard deviations above its mean in 2.3 % (Wilcoxon).
    """
    kept = [pair for pair in calibration.pairs if pair.inlier and not pair.excluded]
    chosen = [pair for pair in calibration.pairs if pair.excluded and _would_agree(calibration, pair)]
    if not kept:
        return []
    k, m = len(chosen), len(kept)
    longer = ((m + 3.0) / max(m - 3.0, 1.0)) ** 0.5  # a prediction than a residual, with 6 parameters of 2 m values
    kept_px = [p.held_out_px if np.isfinite(p.held_out_px) else longer * p.distance_px for p in kept]
    lengths_px = np.array([pair.distance_px for pair in chosen])
    above = float((lengths_px[:, None] > np.array(kept_px)).sum()) - 0.5 * k * m
    # variance of the number of pairs above (Wilcoxon, Mann and Whitney): k m (k + m + 1) / 12
    if above <= _BY_CHANCE * (k * m * (k + m + 1) / 12.0) ** 0.5:
        return []
    metrics = calibration.metrics
    all_px = (metrics.n * metrics.aed_px + lengths_px.sum()) / (metrics.n + k)
    facts = {"ids": [pair.id for pair in chosen], "aed_px": metrics.aed_px, "all_aed_px": float(all_px)}
    return [DataWarning("excluded-by-residual", facts)]


def _would_agree(calibration: Calibration, pair: PairResult) -> bool:
    """Return whether an excluded pair fits the pose; without a noise model all that is seen does."""
    measured = pair.measured
    if measured is None or measured.mark == "untouched" or not np.isfinite(pair.distance_px):
        return False
    (fit,) = candidate_fits(calibration, measured, (measured.candidates[pair.candidate],))
    return not fit.squared > CHI2_999_2


def averaged_distances_px(calibration: Calibration) -> Values:
    """Return the residuals (n,) [px] that the AED averages: of the placements that agree, as pose and radar errors project them.

    The paper's method averages all clicks that are used. A file without the candidates of its pairs cannot be divided into
    placements; each of its clicks counts.
    """
    used, as_printed = [pair for pair in calibration.pairs if not pair.excluded], not calibration.options.models_noise
    measured = [pair.measured for pair in used if pair.measured is not None]
    if as_printed or len(measured) < len(used):
        averaged = [(pair.point_radar_m, pair.pixel_px) for pair in used if pair.inlier or as_printed]
    else:
        results = {pair.id: pair for pair in used}
        groups = placement_groups(measured, calibration.options)
        averaged = [(_return_of(group, results), group.pair.pixel_px) for group in groups if _agrees(group, results)]
    points_radar_m, pixels_px = (np.array([one[k] for one in averaged]).reshape(-1, 3 - k) for k in (0, 1))
    return distances(calibration.reproject(points_radar_m), pixels_px)


def _agrees(group: PlacementGroup, results: Mapping[str, PairResult]) -> bool:
    return any(results[click.id].inlier for click in group.clicks)


def _return_of(group: PlacementGroup, results: Mapping[str, PairResult]) -> Vector3:
    """Return the radar position (3,) that the pair of a placement uses, from the results of its clicks."""
    click = next(click for click in group.clicks if results[click.id].inlier)
    own = steps_of_sigma(click.candidates)[results[click.id].candidate]
    nearest = ((steps_of_sigma(group.pair.candidates) - own) ** 2).sum(axis=1).argmin()
    return group.pair.candidates[int(nearest)].position_radar_m


_BY_CHANCE = 2.0  # standard deviations
_NONE_OF_THEM = 0.1
"""Probability, before the click is compared, that none of the candidates is the reflector."""


@dataclass(frozen=True, slots=True, eq=False)
class CandidateFit:
    """One candidate of a click under a solved pose.

    Attributes:
        projected_px: (2,) its reprojection; NaN if the camera does not see it.
        distance_px: from the click; NaN likewise.
        squared: Mahalanobis distance squared of the click from the reprojection, two degrees of freedom; NaN if the
            candidate or the pose has no noise model.
        probability: that it is the reflector, given the click, the pose and the other candidates; NaN likewise.
    """

    projected_px: Vector2
    distance_px: float
    squared: float
    probability: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "projected_px", frozen_array(self.projected_px, (2,)))


def candidate_fits(calibration: Calibration, pair: Pair, candidates: Sequence[Candidate]) -> tuple[CandidateFit, ...]:
    """Evaluate candidates of a click under a pose.

    The probability weighs each candidate's score with the density of the click under the noise of click, return and pose,
    against an even density over the image for none of them.

    Args:
        calibration: the solved pose.
        pair: the click.
        candidates: any radar positions that may belong to it.
    """
    if not candidates:
        return ()
    points = np.array([candidate.position_radar_m for candidate in candidates])
    projected = calibration.reproject(points)
    away = projected - pair.pixel_px
    sigmas = np.array([candidate.sigma_polar for candidate in candidates])
    covariances = reprojection_covariances(calibration, points, sigmas, sigma_px=pair.sigma_px)
    with np.errstate(invalid="ignore"):
        squared = np.einsum("ni,nij,nj->n", away, np.linalg.pinv(np.nan_to_num(covariances)), away)
    squared[~np.isfinite(covariances).all(axis=(1, 2))] = np.nan
    scores = np.array([candidate.score for candidate in candidates])
    probabilities = _probabilities(calibration, scores, squared, covariances)
    distances = np.linalg.norm(away, axis=1).tolist()
    rows = zip(projected, distances, squared.tolist(), probabilities.tolist(), strict=True)
    return tuple(CandidateFit(*row) for row in rows)


def reprojection_covariances(
    calibration: Calibration, reported: Points3, sigma_polar: Points3 | None = None, *, sigma_px: float | None = None
) -> np.ndarray:
    """Return the covariance (n, 2, 2) [px^2] of click minus reprojection; NaN where it is not known.

    Args:
        calibration: the solved pose.
        reported: (n, 3) radar positions.
        sigma_polar: (n, 3) standard deviations of range [m], azimuth and elevation [rad]; as the options state by default.
        sigma_px: of the click, per axis; as the options state by default.
    """
    noise, stated = calibration.noise_scale, calibration.options.noise
    sigma_px = stated.sigma_px if sigma_px is None else sigma_px
    sigmas = (sigma_polar_of(stated) if sigma_polar is None else sigma_polar) * np.array(noise[1:])
    true_points = calibration.radar_errors.corrected(reported)
    camera_from_radar = calibration.camera_from_radar
    _, by_point = calibration.camera.project_with_jacobian(camera_from_radar @ true_points)
    by_radar = by_point @ camera_from_radar.rotation
    of_return = by_radar @ covariance_from_sigma_polar(reported, sigmas) @ np.swapaxes(by_radar, 1, 2)
    return np.asarray(
        (sigma_px * noise[0]) ** 2 * np.eye(2) + of_return + calibration.pixel_covariance(true_points), dtype=np.float64
    )


def _probabilities(calibration: Calibration, scores: Values, squared: Values, covariances: np.ndarray) -> Values:
    """Return the probability (n,) of each candidate; NaN where its fit is not known."""
    known = np.isfinite(squared)
    if not known.any():
        return np.full(len(scores), np.nan)
    camera = calibration.camera
    density = np.zeros(len(scores))
    spread = np.sqrt(np.linalg.det(covariances[known]))
    density[known] = np.exp(-0.5 * squared[known]) / (2.0 * np.pi * spread)
    weight = (1.0 - _NONE_OF_THEM) * np.clip(scores, LEAST_SCORE, 1.0) * density
    nothing = _NONE_OF_THEM / (camera.width_px * camera.height_px)
    return np.where(known, weight / (weight.sum() + nothing), np.nan)
