"""Residuals at clicks: how far a calibration puts the reflector's returns from where it was clicked.

Which of several returns is the reflector is decided by a solve of the recording's own clicks, not by the calibration that is
judged: it would pick the returns that suit it. Only where the clicks alone determine no pose does it decide.

`residual_test` says whether pairs that took no part in a calibration fit it, as well as its stated uncertainty says.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Indices, Values, freeze
from calib_core.association.placement_groups import linked_clicks
from calib_core.calibration import calibrate_pairs, preview_pairs
from calib_core.camera import Camera
from calib_core.estimation.gnc import associate
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.estimation.pair_results import residual_covariances
from calib_core.evaluation.figures import HeldOut, ResidualFigures, spreads
from calib_core.measurements import MIN_PAIRS, Candidate, Pair, Unpaired
from calib_core.options import CalibrationOptions, without_systematic_errors
from calib_core.radar import RadarErrors, polar_from_cartesian
from calib_core.results import Calibration
from calib_core.results.calibration import CHI2_95_2, CHI2_95_6, CHI2_999_2
from calib_core.results.metrics import aed, metrics_of

_FOLDS = 5
_CHOSEN = "the return of each click was chosen by a person, or is the only one"
_INDEPENDENT = (
    "the return of each click was chosen by a solve of these clicks alone, not by the calibration that is judged"
)
_DEPENDENT = (
    "the clicks determine no pose by themselves, so each click's return is the one that suits the calibration best: "
    "its residuals are slightly too small"
)


@dataclass(frozen=True, slots=True, eq=False)
class AssociatedPairs:
    """Clicks with one return each, the same for every calibration that is judged.

    Attributes:
        pairs: (n) with one candidate each, or with all of them if the calibration must choose.
        every: (n) the same with all candidates.
        placements: (n,) number of the placement of each.
        rule: how the returns were chosen, in one sentence.
    """

    pairs: tuple[Pair, ...]
    every: tuple[Pair, ...]
    placements: Indices
    rule: str

    def __post_init__(self) -> None:
        freeze(self, np.int64, placements=(len(self.pairs),))


def associated_pairs(pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions) -> AssociatedPairs:
    """Choose the return of each click without any calibration that is to be judged.

    Args:
        pairs: of the clicks that count.
        camera: the lens.
        options: of the solve.
    """
    every = tuple(pairs)
    options = replace(options, method="default")
    placements = np.zeros(len(every), dtype=np.int64)
    for number, rows in enumerate(linked_clicks(every, options)):
        placements[rows] = number
    if all(len(pair.candidates) == 1 for pair in every):
        return AssociatedPairs(every, every, placements, _CHOSEN)
    own = preview_pairs(every, camera, options) if len(every) >= MIN_PAIRS else None
    if not isinstance(own, Calibration):
        return AssociatedPairs(every, every, placements, _DEPENDENT)
    chosen = {result.id: result.candidate for result in own.pairs}
    single = tuple(
        replace(pair, candidates=(replace(pair.candidates[chosen[pair.id]], alternative_of=-1),)) for pair in every
    )
    return AssociatedPairs(single, every, placements, _INDEPENDENT)


def residual_figures(
    found: AssociatedPairs | Sequence[Pair],
    calibration: Calibration,
    *,
    unpaired: Sequence[Unpaired] = (),
    with_held_out: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> ResidualFigures:
    """Compute the residuals of a calibration at clicks.

    Args:
        found: the clicks with their returns; pairs alone are associated first.
        calibration: that is judged.
        unpaired: clicks without a radar position.
        with_held_out: also predict the clicks of each placement from the others.
        progress: called with the solves done and their number.
    """
    if not isinstance(found, AssociatedPairs):
        found = associated_pairs(found, calibration.camera, calibration.options)
    pairs, positions = _pairs_under(found, calibration)
    pixels_px = np.array([pair.pixel_px for pair in pairs]).reshape(-1, 2)
    projected_px = calibration.reproject(positions)
    distances_px = np.linalg.norm(projected_px - pixels_px, axis=1)
    seen_px = distances_px[np.isfinite(distances_px)]
    inliers = _explained(pairs, calibration)
    polar = polar_from_cartesian(positions)
    left_out = _both_held_out(found, calibration, progress) if with_held_out else (None, None)
    return ResidualFigures(
        ids=tuple(pair.id for pair in pairs),
        points_radar_m=positions,
        pixels_px=pixels_px,
        projected_px=projected_px,
        inliers=inliers,
        metrics=replace(
            metrics_of(seen_px), held_out_aed_px=float("nan") if left_out[0] is None else left_out[0].aed_px
        ),
        median_px=float(np.median(seen_px)) if len(seen_px) else float("nan"),
        inlier_share=float(inliers.mean()) if len(inliers) else float("nan"),
        by_range=spreads(polar[:, 0], distances_px),
        by_azimuth=spreads(np.rad2deg(polar[:, 1]), distances_px),
        by_column=spreads(pixels_px[:, 0], distances_px),
        by_row=spreads(pixels_px[:, 1], distances_px),
        held_out=left_out[0],
        k_fold=left_out[1],
        placements=found.placements,
        unpaired=tuple(unpaired),
        association=found.rule,
    )


def _pairs_under(pairs: AssociatedPairs, calibration: Calibration) -> tuple[tuple[Pair, ...], np.ndarray]:
    """Return the pairs with one candidate each, and its positions (n, 3); of several, the one reprojected nearest."""
    single = []
    for pair in pairs.pairs:
        positions = np.array([candidate.position_radar_m for candidate in pair.candidates])
        away_px = np.linalg.norm(calibration.reproject(positions) - pair.pixel_px, axis=1)
        nearest = int(np.argmin(np.where(np.isfinite(away_px), away_px, np.inf)))
        single.append(replace(pair, candidates=(pair.candidates[nearest],)))
    return tuple(single), np.array([pair.candidates[0].position_radar_m for pair in single]).reshape(-1, 3)


def _explained(pairs: Sequence[Pair], calibration: Calibration) -> np.ndarray:
    """Return which residuals (n,) the noise of click and return and the pose's covariance explain, at 99.9 %."""
    if not pairs:
        return np.zeros(0, dtype=np.bool_)
    if not np.isfinite(calibration.firm_covariance).all():
        calibration = replace(calibration, covariance=np.zeros((6, 6)))
    return ~residual_test(pairs, calibration).misfits


def _both_held_out(
    pairs: AssociatedPairs, calibration: Calibration, progress: Callable[[int, int], None] | None
) -> tuple[HeldOut | None, HeldOut | None]:
    """Leave out one placement at a time, as a solve does, and a fifth of them at a time."""
    count = int(pairs.placements.max(initial=-1)) + 1
    if count <= MIN_PAIRS:
        return None, None
    folds = min(_FOLDS, count)
    one = _left_out(pairs, calibration, count)
    told = None if progress is None else lambda done: progress(1 + done, 1 + folds)
    return one, held_out(pairs, calibration.camera, calibration.options, pairs.placements % folds, told)


def _left_out(pairs: AssociatedPairs, calibration: Calibration, count: int) -> HeldOut:
    """Return what a solve of these clicks says of leaving out each placement: its held-out AED is over those that agree."""
    own = calibrate_pairs(pairs.every, calibration.camera, replace(calibration.options, method="default"))
    if not isinstance(own, Calibration):
        return HeldOut(count, np.full(len(pairs.pairs), np.nan), float("nan"))
    held_out_px = {pair.id: pair.held_out_px for pair in own.pairs}
    return HeldOut(count, np.array([held_out_px[pair.id] for pair in pairs.pairs]), own.metrics.held_out_aed_px)


def held_out(
    pairs: AssociatedPairs,
    camera: Camera,
    options: CalibrationOptions,
    groups: Indices,
    progress: Callable[[int], None] | None = None,
) -> HeldOut:
    """Predict the clicks of each group from a solve of the others.

    Args:
        pairs: the clicks with their returns.
        camera: the lens.
        options: of the solve.
        groups: (n,) numbers from 0; a placement is never divided.
        progress: called with the groups done.
    """
    options = replace(options, method="default")
    distances_px = np.full(len(pairs.pairs), np.nan)
    folds = int(groups.max(initial=-1)) + 1
    for fold in range(folds):
        rest = [pair for pair, group in zip(pairs.every, groups.tolist(), strict=True) if group != fold]
        solved = preview_pairs(rest, camera, options)
        if isinstance(solved, Calibration):
            for row in np.flatnonzero(groups == fold).tolist():
                distances_px[row] = _distance_px(pairs.pairs[row], solved)
        if progress is not None:
            progress(fold + 1)
    return HeldOut(folds, distances_px, aed(distances_px[np.isfinite(distances_px)]))


def _distance_px(pair: Pair, calibration: Calibration) -> float:
    positions = np.array([candidate.position_radar_m for candidate in pair.candidates])
    away_px = np.linalg.norm(calibration.reproject(positions) - pair.pixel_px, axis=1)
    return float(away_px[0] if len(away_px) == 1 or np.isnan(away_px).all() else np.nanmin(away_px))


_MISFIT = CHI2_999_2  # no noise of this pair explains more


@dataclass(frozen=True, slots=True, eq=False)
class ResidualTest:
    """Residuals of pairs under a calibration, compared with what its covariance and the noise of the pairs allow.

    Attributes:
        ids: of the pairs (n).
        distances_px: (n,) lengths of the residuals, each pair with its best candidate; infinite behind the camera.
        outside: (n,) whether a residual is outside its own 95 % region; all False if no covariance is stated.
        misfits: (n,) whether it is far outside, which no noise explains; these do not count in chi2.
        chi2: of the other residuals together, with the pose's error common to all; NaN if no covariance is stated.
        degrees_of_freedom: of chi2.
        p_value: probability of a chi2 this large if the calibration holds; NaN if chi2 is.
    """

    ids: tuple[str, ...]
    distances_px: Values
    outside: Flags
    misfits: Flags
    chi2: float
    degrees_of_freedom: int
    p_value: float

    def __post_init__(self) -> None:
        freeze(self, distances_px=(None,))
        freeze(self, np.bool_, outside=(None,), misfits=(None,))


def residual_test(pairs: Sequence[Pair], calibration: Calibration) -> ResidualTest:
    """Test pairs against a calibration, with its options, its estimated noise level and its covariance.

    Args:
        pairs: at least one; they took no part in the calibration.
        calibration: the calibration.
    """
    corrected = [_corrected(pair, calibration.radar_errors) for pair in pairs]
    options = without_systematic_errors(calibration.options)  # their part is in the pose's covariance
    camera = replace(calibration.camera, covariance=None)
    measurements = pair_measurements(corrected, camera, options).scaled(calibration.noise_scale)
    rows, model = associate(measurements, calibration.camera_from_radar)
    points_radar_m = np.array([candidate.position_radar_m for pair in corrected for candidate in pair.candidates])[rows]
    residuals_px = calibration.camera.project(calibration.camera_from_radar @ points_radar_m) - measurements.pixels_px
    seen = np.isfinite(residuals_px).all(axis=1)
    distances_px = np.where(seen, np.linalg.norm(residuals_px, axis=1), np.inf)
    ids, none = tuple(pair.id for pair in pairs), np.zeros(len(pairs), dtype=np.bool_)
    if not np.isfinite(calibration.firm_covariance).all():
        return ResidualTest(ids, distances_px, none, ~seen, float("nan"), 0, float("nan"))
    jacobian = calibration.camera.pose_jacobian(calibration.camera_from_radar, points_radar_m)
    heavier = max(1.0, float(np.nan_to_num(calibration.covariance_quantile)) / CHI2_95_6)  # tails than a normal error's
    covariance = calibration.firm_covariance * heavier
    return _tested(ids, distances_px, residuals_px, residual_covariances(model), jacobian, covariance)


def _corrected(pair: Pair, radar_errors: RadarErrors) -> Pair:
    """Take out of a pair's candidates what the radar gets wrong."""

    def true(one: Candidate) -> Candidate:
        return replace(one, position_radar_m=radar_errors.corrected(one.position_radar_m[None])[0])

    return replace(pair, candidates=tuple(map(true, pair.candidates)))


def _tested(
    ids: tuple[str, ...],
    distances_px: Values,
    residuals_px: np.ndarray,
    noise_px2: np.ndarray,
    jacobian: np.ndarray,
    covariance: np.ndarray,
) -> ResidualTest:
    from scipy.special import chdtrc

    own_px2 = noise_px2 + jacobian @ covariance @ np.swapaxes(jacobian, 1, 2)
    seen = np.isfinite(distances_px) & np.isfinite(own_px2).all(axis=(1, 2))
    squared = np.full(len(ids), np.inf)
    solved = np.linalg.solve(own_px2[seen], residuals_px[seen][..., None])[..., 0]
    squared[seen] = np.einsum("ni,ni->n", residuals_px[seen], solved)
    kept = np.flatnonzero(squared <= _MISFIT)
    rows = jacobian[kept].reshape(-1, 6)
    together_px2 = rows @ covariance @ rows.T
    for index, pair in enumerate(kept):
        block = slice(2 * index, 2 * index + 2)
        together_px2[block, block] += noise_px2[pair]
    residual_px = residuals_px[kept].ravel()
    chi2 = float(residual_px @ np.linalg.solve(together_px2, residual_px)) if len(kept) else float("nan")
    freedom = 2 * len(kept)
    p_value = float(chdtrc(freedom, chi2)) if len(kept) else float("nan")
    return ResidualTest(ids, distances_px, squared > CHI2_95_2, squared > _MISFIT, chi2, freedom, p_value)
