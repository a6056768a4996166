"""What a person must know before using a calibration: each doubt with its figures, and what to do about it.

A check says nothing when all is well. The texts are for people; the codes are for programs and stay as they are.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.consensus import associate, log_odds_of
from calib_core.findings import Findings
from calib_core.locating import CLUSTER_SCALE
from calib_core.pose_doubts import camera_position, mirrored_axes, two_poses
from calib_core.radar import cartesian_from_polar, direction_cosines
from calib_core.results import Caution

__all__ = ["cautions_of"]

_NARROW_CONDITION = 5e5
_WEAK_ROTATION_RAD = np.deg2rad(2.0)
_WEAK_POSITION_M = 0.15
_NOISE_EXCESS = 2.5
_NOTABLE_GROWTH = 2.5
_FEW_INLIERS = 8
_DECISIVE_INFLUENCE = 3.0
_AMBIGUOUS_MARGIN = 4.0


def cautions_of(findings: Findings) -> tuple[Caution, ...]:
    """Run every check; the gravest come first."""
    checks = (
        mirrored_axes,
        two_poses,
        camera_position,
        _flat_radar,
        _many_outliers,
        _few_inliers,
        _noise_excess,
        _smooth_angle_errors,
        _weak_geometry,
        _same_places,
        _ambiguous_candidates,
        _doubtful_pairs,
        _decisive_pair,
    )
    return tuple(caution for check in checks for caution in check(findings))


def _flat_radar(f: Findings) -> list[Caution]:
    if f.evidence.polar[:, 2].any():
        return []
    return [
        Caution(
            "flat-radar",
            "every radar position has elevation 0: this radar measures none, and its real elevations are unknown",
            "put the reflector's centre at the radar's height at every placement, and measure the camera position",
        )
    ]


def _many_outliers(f: Findings) -> list[Caution]:
    outliers = [name for name, inlier in zip(f.ids, f.inliers, strict=True) if not inlier]
    if len(outliers) <= 0.35 * len(f.ids):
        return []
    return [
        Caution(
            "many-outliers",
            f"{len(outliers)} of {len(f.ids)} pairs do not fit: {_listed(outliers)}",
            "look at each: was the reflector clicked, did it rest, do both recordings run on one clock?",
        )
    ]


def _few_inliers(f: Findings) -> list[Caution]:
    count = int(f.inliers.sum())
    if count >= _FEW_INLIERS:
        return []
    return [
        Caution(
            "few-pairs",
            f"only {count} pairs carry the pose; a wrong one among them could not be told, nor a wrong noise level",
            "add placements: ten or more, near and far, on both sides",
        )
    ]


def _noise_excess(f: Findings) -> list[Caution]:
    degrees = 2 * int(f.inliers.sum()) - 6
    if degrees < 6 or f.chi2_per_degree < 1.0 + 4.0 * np.sqrt(2.0 / degrees) or f.chi2_per_degree < _NOISE_EXCESS:
        return []
    return [
        Caution(
            "residuals-too-large",
            f"residuals are {np.sqrt(f.chi2_per_degree):.1f} times what the assumed noise explains "
            f"(chi2 / degrees of freedom {f.chi2_per_degree:.1f})",
            "check that the intrinsics belong to this camera, lens and image size; then the assumed radar noise",
        )
    ]


def _smooth_angle_errors(f: Findings) -> list[Caution]:
    if f.uncertainty.growth < _NOTABLE_GROWTH:
        return []
    return [
        Caution(
            "smooth-angle-errors",
            "neighbouring placements share their residuals: the radar's angles are off by an amount that changes slowly with "
            f"direction; the stated rotation uncertainty is {f.uncertainty.growth:.1f} times wider for it",
            "more placements will not average it away; calibrate the radar's angles, or trust the stated uncertainty",
        )
    ]


def _weak_geometry(f: Findings) -> list[Caution]:
    sigma = np.sqrt(np.diag(f.uncertainty.covariance))
    rotation_rad, position_m = float(np.linalg.norm(sigma[3:])), float(np.linalg.norm(sigma[:3]))
    narrow = f.uncertainty.condition > _NARROW_CONDITION and not f.evidence.belief.measured
    if rotation_rad <= _WEAK_ROTATION_RAD and position_m <= _WEAK_POSITION_M and not narrow:
        return []
    range_m, azimuth_rad, _ = f.evidence.polar[f.refined.rows[f.inliers]].T
    hint = "place the reflector near (2 to 3 m) and far, at both edges of the picture"
    if not f.evidence.belief.measured:
        hint = "measure the camera position with a tape: it helps most; and " + hint
    return [
        Caution(
            "weak-geometry",
            f"the pose is uncertain: {np.rad2deg(rotation_rad):.1f} deg and {100 * position_m:.0f} cm (one sigma); "
            f"placements span {range_m.min():.1f} to {range_m.max():.1f} m and {np.rad2deg(np.ptp(azimuth_rad)):.0f} deg",
            hint,
        )
    ]


def _places(f: Findings) -> int:
    """Count the distinct places among the inlier placements, by the radar's own resolution."""
    centres = direction_cosines(cartesian_from_polar(f.evidence.polar[f.refined.rows[f.inliers]])) / CLUSTER_SCALE
    close = ((centres[:, None] - centres[None]) ** 2).sum(axis=2) <= 1.0
    return int((~np.tril(close, -1).any(axis=1)).sum())


def _same_places(f: Findings) -> list[Caution]:
    count, places = int(f.inliers.sum()), _places(f)
    if places > 0.7 * count:
        return []
    return [
        Caution(
            "repeated-placements",
            f"{count} pairs show only {places} places; a radar repeats its error at the same place, so the stated "
            "uncertainty is too small",
            "move the reflector between clicks; more clicks of one placement add little",
        )
    ]


def _ambiguous_candidates(f: Findings) -> list[Caution]:
    """Name the pairs where a second candidate explains the click nearly as well as the chosen one."""
    if f.evidence.one_to_one:
        return []
    evidence, owner = f.refined.evidence, f.refined.evidence.owner
    margins = np.full(len(evidence), np.inf)
    cost = _candidate_costs(f)
    for i in np.flatnonzero(f.inliers):
        own = np.sort(cost[owner == i])
        if len(own) > 1:
            margins[i] = own[1] - own[0]
    doubtful = [f.ids[i] for i in np.flatnonzero(margins < _AMBIGUOUS_MARGIN)]
    if not doubtful:
        return []
    return [
        Caution(
            "uncertain-association",
            f"more than one radar position suits the click of {_listed(doubtful)}",
            "look at the radar view there; exclude the pair if the chosen return is not the reflector",
        )
    ]


def _candidate_costs(f: Findings) -> np.ndarray:
    evidence = f.refined.evidence
    each = evidence.candidates_apart()
    rows, model = associate(each, f.refined.camera_from_radar)
    return -2.0 * log_odds_of(each, model, each.log_score[rows], 0.5)


def _doubtful_pairs(f: Findings) -> list[Caution]:
    return [
        Caution(
            "doubtful-pair",
            f"without {f.ids[doubt.pair]} the camera moves {100 * doubt.camera_move_m:.0f} cm, and the other pairs predict it "
            f"{doubt.standard_deviations:.1f} standard deviations from its click; the stated uncertainty allows for both",
            f"look at the click of {f.ids[doubt.pair]}; correct it, exclude it, or add placements near it",
        )
        for doubt in f.doubts
    ]


def _decisive_pair(f: Findings) -> list[Caution]:
    if f.inliers.sum() < 6:
        return []
    worst = int(np.argmax(np.where(f.inliers, f.left_out.influence, 0.0)))
    doubted = any(doubt.pair == worst for doubt in f.doubts)
    if doubted or f.left_out.influence[worst] < _DECISIVE_INFLUENCE:
        return []
    return [
        Caution(
            "one-pair-decides",
            f"without {f.ids[worst]} the pose would move by {f.left_out.influence[worst]:.1f} standard deviations",
            "look at that click again, and add a placement near it",
        )
    ]


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:6])
    return shown if len(names) <= 6 else f"{shown} and {len(names) - 6} more"
