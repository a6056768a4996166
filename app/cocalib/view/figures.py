"""The figures next to the image, each with one sentence, how the camera is mounted, and the systematic errors."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix33, Vector3, frozen_array
from calib_core.geometry import camera_position_jacobian
from calib_core.results import Calibration
from calib_core.results.actions import ReduceError
from calib_core.results.radar_axes import sigma_in_radar_axes
from calib_core.results.systematic_errors import SystematicErrorResult, family_of, is_determined
from calib_core.results.verdict import verdict_on
from calib_core.words.systematic_errors import FAMILIES, dominant_sentence, error_words
from calib_core.words.text import Words
from calib_core.words.text import sentence as in_sentence
from cocalib.view.click_rows import reprojections
from cocalib.view.model import Figure, Level, SystematicErrorRow, SystematicErrorTable
from cocalib.view.wording import plain, sentence, with_sigma

_METRICS = {
    "aed": ("mean reprojection error", "AED"),
    "held_out_aed": ("leave-one-out reprojection error", ""),
    "cdsd": ("standard deviation", "CDSD"),
    "rms": ("root mean square", "RMS"),
    "inliers": ("clicks that agree", ""),
}
_NOT_YET = "Available after the first calibration."
_HELD_OUT_RATIO = 1.5
"""A higher ratio of leave-one-out to fitted error means that the pose depends too much on single pairs."""


def metric_figures(calibration: Calibration | None) -> tuple[Figure, ...]:
    """Return the figures that say how well the pairs agree; without values while there is no calibration."""
    if calibration is None:
        return tuple(Figure(key, label, "–", "", _NOT_YET, "none", short) for key, (label, short) in _METRICS.items())
    metrics = calibration.metrics
    hints = {
        "aed": f"Mean distance between click and reprojection over {metrics.n} pairs (paper: AED).",
        "held_out_aed": "Mean distance when each pair is predicted from all the others: what to expect at a new placement.",
        "cdsd": "Standard deviation of these distances, with divisor N - 1 (paper: CDSD).",
        "rms": "Root mean square of these distances: large ones count more than in the mean.",
    }
    figures = {
        key: Figure(
            key, _METRICS[key][0], plain(getattr(metrics, f"{key}_px")), "px", hint, abbreviation=_METRICS[key][1]
        )
        for key, hint in hints.items()
    }
    if metrics.held_out_aed_px > _HELD_OUT_RATIO * metrics.aed_px:
        held_out = figures["held_out_aed"]
        warning = "It is well above the mean reprojection error, so the pose depends on single pairs: add placements."
        figures["held_out_aed"] = replace(held_out, hint=f"{held_out.hint} {warning}", level="warning")
    used = sum(not pair.excluded for pair in calibration.pairs)
    agreeing = sum(pair.inlier and not pair.excluded for pair in calibration.pairs)
    hint = "Clicks whose radar position agrees with the pose, out of all that you have not excluded."
    level: Level = "good" if agreeing == used else "plain"
    return (*figures.values(), Figure("inliers", _METRICS["inliers"][0], f"{agreeing} of {used}", "", hint, level))


def pose_figures(calibration: Calibration) -> tuple[Figure, ...]:
    """Return the camera's position and angles relative to the radar, with one standard deviation, and that in the image.

    For a radar without elevation only what the pairs determine; `assumed_figures` returns the rest.
    """
    figures = _mounting_figures(calibration)
    shown = figures if calibration.sees_elevation else tuple(figure for figure in figures if figure.key in _FIRM)
    return (*shown, *_image_figures(calibration), *_radar_figures(calibration))


def assumed_figures(calibration: Calibration) -> tuple[Figure, ...]:
    """Return what a radar without elevation leaves to assumptions: height, roll and pitch; empty for other radars."""
    if calibration.sees_elevation:
        return ()
    why = " This radar measures no elevation: the value holds if it is level and at the height of the placements."
    return tuple(
        replace(figure, hint=figure.hint + why) for figure in _mounting_figures(calibration) if figure.key not in _FIRM
    )


def _mounting_figures(calibration: Calibration) -> tuple[Figure, ...]:
    mounting = mounting_of(calibration)
    position_sigma_m, angle_sigma_rad = mounting.position_sigma_m.copy(), mounting.roll_pitch_yaw_sigma_rad.copy()
    if not calibration.sees_elevation:
        firm = sigma_in_radar_axes(calibration.camera_from_radar, calibration.firm_covariance)
        position_sigma_m[:2], angle_sigma_rad[2] = firm.position_m[:2], firm.rotation_rad[2]
    causes = calibration.dominant_errors()
    of_position, of_rotation = (
        "".join(
            f" {in_sentence(dominant_sentence(error, measured=False, with_remedy=False))}"
            for error in causes
            if getattr(error, f"{part}_share")
        )
        for part in ("position", "rotation")
    )
    centimetres, sigmas_cm = 100 * mounting.position_m, 100 * position_sigma_m
    degrees, sigmas_deg = np.rad2deg(mounting.roll_pitch_yaw_rad), np.rad2deg(angle_sigma_rad)
    return (
        *(_signed(*row, "cm", of_position) for row in zip(_POSITION, centimetres, sigmas_cm, strict=True)),
        *(_signed(*row, "°", of_rotation) for row in zip(_ANGLES, degrees, sigmas_deg, strict=True)),
    )


def _signed(what: tuple[str, str, str], value: float, sigma: float, unit: str, causes: str) -> Figure:
    key, label, hint = what
    return Figure(key, label, with_sigma(float(value), float(sigma)), unit, hint + causes)


def _image_figures(calibration: Calibration) -> tuple[Figure, ...]:
    """Return how far off a reprojection may be, if that is known."""
    sigma_px = calibration.metrics.picture_sigma_px
    if not np.isfinite(sigma_px):
        return ()
    hint = (
        "One standard deviation, per axis, of where a radar position at the placements reprojects. Errors of pose and radar "
        "mostly cancel there; the noise of a single radar position is not included."
    )
    return (Figure("image", "in the image", f"± {plain(sigma_px, 2)}", "px", hint),)


def _radar_figures(calibration: Calibration) -> tuple[Figure, ...]:
    """Return the error of the radar's own angles, if correcting it would help."""
    angle_map = calibration.angle_map
    if angle_map is None:
        return ()
    hint = (
        "The radar's angle errors vary smoothly with direction, so no pose can remove them. Correcting them with the map "
        f"in calibration.json (radar_angle_map) reduces the mean residual from {plain(angle_map.raw_aed_px)} to "
        f"{plain(angle_map.corrected_aed_px)} px, each pair being corrected from the other pairs only."
    )
    return (
        Figure("radar_angles", "radar angle error", f"up to {plain(np.rad2deg(angle_map.largest_rad))}", "°", hint),
    )


def residual_limit_px(calibration: Calibration) -> float | None:
    """Return the length above which a residual should be checked [px].

    With the paper's method, RANSAC's threshold; otherwise the median of the 95 % ellipses' semi-major axes.
    """
    if not calibration.options.models_noise:
        return calibration.options.paper.ransac_threshold_px
    ellipses = (pair.ellipse for pair in reprojections(calibration.pairs).values())
    lengths = [ellipse.semi_major_px for ellipse in ellipses if ellipse is not None]
    return float(np.median(lengths)) if lengths else None


_FIRM = ("camera_x", "camera_y", "yaw")
"""What a radar without elevation determines."""

_SIGMA = "± one standard deviation."
_AHEAD = "relative to looking along the radar's x axis"
_POSITION = (
    (
        "camera_x",
        "camera forward",
        f"Camera center ahead of the radar or behind it, along its x axis, {_SIGMA}",
    ),
    ("camera_y", "camera left", f"Camera center to the side of the radar, along its y axis, {_SIGMA}"),
    ("camera_z", "camera up", f"Camera center above or below the radar, along its z axis, {_SIGMA}"),
)
_ANGLES = (
    ("roll", "roll to the right", f"Camera tilted to its side, {_AHEAD}, {_SIGMA}"),
    ("pitch", "pitch down", f"Camera looking down or up, {_AHEAD}, {_SIGMA}"),
    ("yaw", "yaw left", f"Camera looking to the side, {_AHEAD}, {_SIGMA}"),
)
"""Key, label, which says what is positive, explanation."""


OPTICAL_FROM_BODY: Matrix33 = frozen_array([[0, -1, 0], [0, 0, -1], [1, 0, 0]], (3, 3))
"""A camera that looks forward: its optical axes (x right, y down, z forward) from x forward, y left, z up."""


@dataclass(frozen=True, slots=True, eq=False)
class Mounting:
    """The position and orientation of the camera relative to the radar.

    Attributes:
        position_m: (3,) camera center in the radar frame.
        position_sigma_m: (3,) its standard deviations; NaN if unknown.
        roll_pitch_yaw_rad: (3,) rotations about the radar's x, y, z axes, Rz(yaw) Ry(pitch) Rx(roll), relative to looking
            straight forward. Positive roll tips the camera to its right, positive pitch looks down, positive yaw looks left.
        roll_pitch_yaw_sigma_rad: (3,) their standard deviations; NaN if unknown.
    """

    position_m: Vector3
    position_sigma_m: Vector3
    roll_pitch_yaw_rad: Vector3
    roll_pitch_yaw_sigma_rad: Vector3


def mounting_of(calibration: Calibration) -> Mounting:
    """Turn camera_from_radar and its covariance into a mounting.

    With t = t_hat + dt and R = Exp(dtheta) R_hat the center c = -R^T t moves by -R^T dt - R^T [t]x dtheta,
    and the mounted body turns about its own axes by -(optical_from_body)^T dtheta, to first order.
    """
    rotation = calibration.camera_from_radar.rotation
    translation_m = calibration.camera_from_radar.translation_m
    radar_from_body = rotation.T @ OPTICAL_FROM_BODY
    roll, pitch, yaw = _roll_pitch_yaw(radar_from_body)
    position_jacobian = camera_position_jacobian(calibration.camera_from_radar)
    angle_jacobian = np.hstack([np.zeros((3, 3)), -_angle_rates(roll, pitch) @ OPTICAL_FROM_BODY.T])
    return Mounting(
        position_m=-rotation.T @ translation_m,
        position_sigma_m=_sigmas(position_jacobian, calibration.covariance),
        roll_pitch_yaw_rad=np.array([roll, pitch, yaw]),
        roll_pitch_yaw_sigma_rad=_sigmas(angle_jacobian, calibration.covariance),
    )


def _roll_pitch_yaw(radar_from_body: Matrix33) -> tuple[float, float, float]:
    m = radar_from_body
    pitch = np.arctan2(-m[2, 0], np.hypot(m[0, 0], m[1, 0]))
    return float(np.arctan2(m[2, 1], m[2, 2])), float(pitch), float(np.arctan2(m[1, 0], m[0, 0]))


def _angle_rates(roll: float, pitch: float) -> Matrix33:
    """Return d(roll, pitch, yaw) / d(rotation about the body's own axes); it grows without bound as pitch nears 90 degrees."""
    s, c = np.sin(roll), np.cos(roll)
    cos_pitch = max(float(np.cos(pitch)), 1e-9)
    tan_pitch = np.sin(pitch) / cos_pitch
    return np.array([[1.0, s * tan_pitch, c * tan_pitch], [0.0, c, -s], [0.0, s / cos_pitch, c / cos_pitch]])


def _sigmas(jacobian: np.ndarray, covariance: np.ndarray) -> Vector3:
    return np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0.0))


_SHOWN_SHARE = 0.03
_DOMINANT_SHARE = 1.0 / 3.0


def uncertainty_sentences(calibration: Calibration) -> tuple[Words, ...]:
    """Say which errors make up a third or more of the uncertainty, and what the verdict does not say of reducing them."""
    action = verdict_on(calibration).action
    measured = calibration.options.solving.camera_position is not None
    reduced = action.name if isinstance(action, ReduceError) else ""
    return tuple(
        in_sentence(dominant_sentence(error, measured=measured, with_remedy=error.largest.name != reduced))
        for error in calibration.dominant_errors()
    )


def refined_sentences(calibration: Calibration) -> tuple[str, ...]:
    """Say by how much refining changed the intrinsics; empty if they were not refined."""
    refined = [
        error
        for error in calibration.systematic_errors
        if error.estimated and error.of_lens and (is_determined(error) or abs(error.value) >= error.prior_sigma > 0.0)
    ]
    if calibration.given_camera is None:
        return ()
    parts = []
    for result in refined:
        words = error_words(result.name)
        amount = with_sigma(words.factor * result.value, words.factor * result.sigma)
        parts.append(f"{words.label} by {amount} {words.unit}".rstrip())
    changed = "; ".join(parts) or "the pairs say nothing about them"
    return (sentence(f"the intrinsics were refined with the pose: {changed}"),)


def systematic_errors(calibration: Calibration) -> SystematicErrorTable:
    """Return the table: errors that the pairs determine or that matter, the largest share first."""
    groups = sorted(_groups(calibration.errors_of_firm), key=_largest_share, reverse=True)
    shown = [group for group in groups if _largest_share(group) >= _SHOWN_SHARE or is_determined(group[0])]
    sentences = (*uncertainty_sentences(calibration), *map(in_sentence, refined_sentences(calibration)))
    return SystematicErrorTable(tuple(map(_row, shown)), sentences)


def _groups(errors: Sequence[SystematicErrorResult]) -> list[list[SystematicErrorResult]]:
    """Put errors of several axes that the pairs do not determine together; every other error stands alone."""
    groups: dict[str, list[SystematicErrorResult]] = {}
    for error in errors:
        groups.setdefault(error.name if is_determined(error) else family_of(error.name), []).append(error)
    return list(groups.values())


def _shares(group: Sequence[SystematicErrorResult]) -> tuple[float, float]:
    return sum(result.position_share for result in group), sum(result.rotation_share for result in group)


def _largest_share(group: Sequence[SystematicErrorResult]) -> float:
    return max(_shares(group))


def _row(group: Sequence[SystematicErrorResult]) -> SystematicErrorRow:
    one, (position, rotation) = group[0], _shares(group)
    words = error_words(one.name)
    family = FAMILIES.get(family_of(one.name))
    label = family.label if len(group) > 1 and family is not None else words.label
    known = "Estimated with the pose." if one.estimated else "Not taken out of the pose, but part of its uncertainty."
    value = with_sigma(words.factor * one.value, words.factor * one.sigma) if is_determined(one) else "–"
    reduced = str(in_sentence(words.remedy.phrase + " would reduce it"))
    hint = " ".join((*(sentence(error_words(each.name).text) for each in group), known, reduced))
    level: Level = "warning" if max(position, rotation) >= _DOMINANT_SHARE else "plain"
    return SystematicErrorRow(
        Figure(one.name, label, value, words.unit, hint, level),
        prior=f"± {plain(words.factor * one.prior_sigma, 2)}",
        position_percent=round(100.0 * position),
        rotation_percent=round(100.0 * rotation),
    )
