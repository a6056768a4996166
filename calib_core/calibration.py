"""The whole pipeline: clicks and radar returns go in, camera_from_radar comes out."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

import calib_core.words  # noqa: F401  str() of an answer is made there
from calib_core.arrays import Values
from calib_core.association.array_pairs import checked_pairs
from calib_core.association.clustering import candidate_at
from calib_core.association.pairing import pair_clicks
from calib_core.association.placement_groups import PlacementGroup, placement_groups
from calib_core.camera import Camera
from calib_core.diagnostics.angle_map import learn_angle_map
from calib_core.diagnostics.checks import flat_radar, warnings_of, without_consequences
from calib_core.diagnostics.clocks import CLOCK_CODES, clocks, clocks_apart
from calib_core.diagnostics.next_placement import next_placement
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.diagnostics.uncertainty_map import picture_sigma_px
from calib_core.errors import InputError
from calib_core.estimation import unsolved
from calib_core.estimation.alternative_poses import find_alternatives
from calib_core.estimation.best_fit import best_fit, quick_fit
from calib_core.estimation.covariance import PoseCovariance, pose_covariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.leave_one_out import LeaveOneOut, leave_one_out
from calib_core.estimation.measurement_model import PairMeasurements, pair_measurements
from calib_core.estimation.pair_results import (
    click_results,
    excluded_by_residual,
    excluded_pair_results,
    fit_metrics,
    used_pair_results,
)
from calib_core.estimation.plausibility import implausible_input
from calib_core.measurements import MIN_PAIRS, Pair, RadarScans, ReflectorClick, Unpaired, Unsolvable
from calib_core.options import CalibrationOptions, Method, checked_options
from calib_core.radar import cartesian_from_polar
from calib_core.results import Calibration
from calib_core.results.systematic_errors import useless_covariance

_UNDETERMINED_ROTATION_RAD = 0.5  # a larger standard deviation means that the pairs do not determine the rotation


def calibrate(
    clicks: Sequence[ReflectorClick],
    scans: RadarScans,
    camera: Camera,
    options: CalibrationOptions | None = None,
    *,
    background: RadarScans | None = None,
) -> Calibration | Unsolvable:
    """Calibrate from clicks and radar scans.

    Args:
        clicks: in any order; excluded ones are paired and shown, but not used.
        scans: at least those around the clicks.
        camera: the intrinsics.
        options: None takes the defaults; `METHODS` has the methods.
        background: scans of the whole recording, to tell what stands there before and after each placement; optional.
    """
    *_, outcome = calibration_steps(clicks, scans, camera, options, background=background, preview=False)
    return outcome


def calibration_steps(
    clicks: Sequence[ReflectorClick],
    scans: RadarScans,
    camera: Camera,
    options: CalibrationOptions | None = None,
    *,
    background: RadarScans | None = None,
    previous: Calibration | None = None,
    preview: bool = True,
) -> Iterator[Calibration | Unsolvable]:
    """Calibrate in two steps: first a preview with pose and local covariance, then the answer, the same as `calibrate`'s.

    The preview is marked as being checked: the tests for mirrored axes, for pairs that all rests on and for other poses
    follow with the answer, and may change it. No preview is made with the paper's method.

    Args:
        clicks: in any order; excluded ones are paired and shown, but not used.
        scans: at least those around the clicks.
        camera: the intrinsics.
        options: None takes the defaults.
        background: scans of the whole recording, to tell what stands there before and after each placement; optional.
        previous: the answer to nearly the same clicks, to start the preview from.
        preview: make one.
    """
    options = checked_options(options or CalibrationOptions())
    given = MethodInput(
        camera,
        options,
        clicks=clicks,
        scans=scans,
        background=background,
        previous=previous,
        preview=preview,
    )
    yield from METHODS[options.method](given)


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
        options: None takes the defaults; `METHODS` has the methods.
        excluded: ids of pairs that are shown, but not used.

    Raises:
        InputError: a pair contains a number that is impossible, or an id occurs twice.
    """
    options = checked_options(options or CalibrationOptions())
    given = MethodInput(camera, options, pairs=pairs, excluded=excluded)
    *_, outcome = METHODS[options.method](given)
    return outcome


@dataclass(frozen=True, slots=True, eq=False)
class MethodInput:
    """What a method is given: clicks and scans, or pairs.

    Attributes:
        camera: the intrinsics.
        options: checked.
        clicks: in any order; with scans.
        scans: at least those around the clicks.
        background: scans of the whole recording; optional.
        pairs: instead of clicks and scans; not checked.
        excluded: ids of pairs that are shown, but not used.
        previous: the answer to nearly the same clicks.
        preview: whether a preview is wanted.
    """

    camera: Camera
    options: CalibrationOptions
    clicks: Sequence[ReflectorClick] = ()
    scans: RadarScans | None = None
    background: RadarScans | None = None
    pairs: Sequence[Pair] = ()
    excluded: frozenset[str] = frozenset()
    previous: Calibration | None = None
    preview: bool = False


def _robust(given: MethodInput) -> Iterator[Calibration | Unsolvable]:
    """Solve by the default method: every pair judged by the others, noise estimated, covariance stated."""
    camera, options, scans = given.camera, given.options, given.scans
    if scans is None:
        task = _task_of_pairs(given.pairs, camera, options, given.excluded)
        yield from _steps(task, previous=given.previous, preview=given.preview)
        return
    pairing = pair_clicks(given.clicks, scans, options, background=given.background)
    excluded = frozenset(click.id for click in given.clicks if not click.counts)
    task = _Task.of(pairing.pairs, pairing.unpaired, excluded, camera, options)
    for outcome in _steps(task, previous=given.previous, preview=given.preview):
        if isinstance(outcome, Unsolvable):
            yield replace(outcome, unpaired=pairing.unpaired, pairs=pairing.pairs)
        elif outcome.checking:
            yield outcome
        else:
            yield replace(outcome, warnings=(*outcome.warnings, *clocks(outcome, scans)))


def _as_printed(given: MethodInput) -> Iterator[Calibration | Unsolvable]:
    """Solve by Algorithm 1 of the paper; existing pairs from its RANSAC on."""
    from calib_core.paper.algorithm_1 import Placement, calibrate_as_printed, solve_pairs_as_printed

    camera, options = given.camera, given.options
    if given.scans is not None:
        pairing = pair_clicks(given.clicks, given.scans, options, background=given.background)
        placements = {
            pair.id: Placement(pair.candidates[0].position_radar_m, pair.chosen is not None) for pair in pairing.pairs
        }
        outcome = calibrate_as_printed(given.clicks, given.scans, camera, options, placements)
    else:
        pairs = checked_pairs(given.pairs, with_noise=False)
        outcome = solve_pairs_as_printed(pairs, camera, options, given.excluded)
    if isinstance(outcome, Calibration):
        outcome = replace(outcome, warnings=(*outcome.warnings, *excluded_by_residual(outcome)))
    yield outcome


METHODS: Mapping[Method, Callable[[MethodInput], Iterator[Calibration | Unsolvable]]] = {
    "default": _robust,
    "paper": _as_printed,
}
"""The methods: each yields a preview, if it has one and one is wanted, then the answer."""


def preview_pairs(
    pairs: Sequence[Pair],
    camera: Camera,
    options: CalibrationOptions | None = None,
    *,
    previous: Calibration | None = None,
) -> Calibration | Unsolvable:
    """Solve existing pairs for pose and local covariance only; what `calibrate_pairs` checks is left out.

    Args:
        pairs: in any order.
        camera: the intrinsics.
        options: of the default method; None takes the defaults.
        previous: the answer to nearly the same pairs, to start from.

    Raises:
        InputError: a pair contains a number that is impossible, or an id occurs twice.
    """
    task = _task_of_pairs(pairs, camera, checked_options(options or CalibrationOptions()), frozenset())
    return next(_steps(task, previous=previous, preview=True))


def _task_of_pairs(
    pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions, excluded: frozenset[str]
) -> "_Task":
    checked_pairs(pairs, with_noise=True)
    # by image time; pairs without a time stay in the order given
    ordered = sorted(pairs, key=lambda pair: (pair.image_time is not None, pair.image_time or 0))
    return _Task.of(tuple(ordered), (), excluded, camera, options)


def solve_again(calibration: Calibration, options: CalibrationOptions | None = None) -> Calibration | Unsolvable:
    """Solve again from the pairs that a calibration kept; with the same options the result is the same, bit for bit.

    Whatever depends on the recording is copied: clicks without a radar position, warnings about clocks and placement ranges.

    Args:
        calibration: solved here, or read from a calibration-1 file.
        options: None takes the calibration's own. Refined intrinsics are taken as they were before.

    Raises:
        InputError: the calibration does not contain the candidates of its pairs.
    """
    kept = [pair.measured for pair in calibration.pairs if pair.measured is not None]
    if not calibration.pairs:
        raise InputError("contains a pose but no pairs; solve from the recording and the clicks")
    if len(kept) < len(calibration.pairs):
        raise InputError(
            f"{len(calibration.pairs) - len(kept)} of {len(calibration.pairs)} pairs have no candidates, as in files that "
            "other tools wrote; solve from the recording and the clicks"
        )
    options = options or calibration.options
    if options.models_noise:
        kept = [_with_noise(pair, options) for pair in kept]
    excluded = frozenset(pair.id for pair in calibration.pairs if pair.excluded)
    camera = calibration.given_camera or calibration.camera
    outcome = calibrate_pairs(kept, camera, options, excluded)
    if isinstance(outcome, Unsolvable):
        return replace(outcome, unpaired=calibration.unpaired)
    codes = CLOCK_CODES if options.models_noise else _OF_PLACEMENTS
    of_recording = [warning for warning in calibration.warnings if warning.code in codes]
    return replace(outcome, unpaired=calibration.unpaired, warnings=(*outcome.warnings, *of_recording))


_OF_PLACEMENTS = ("placement-ranges", "choices-unused")


def _with_noise(pair: Pair, options: CalibrationOptions) -> Pair:
    """Add the assumed noise to candidates of the paper's method, which has no noise model."""
    if all(np.isfinite(candidate.sigma_polar).all() for candidate in pair.candidates):
        return pair
    return replace(
        pair, candidates=tuple(candidate_at(candidate.position_radar_m, options.noise) for candidate in pair.candidates)
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """What is to be solved.

    Attributes:
        shown: all pairs, excluded ones included, in the order of the results.
        unpaired: clicks without a pair.
        excluded: ids of pairs that are shown, but not used.
        clicked: the pairs that are used, in an order that the input order does not change.
        camera: the intrinsics.
        options: checked.
    """

    shown: tuple[Pair, ...]
    unpaired: tuple[Unpaired, ...]
    excluded: frozenset[str]
    clicked: tuple[Pair, ...]
    camera: Camera
    options: CalibrationOptions

    @classmethod
    def of(
        cls,
        shown: tuple[Pair, ...],
        unpaired: tuple[Unpaired, ...],
        excluded: frozenset[str],
        camera: Camera,
        options: CalibrationOptions,
    ) -> "_Task":
        clicked = sorted((pair for pair in shown if pair.id not in excluded), key=_canonical)
        return cls(shown, unpaired, excluded, tuple(clicked), camera, options)


def _steps(task: _Task, *, previous: Calibration | None, preview: bool) -> Iterator[Calibration | Unsolvable]:
    """Yield the preview, if one is wanted and a pose is found, then the answer."""
    if len(task.clicked) < MIN_PAIRS:
        untouched = sum(pair.id in task.excluded and pair.mark == "untouched" for pair in task.shown)
        yield unsolved.too_few(len(task.clicked), len(task.excluded) - untouched, len(task.unpaired), untouched)
        return
    useless = useless_covariance(task.camera, refining=task.options.refining.intrinsics)
    if useless is not None:
        yield useless
        return
    groups = placement_groups(task.clicked, task.options)
    if len(groups) < MIN_PAIRS:
        yield unsolved.one_place(len(task.clicked), len(groups))
        return
    measurements = pair_measurements([group.pair for group in groups], task.camera, task.options)
    if preview:
        quick = quick_fit(measurements, task.options, previous)
        if quick is not None:
            solution = _Solution.local(quick, task.options, smooth=False)
            described = _calibration_of(task, groups, measurements, solution)
            first = flat_radar(quick, solution.uncertainty, task.options.radar)
            yield _preview(described, previous or replace(described, warnings=tuple(first)))
    yield _answer(task, groups, measurements)


def _preview(calibration: Calibration, previous: Calibration) -> Calibration:
    """Mark a calibration as being checked; warnings and advice are still those of the previous answer."""
    return replace(
        calibration,
        checking=True,
        warnings=previous.warnings,
        angle_map=previous.angle_map,
        next_placement=previous.next_placement,
    )


def _answer(task: _Task, groups: Sequence[PlacementGroup], measurements: PairMeasurements) -> Calibration | Unsolvable:
    options = task.options
    fit = best_fit(measurements, options)
    used = [group.pair for group in groups]
    if isinstance(fit, Unsolvable):
        return _explained(fit, used, measurements, options)
    measurements = fit.weighed
    solution = _Solution.local(fit.refined, options, doubt=None if fit.position is None else fit.position.doubt)
    rotation_sigma_rad = float(np.sqrt(solution.uncertainty.covariance[3:, 3:].diagonal().max()))
    if not rotation_sigma_rad < _UNDETERMINED_ROTATION_RAD:
        return _explained(unsolved.degenerate(len(used)), used, measurements, options)
    alternatives = find_alternatives(
        measurements, solution.refined, solution.uncertainty, fit.found, seed=options.solving.seed
    )
    solution = replace(solution, uncertainty=alternatives.uncertainty)
    calibration = _calibration_of(task, groups, measurements, solution)
    metrics = calibration.metrics
    solved_fit = SolvedFit(
        ids=tuple(pair.id for pair in used),
        times=tuple(pair.image_time for pair in used),
        measurements=measurements,
        refined=solution.refined,
        uncertainty=solution.uncertainty,
        left_out=solution.left_out,
        inliers=solution.refined.inliers,
        best=fit,
        chi2_per_degree=metrics.chi2 / max(metrics.degrees_of_freedom, 1),
        options=options,
        alternatives=alternatives,
    )
    angle_map = learn_angle_map(calibration)
    apart = clocks_apart(used, task.camera, options, solution.refined)
    return replace(
        calibration,
        warnings=without_consequences((*apart, *warnings_of(solved_fit), *excluded_by_residual(calibration))),
        angle_map=angle_map if angle_map is not None and angle_map.pays else None,
        next_placement=next_placement(calibration),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Solution:
    """A fit, its covariance and what leaving out each pair does."""

    refined: ErrorsInVariablesFit
    uncertainty: PoseCovariance
    left_out: LeaveOneOut

    @classmethod
    def local(
        cls,
        refined: ErrorsInVariablesFit,
        options: CalibrationOptions,
        *,
        smooth: bool = True,
        doubt: Values | None = None,
    ) -> "_Solution":
        uncertainty = pose_covariance(refined, options.radar, smooth=smooth, doubt=doubt)
        left_out = leave_one_out(
            refined.measurements,
            refined.camera_from_radar,
            refined.model,
            refined.weights,
            refined.rows,
            information=uncertainty.information,
            pose_information=uncertainty.pose_information,
        )
        return cls(refined, uncertainty, left_out)


def _calibration_of(
    task: _Task, groups: Sequence[PlacementGroup], measurements: PairMeasurements, solution: _Solution
) -> Calibration:
    """Return the solution as a calibration, without warnings and advice."""
    refined, uncertainty = solution.refined, solution.uncertainty
    used = [group.pair for group in groups]
    results = used_pair_results(used, refined, solution.left_out) | excluded_pair_results(
        task.shown, task.excluded, refined, refined.measurements.camera, task.options
    )
    camera = refined.measurements.errors.camera_known_to(uncertainty.lens)
    metrics = fit_metrics(measurements, refined, solution.left_out)
    calibration = Calibration(
        camera_from_radar=refined.camera_from_radar,
        covariance=uncertainty.covariance,
        camera=camera or task.camera,
        metrics=replace(metrics, picture_sigma_px=picture_sigma_px(refined, uncertainty)),
        pairs=tuple(results[pair.id] for pair in task.shown if pair.id in results),
        unpaired=task.unpaired,
        warnings=(),
        options=task.options,
        noise_scale=_four(refined.noise_scale),
        covariance_quantile=uncertainty.quantile,
        radar_errors=refined.measurements.errors.radar,
        systematic_errors=uncertainty.systematic_errors,
        given_camera=task.camera if camera is not None else None,
        covariance_parts=uncertainty.parts.within(uncertainty.covariance),
    )
    return replace(calibration, pairs=click_results(calibration, groups, task.shown))


def _explained(
    outcome: Unsolvable, used: Sequence[Pair], measurements: PairMeasurements, options: CalibrationOptions
) -> Unsolvable:
    """Say where the input is implausible, which may be the cause."""
    ids, points = [pair.id for pair in used], cartesian_from_polar(measurements.polar)
    suspected = implausible_input(ids, points, measurements.pixels_px, measurements.camera, options)
    suspected = (*suspected, *clocks_apart(used, measurements.camera, options))
    return replace(outcome, suspected=suspected)


def _four(values: Values) -> tuple[float, float, float, float]:
    click, range_, azimuth, elevation = values.tolist()
    return click, range_, azimuth, elevation


def _canonical(pair: Pair) -> tuple[int, str, float, float]:
    """Return a sort key, so that the input order cannot change a bit of the result."""
    return (pair.image_time or 0, pair.id, float(pair.pixel_px[0]), float(pair.pixel_px[1]))
