"""Residuals at clicks: how far a calibration puts the reflector's returns from where it was clicked.

Which of several returns is the reflector is decided by a solve of the recording's own clicks, not by the calibration that is
judged: it would pick the returns that suit it. Only where the clicks alone determine no pose does it decide.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Values, frozen_array
from calib_core.association.placement_groups import linked_clicks
from calib_core.calibration import preview_pairs
from calib_core.camera import Camera
from calib_core.evaluation.figures import HeldOut, ResidualFigures, spreads
from calib_core.evaluation.residual_test import residual_test
from calib_core.measurements import MIN_PAIRS, Pair, Unpaired
from calib_core.options import CalibrationOptions
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration
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
        object.__setattr__(self, "placements", frozen_array(self.placements, (len(self.pairs),), dtype=np.int64))


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
    pairs, positions = _under(found, calibration)
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
        metrics=metrics_of(seen_px, held_out_distances_px=_finite(left_out[0])),
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


def _under(found: AssociatedPairs, calibration: Calibration) -> tuple[tuple[Pair, ...], np.ndarray]:
    """Return the pairs with one candidate each, and its positions (n, 3); of several, the one reprojected nearest."""
    single = []
    for pair in found.pairs:
        positions = np.array([one.position_radar_m for one in pair.candidates])
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
    found: AssociatedPairs, calibration: Calibration, progress: Callable[[int, int], None] | None
) -> tuple[HeldOut | None, HeldOut | None]:
    """Leave out one placement at a time, and a fifth of them at a time."""
    count = int(found.placements.max(initial=-1)) + 1
    if count <= MIN_PAIRS:
        return None, None
    folds = min(_FOLDS, count)
    total = count + (folds if count > folds else 0)
    one = held_out(found, calibration.camera, calibration.options, found.placements, _told(progress, 0, total))
    if count <= folds:
        return one, one
    groups = found.placements % folds
    return one, held_out(found, calibration.camera, calibration.options, groups, _told(progress, count, total))


def _told(progress: Callable[[int, int], None] | None, before: int, total: int) -> Callable[[int], None] | None:
    return None if progress is None else lambda done: progress(before + done, total)


def held_out(
    found: AssociatedPairs,
    camera: Camera,
    options: CalibrationOptions,
    groups: Indices,
    progress: Callable[[int], None] | None = None,
) -> HeldOut:
    """Predict the clicks of each group from a solve of the others.

    Args:
        found: the clicks with their returns.
        camera: the lens.
        options: of the solve.
        groups: (n,) numbers from 0; a placement is never divided.
        progress: called with the groups done.
    """
    options = replace(options, method="default")
    distances_px = np.full(len(found.pairs), np.nan)
    folds = int(groups.max(initial=-1)) + 1
    for fold in range(folds):
        rest = [pair for pair, group in zip(found.every, groups.tolist(), strict=True) if group != fold]
        solved = preview_pairs(rest, camera, options)
        if isinstance(solved, Calibration):
            for row in np.flatnonzero(groups == fold).tolist():
                distances_px[row] = _distance_px(found.pairs[row], solved)
        if progress is not None:
            progress(fold + 1)
    return HeldOut(folds, distances_px, aed(distances_px[np.isfinite(distances_px)]))


def _distance_px(pair: Pair, calibration: Calibration) -> float:
    positions = np.array([one.position_radar_m for one in pair.candidates])
    away_px = np.linalg.norm(calibration.reproject(positions) - pair.pixel_px, axis=1)
    return float(away_px[0] if len(away_px) == 1 or np.isnan(away_px).all() else np.nanmin(away_px))


def _finite(held: HeldOut | None) -> Values | None:
    return None if held is None else held.distances_px[np.isfinite(held.distances_px)]
