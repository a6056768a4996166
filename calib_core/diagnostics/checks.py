"""The warnings of a calibration: codes, which do not change, with their facts; `calib_core.words.warnings` says them.

A check returns an empty list if all is well.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calib_core.arrays import Flags
from calib_core.association.clustering import CLUSTER_SCALE
from calib_core.diagnostics.causes import causes
from calib_core.diagnostics.handedness import handedness
from calib_core.diagnostics.intrinsics import lens_or_scale, refined_too_far
from calib_core.diagnostics.pairs import ambiguous_candidates, decisive_pair
from calib_core.diagnostics.pose import agreeing_outliers, camera_position, possible_poses, two_poses
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.diagnostics.uncertainty_map import picture_sigma_px
from calib_core.estimation.alternative_poses import NARROW_CONDITION
from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.plausibility import implausible_input
from calib_core.geometry import CM_PER_M
from calib_core.options import RadarOptions
from calib_core.radar import cartesian_from_polar, direction_cosines
from calib_core.results import DataWarning
from calib_core.results.radar_axes import sigma_in_radar_axes, without_mounting
from calib_core.results.systematic_errors import scaled_angles
from calib_core.results.verdict import SURE_PAIRS

_WEAK_ROTATION_RAD, _WEAK_POSITION_M = np.deg2rad(2.5), 0.3  # standard deviations, beyond what is usable (a choice)
_NOISE_EXCESS = 2.5  # ratio of the residuals' variance to the assumed one: 1.6 times its standard deviation (a choice)
_MANY_PLACES = 500  # number of places: of more, neighbors come from a tree: all distances would take too long
_UNCLEAR = ("two-poses", "camera-far-away", "handedness-open", "many-outliers", "agreeing-outliers")
_TOLD_BY_MORE = (
    "handedness-assumed",
    "weak-geometry",
    "one-pair-decides",
    "uncertain-association",
    "shared-error-suspected",
)
_OF_PIXELS = ("mirrored-axes", "handedness-open", "handedness-assumed", "intrinsics-suspected")
_OF_LENGTHS = ("camera-far-away", "weak-geometry", "two-poses", "lens-or-radar-scale")
_OF_RETURNS = ("no-consensus", "many-outliers", "agreeing-outliers", "clock-bias-suspected")
_FOLLOWS = {"pixels-suspected": _OF_PIXELS, "units-suspected": (*_OF_PIXELS, *_OF_LENGTHS), "clocks-apart": _OF_RETURNS}
"""What a named cause makes likely, and what is said of it would send the user elsewhere."""
_OBJECTIONS_TO_INTRINSICS = (
    "intrinsics-suspected",
    "many-outliers",
    "residuals-too-large",
    "camera-position-contradicted",
    "camera-position-doubtful",
)


def warnings_of(fit: SolvedFit) -> tuple[DataWarning, ...]:
    """Run every check; the most serious warnings come first."""
    points = cartesian_from_polar(fit.measurements.polar)
    suspected = implausible_input(fit.ids, points, fit.measurements.pixels_px, fit.measurements.camera, fit.options)
    checks = (
        handedness,
        _other_poses,
        camera_position,
        _flat_radar,
        _many_outliers,
        _causes,
        lens_or_scale,
        _systematic_errors,
        _noise_excess,
        _smooth_angle_errors,
        _weak_geometry,
        _same_places,
        ambiguous_candidates,
        agreeing_outliers,
        decisive_pair,
    )
    warnings = [warning for check in checks for warning in check(fit)]
    if any(warning.code in _OBJECTIONS_TO_INTRINSICS for warning in warnings):
        suspected = tuple(
            replace(warning, code="pixels-suspected") if warning.code == "intrinsics-suspected" else warning
            for warning in suspected
        )
    return (*suspected, *_counted_up(warnings, fit.inliers))


def without_consequences(warnings: Sequence[DataWarning]) -> tuple[DataWarning, ...]:
    """Leave out what follows from a cause that is named."""
    follows = {code for warning in warnings for code in _FOLLOWS.get(warning.code, ())}
    return tuple(warning for warning in warnings if warning.code not in follows)


def _counted_up(warnings: list[DataWarning], inliers: Flags) -> list[DataWarning]:
    """With few pairs, say how many there are instead of what only more of them can tell."""
    count = int(inliers.sum())
    if count >= SURE_PAIRS:
        return warnings
    if len(inliers) >= max(SURE_PAIRS, 2 * count):
        return [
            DataWarning("no-consensus", {"agreeing": count, "pairs": len(inliers)}),
            *warnings,
        ]
    clear = bool(inliers.all()) and not any(warning.code in _UNCLEAR for warning in warnings)
    few = DataWarning("few-pairs", {"agreeing": count, "pairs": len(inliers), "needed": SURE_PAIRS, "clear": clear})
    return [*(warning for warning in warnings if warning.code not in (*_UNCLEAR, *_TOLD_BY_MORE)), few]


def _other_poses(fit: SolvedFit) -> list[DataWarning]:
    """Warn of a second pose, found from other starts or among the peaks of the posterior."""
    return two_poses(fit) or possible_poses(fit)


def _causes(fit: SolvedFit) -> list[DataWarning]:
    """Name refined intrinsics that had to change beyond belief, or what else would explain the residuals."""
    return refined_too_far(fit) or causes(fit)


def _systematic_errors(fit: SolvedFit) -> list[DataWarning]:
    errors, flat = fit.uncertainty.systematic_errors, fit.measurements.flat
    return scaled_angles(errors, flat=flat, measured=fit.measurements.prior.measured)


def _flat_radar(fit: SolvedFit) -> list[DataWarning]:
    return flat_radar(fit.refined, fit.uncertainty, fit.options.radar)


def _many_outliers(fit: SolvedFit) -> list[DataWarning]:
    outliers = [name for name, inlier in zip(fit.ids, fit.inliers, strict=True) if not inlier]
    if len(outliers) <= 0.35 * len(fit.ids):  # share of the pairs, as docs/warnings.md states (a choice)
        return []
    return [DataWarning("many-outliers", {"ids": outliers, "pairs": len(fit.ids)})]


def _noise_excess(fit: SolvedFit) -> list[DataWarning]:
    degrees = 2 * int(fit.inliers.sum()) - 6
    # chi2 per degree has the standard deviation sqrt(2 / degrees): four of them are no chance
    if degrees < 6 or fit.chi2_per_degree < 1.0 + 4.0 * np.sqrt(2.0 / degrees) or fit.chi2_per_degree < _NOISE_EXCESS:
        return []
    return [DataWarning("residuals-too-large", {"chi2_per_degree": fit.chi2_per_degree})]


def _smooth_angle_errors(fit: SolvedFit) -> list[DataWarning]:
    uncertainty = fit.uncertainty
    if not uncertainty.shows_smooth or fit.measurements.flat:
        return []
    uncertain_lens = fit.measurements.camera.covariance is not None and not fit.options.refining.intrinsics
    return [DataWarning("smooth-angle-errors", {"growth": fit.uncertainty.growth, "uncertain_lens": uncertain_lens})]


def _weak_geometry(fit: SolvedFit) -> list[DataWarning]:
    covariance = fit.uncertainty.covariance
    if fit.measurements.flat:  # `_flat_radar` says what its tilt and height add
        refined = fit.refined
        covariance = without_mounting(refined.camera_from_radar, covariance, refined.placements_z_m, fit.options.radar)
    sigma = np.sqrt(np.diag(covariance))
    rotation_rad, position_m = float(np.linalg.norm(sigma[3:])), float(np.linalg.norm(sigma[:3]))
    narrow = fit.uncertainty.condition > NARROW_CONDITION and not fit.measurements.prior.measured
    if rotation_rad <= _WEAK_ROTATION_RAD and position_m <= _WEAK_POSITION_M and not narrow:
        return []
    range_m, azimuth_rad, _ = fit.measurements.polar[fit.refined.rows[fit.inliers]].T
    return [
        DataWarning(
            "weak-geometry",
            {
                "rotation_deg": float(np.rad2deg(rotation_rad)),
                "position_cm": CM_PER_M * position_m,
                "nearest_m": float(range_m.min()),
                "farthest_m": float(range_m.max()),
                "azimuth_span_deg": float(np.rad2deg(np.ptp(azimuth_rad))),
                "measured": fit.measurements.prior.measured,
            },
        )
    ]


def _places(fit: SolvedFit) -> int:
    """Count the distinct places among the inlier placements, at the radar's resolution."""
    centres = (
        direction_cosines(cartesian_from_polar(fit.measurements.polar[fit.refined.rows[fit.inliers]])) / CLUSTER_SCALE
    )
    if len(centres) > _MANY_PLACES:
        from scipy.spatial import cKDTree

        near = cKDTree(centres).query_pairs(1.0, output_type="ndarray")
        return len(centres) - len(np.unique(near.max(axis=1)))
    apart = sum(((axis[:, None] - axis) ** 2 for axis in centres.T), start=np.zeros((len(centres), len(centres))))
    first_close = (apart <= 1.0).argmax(axis=1)  # the place itself, if no earlier one is close
    return int((first_close == np.arange(len(centres))).sum())


def _same_places(fit: SolvedFit) -> list[DataWarning]:
    count, places = int(fit.inliers.sum()), _places(fit)
    if places > 0.7 * count:  # share of the pairs, as docs/warnings.md states (a choice)
        return []
    return [DataWarning("repeated-placements", {"pairs": count, "places": places})]


def flat_radar(refined: ErrorsInVariablesFit, uncertainty: PoseCovariance, radar: RadarOptions) -> list[DataWarning]:
    """Say what the pairs of a radar without elevation determine, and what depends on how it is mounted.

    Args:
        refined: the fit.
        uncertainty: its covariance.
        radar: priors of the mounting.
    """
    if not refined.measurements.flat:
        return []
    pose, stated = refined.camera_from_radar, uncertainty.covariance
    firm = sigma_in_radar_axes(pose, without_mounting(pose, stated, refined.placements_z_m, radar))
    (forward, left), yaw = CM_PER_M * firm.position_m[:2], np.rad2deg(firm.rotation_rad[2])
    assumed = sigma_in_radar_axes(pose, stated)
    up, (roll, pitch) = CM_PER_M * assumed.position_m[2], np.rad2deg(assumed.rotation_rad[:2])
    return [
        DataWarning(
            "flat-radar",
            {
                "forward_cm": float(forward),
                "left_cm": float(left),
                "yaw_deg": float(yaw),
                "image_px": picture_sigma_px(refined, uncertainty),
                "up_cm": float(up),
                "pitch_deg": float(pitch),
                "roll_deg": float(roll),
            },
        )
    ]
