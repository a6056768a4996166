"""The whole pipeline: clicks and radar returns go in, camera_from_radar comes out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.advice.angle_map import learn_angle_map
from calib_core.advice.next_placement import next_placement
from calib_core.arrays import Values
from calib_core.association.clustering import candidate_at
from calib_core.association.pairing import pair_clicks
from calib_core.camera import Camera
from calib_core.diagnostics.checks import warnings_of
from calib_core.diagnostics.clocks import CLOCK_CODES, clocks
from calib_core.diagnostics.picture import picture_sigma_px
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.errors import InputError
from calib_core.estimation.covariance import pose_covariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, associate, solve_gnc
from calib_core.estimation.influential_pairs import average_over_influential_pairs, find_influential_pairs
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.leave_one_out import leave_one_out
from calib_core.estimation.measurement_model import PairMeasurements, pair_measurements
from calib_core.estimation.mirror_test import MIRRORED_GAIN, mirror_gain
from calib_core.estimation.pair_results import excluded_pair_results, fit_metrics, used_pair_results
from calib_core.measurements import MIN_PAIRS, Pair, RadarScans, ReflectorClick, Unpaired, Unsolvable
from calib_core.option_checks import checked_options
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration

__all__ = ["calibrate", "calibrate_pairs", "solve_again"]

_STARTS_MEASURED = 3
_STARTS_FREE = 6
_UNDETERMINED_ROTATION_RAD = 0.5  # a larger standard deviation means that the pairs do not determine the rotation
_AGREEING_SHARE = 0.9
_PLAUSIBLE_SCALE = 1.8
_NEAR_PRIOR = 4.0  # standard deviations
_PAIRS_TO_START = 150  # more do not improve the initialization


def calibrate(
    clicks: Sequence[ReflectorClick], scans: RadarScans, camera: Camera, options: CalibrationOptions | None = None
) -> Calibration | Unsolvable:
    """Calibrate from clicks and radar scans.

    Args:
        clicks: in any order; excluded ones are paired and shown, but not used.
        scans: at least those around the clicks.
        camera: the intrinsics.
        options: None takes the defaults; method "paper" is Algorithm 1 as printed.
    """
    options = checked_options(options or CalibrationOptions())
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
    pairs: Sequence[Pair],
    camera: Camera,
    options: CalibrationOptions | None = None,
    excluded: frozenset[str] = frozenset(),
) -> Calibration | Unsolvable:
    """Calibrate from existing pairs, such as those of a pairs file.

    Args:
        pairs: in any order; results come in order of image time, pairs without a time in the order given.
        camera: the intrinsics.
        options: None takes the defaults; method "paper" is Algorithm 1 as printed, from its RANSAC on.
        excluded: ids of pairs that are shown, but not used.
    """
    options = checked_options(options or CalibrationOptions())
    if options.method == "paper":
        from calib_core.paper.algorithm_1 import solve_pairs_as_printed

        return solve_pairs_as_printed(pairs, camera, options, excluded)
    shown = sorted(pairs, key=lambda pair: (pair.image_time is not None, pair.image_time or 0))
    return _solved(tuple(shown), (), excluded, camera, options)


def solve_again(calibration: Calibration, options: CalibrationOptions | None = None) -> Calibration | Unsolvable:
    """Solve again from the pairs that a calibration kept; with the same options the result is the same, bit for bit.

    Whatever depends on the recording is copied: clicks without a radar position, and the warnings about clocks.

    Args:
        calibration: solved here, or read from a calibration-1 file.
        options: None takes the calibration's own.

    Raises:
        InputError: the calibration does not contain the candidates of its pairs.
    """
    kept = [pair.measured for pair in calibration.pairs if pair.measured is not None]
    if not calibration.pairs:
        raise InputError("contains a pose but no pairs; solve from the recording and the clicks")
    if len(kept) < len(calibration.pairs):
        raise InputError(
            f"{len(calibration.pairs) - len(kept)} of {len(calibration.pairs)} pairs have no candidates, as in files that "
            "older versions and other tools wrote; solve from the recording and the clicks"
        )
    options = options or calibration.options
    if options.method != "paper":
        kept = [_with_noise(pair, options) for pair in kept]
    excluded = frozenset(pair.id for pair in calibration.pairs if pair.excluded)
    outcome = calibrate_pairs(kept, calibration.camera, options, excluded)
    if isinstance(outcome, Unsolvable):
        return replace(outcome, unpaired=calibration.unpaired)
    clock_warnings = [warning for warning in calibration.warnings if warning.code in CLOCK_CODES]
    return replace(outcome, unpaired=calibration.unpaired, warnings=(*outcome.warnings, *clock_warnings))


def _with_noise(pair: Pair, options: CalibrationOptions) -> Pair:
    """Add the assumed noise to candidates of the paper's method, which has no noise model."""
    if all(np.isfinite(candidate.sigma_polar).all() for candidate in pair.candidates):
        return pair
    return replace(pair, candidates=tuple(candidate_at(one.position_radar_m, options.noise) for one in pair.candidates))


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
    uncertainty = pose_covariance(refined, options.radar)
    rotation_sigma_rad = float(np.sqrt(uncertainty.covariance[3:, 3:].diagonal().max()))
    if not rotation_sigma_rad < _UNDETERMINED_ROTATION_RAD:
        return _degenerate(len(used))
    left_out = leave_one_out(refined, uncertainty.information)
    influential = find_influential_pairs(measurements, refined, uncertainty)
    refined, uncertainty = average_over_influential_pairs(refined, uncertainty, influential)
    metrics = fit_metrics(measurements, refined, left_out)
    solved_fit = SolvedFit(
        ids=tuple(pair.id for pair in used),
        measurements=measurements,
        refined=refined,
        uncertainty=uncertainty,
        left_out=left_out,
        influential_pairs=influential,
        inliers=refined.inliers,
        alternatives=fit.found,
        mirror_gain=fit.mirror_gain,
        chi2_per_degree=metrics.chi2 / max(metrics.degrees_of_freedom, 1),
        options=options,
    )
    results = used_pair_results(used, refined, left_out) | excluded_pair_results(
        shown, excluded, refined, camera, options
    )
    calibration = Calibration(
        camera_from_radar=refined.camera_from_radar,
        covariance=uncertainty.covariance,
        camera=camera,
        metrics=replace(metrics, picture_sigma_px=picture_sigma_px(refined, uncertainty)),
        pairs=tuple(results[pair.id] for pair in shown),
        unpaired=unpaired,
        warnings=warnings_of(solved_fit),
        options=options,
        noise_scale=_four(refined.noise_scale),
        covariance_quantile=uncertainty.quantile,
        radar_errors=refined.measurements.errors.radar,
        systematic_errors=uncertainty.systematic_errors,
    )
    angle_map = learn_angle_map(calibration)
    return replace(
        calibration,
        angle_map=angle_map if angle_map is not None and angle_map.pays else None,
        next_placement=next_placement(calibration),
    )


def _four(values: Values) -> tuple[float, float, float, float]:
    click, range_, azimuth, elevation = values.tolist()
    return click, range_, azimuth, elevation


def _canonical(pair: Pair) -> tuple[int, str, float, float]:
    """Return a sort key, so that the input order cannot change a bit of the result."""
    return (pair.image_time or 0, pair.id, float(pair.pixel_px[0]), float(pair.pixel_px[1]))


def _too_few(used: int, excluded: int, unpaired: int) -> Unsolvable:
    others = "".join(f", {count} {what}" for count, what in ((excluded, "excluded"), (unpaired, "unpaired")) if count)
    return Unsolvable(
        "too-few-pairs",
        f"{used} of at least {MIN_PAIRS} required pairs{others}",
        "click the reflector at more placements: ten or more, near and far, spread over the picture",
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """The fit, the GNC solutions of all starts, and the likelihood gain of mirrored axes."""

    refined: ErrorsInVariablesFit
    found: tuple[GncSolution, ...]
    mirror_gain: float


def _best_fit(measurements: PairMeasurements, options: CalibrationOptions) -> _Fit | Unsolvable:
    """Run GNC from several initial poses and fit errors in variables from the most likely solution."""
    estimate_scale, seed = options.noise.estimate_scale, options.solving.seed
    few = _some_pairs(measurements)
    most = _STARTS_MEASURED if measurements.prior.measured else _STARTS_FREE
    starts = initial_poses(few, most=most, rng=np.random.default_rng(seed))
    found = solve_gnc(few, starts, estimate_scale=estimate_scale)
    if not found:
        return _degenerate(len(measurements))
    refined = fit_errors_in_variables(measurements, found[0], estimate_scale=estimate_scale)
    gain = -np.inf
    if not _clearly_not_mirrored(measurements, refined):
        fitted = refined if few is measurements else None
        gain = mirror_gain(few, found[0], plain=fitted, estimate_scale=estimate_scale, seed=seed)
    inliers = int(refined.inliers.sum())
    if inliers < MIN_PAIRS:
        reason = f"only {inliers} of {len(measurements)} pairs agree on any pose"
        return _mirrored(reason) if gain > MIRRORED_GAIN else _no_pose(reason)
    return _Fit(refined, found, gain)


def _clearly_not_mirrored(measurements: PairMeasurements, refined: ErrorsInVariablesFit) -> bool:
    """Return whether pairs and a measured camera position agree so well that mirrored axes need no test."""
    agreeing = refined.inliers.mean() >= _AGREEING_SHARE and float(refined.noise_scale.max()) < _PLAUSIBLE_SCALE
    assumed = associate(measurements, refined.camera_from_radar)[1].squared.mean() / 2.0
    agreeing = agreeing and float(assumed) < _PLAUSIBLE_SCALE**2
    prior_residual = measurements.prior.rows(refined.camera_from_radar)[0]
    return measurements.prior.measured and bool(agreeing) and float(np.linalg.norm(prior_residual)) < _NEAR_PRIOR


def _mirrored(reason: str) -> Unsolvable:
    return Unsolvable(
        "mirrored-axes",
        f"{reason}; with one radar axis mirrored they fit better",
        "radar axes must be x forward, y left, z up: flip the sign of y (or of the elevation) at the source",
    )


def _some_pairs(measurements: PairMeasurements) -> PairMeasurements:
    if len(measurements) <= _PAIRS_TO_START:
        return measurements
    return measurements.some(np.linspace(0, len(measurements) - 1, _PAIRS_TO_START).round().astype(np.int64))


def _degenerate(count: int) -> Unsolvable:
    return Unsolvable(
        "degenerate-placements",
        f"the {count} placements do not determine the pose: they lie at one place or on one line",
        "spread the placements: near and far, left and right",
    )


def _no_pose(reason: str) -> Unsolvable:
    return Unsolvable(
        "no-pose",
        reason,
        "check that clicks and radar data are from the same times, that the intrinsics belong to this camera at this "
        "image size, and that the placements are spread over the picture",
    )
