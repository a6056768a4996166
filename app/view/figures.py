"""The figures next to the picture, each with one sentence that explains it."""

from dataclasses import replace

import numpy as np

from app.view.click_rows import ellipse_of
from app.view.model import Figure
from app.view.mounting import mounting_of
from app.view.number_format import plain, with_sigma
from calib_core.results import Calibration

__all__ = ["metric_figures", "pose_figures", "residual_limit_px"]

_HELD_OUT_RATIO = 1.5
"""A higher ratio of held-out to fitted error means that the pose depends too much on single pairs."""


def metric_figures(calibration: Calibration) -> tuple[Figure, ...]:
    """Return the figures that say how well the pairs agree."""
    metrics = calibration.metrics
    used = sum(not pair.excluded for pair in calibration.pairs)
    agreeing = sum(pair.inlier and not pair.excluded for pair in calibration.pairs)
    over = f"over {metrics.n} pairs"
    return (
        _figure("aed", "AED", metrics.aed_px, f"Mean distance between click and reprojection {over} (paper: AED)."),
        _held_out_figure(calibration),
        _figure(
            "cdsd", "CDSD", metrics.cdsd_px, "Standard deviation of these distances, with divisor N - 1 (paper: CDSD)."
        ),
        _figure(
            "rms", "RMS", metrics.rms_px, "Root mean square of these distances: large ones count more than in AED."
        ),
        Figure(
            "inliers",
            "pairs that agree",
            f"{agreeing} of {used}",
            "",
            "Pairs that agree on the pose, out of all that you have not excluded.",
            "good" if agreeing == used else "plain",
        ),
    )


def _figure(key: str, label: str, value_px: float, hint: str) -> Figure:
    return Figure(key, label, plain(value_px), "px", hint)


def _held_out_figure(calibration: Calibration) -> Figure:
    """Return the held-out error, with a warning if it is far above the fitted one."""
    metrics = calibration.metrics
    hint = "Mean distance when each pair is predicted from all the others: the error to expect at a new placement."
    figure = _figure("held_out_aed", "held-out AED", metrics.held_out_aed_px, hint)
    if metrics.held_out_aed_px > _HELD_OUT_RATIO * metrics.aed_px:
        warning = "It is well above AED, so the pose depends on single pairs: add placements."
        return replace(figure, hint=f"{hint} {warning}", level="warning")
    return figure


def pose_figures(calibration: Calibration) -> tuple[Figure, ...]:
    """Return the camera's position and angles relative to the radar, with one standard deviation."""
    mounting = mounting_of(calibration)
    figures = [
        Figure(key, label, with_sigma(100 * float(value), 100 * float(sigma)), "cm", hint)
        for (key, label, hint), value, sigma in zip(
            _POSITION, mounting.position_m, mounting.position_sigma_m, strict=True
        )
    ]
    degrees, sigmas = np.rad2deg(mounting.roll_pitch_yaw_rad), np.rad2deg(mounting.roll_pitch_yaw_sigma_rad)
    figures += [
        Figure(key, label, with_sigma(float(value), float(sigma)), "deg", hint)
        for (key, label, hint), value, sigma in zip(_ANGLES, degrees, sigmas, strict=True)
    ]
    return (*figures, *_radar_figures(calibration))


def _radar_figures(calibration: Calibration) -> tuple[Figure, ...]:
    """Return the error of the radar's own angles, if correcting it would help."""
    angle_map = calibration.angle_map
    if angle_map is None:
        return ()
    hint = (
        "The radar's angle errors vary smoothly with direction, so no pose can remove them. Correcting them with the map "
        f"in calibration.json (radar_angle_map) reduces AED from {plain(angle_map.raw_aed_px)} to "
        f"{plain(angle_map.corrected_aed_px)} px, each pair being corrected from the other pairs only."
    )
    return (
        Figure("radar_angles", "radar angle error", f"up to {plain(np.rad2deg(angle_map.largest_rad))}", "deg", hint),
    )


def residual_limit_px(calibration: Calibration) -> float | None:
    """Return the length above which a residual should be checked [px].

    With the paper's method, RANSAC's threshold; otherwise the median of the 95 % ellipses' semi-major axes.
    """
    if calibration.options.method == "paper":
        return calibration.options.paper.ransac_threshold_px
    ellipses = (ellipse_of(pair.expected_covariance_px2) for pair in calibration.pairs)
    lengths = [ellipse.semi_major_px for ellipse in ellipses if ellipse is not None]
    return float(np.median(lengths)) if lengths else None


_POSITION = (
    (
        "camera_x",
        "camera forward",
        "Camera centre ahead of the radar, along the radar's x axis, ± one standard deviation.",
    ),
    (
        "camera_y",
        "camera left",
        "Camera centre to the left of the radar, along the radar's y axis, ± one standard deviation.",
    ),
    ("camera_z", "camera up", "Camera centre above the radar, along the radar's z axis, ± one standard deviation."),
)
_ANGLES = (
    (
        "roll",
        "roll",
        "Camera tilted to its right, relative to looking along the radar's x axis, ± one standard deviation.",
    ),
    (
        "pitch",
        "pitch",
        "Camera looking down, relative to looking along the radar's x axis, ± one standard deviation.",
    ),
    ("yaw", "yaw", "Camera looking left, relative to looking along the radar's x axis, ± one standard deviation."),
)
