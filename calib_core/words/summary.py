"""A calibration in a few lines, and what `str` returns of values that know only their facts."""

import numpy as np

from calib_core.errors import UnsolvableError, in_words
from calib_core.geometry import quaternion_wxyz_from_matrix
from calib_core.measurements import DataWarning, Unpaired, Unsolvable
from calib_core.results.calibration import Calibration
from calib_core.results.radar_axes import RadarAxesSigma, sigma_in_radar_axes
from calib_core.results.verdict import Verdict, verdict_on
from calib_core.words.outcomes import outcome_remark, said_of
from calib_core.words.systematic_errors import dominance_text
from calib_core.words.verdict import action_words, verdict_line


@in_words.register
def _(warning: DataWarning) -> str:
    return f"{warning.code}: {said_of(warning)}"


@in_words.register
def _(click: Unpaired) -> str:
    return f"click {click.id}: {said_of(click)}"


@in_words.register
def _(outcome: Unsolvable) -> str:
    one = outcome_remark(outcome)
    return "\n  ".join((f"No calibration ({outcome.code}): {one.message}", str(one.hint), *map(str, outcome.unpaired)))


@in_words.register
def _(error: UnsolvableError) -> str:
    assert isinstance(error.outcome, Unsolvable)
    return f"no calibration: {said_of(error.outcome)}"


@in_words.register
def _(verdict: Verdict) -> str:
    return f"{verdict_line(verdict)}\n  {action_words(verdict)}"


@in_words.register
def _(calibration: Calibration) -> str:
    """Summarize the calibration in ten lines, with the verdict; a radar that measures no elevation adds one."""
    used = [pair for pair in calibration.pairs if not pair.excluded]
    agreeing = sum(pair.inlier for pair in used)
    pose, metrics, advised = calibration.camera_from_radar, calibration.metrics, calibration.next_placement
    held_out_px = metrics.held_out_aed_px
    advice = "none" if advised is None else "no further placement is needed"
    verdict = verdict_on(calibration)
    if advised is not None and not advised.may_stop and verdict.level != "contradictory":
        x_m, y_m, z_m = advised.position_radar_m
        percent = 100.0 * (1.0 - 1.0 / advised.gain)
        advice = f"({x_m:.1f}, {y_m:.1f}, {z_m:.1f}) m: {percent:.0f} % less uncertainty"
    quaternion = quaternion_wxyz_from_matrix(pose.rotation)
    return "\n".join(
        (
            f"camera_from_radar, method {calibration.options.method}: {agreeing} of {len(used)} clicks agree",
            f"  verdict         {verdict_line(verdict)}",
            "  translation     " + " ".join(f"{value:.4f}" for value in pose.translation_m) + " m",
            "  quaternion wxyz " + " ".join(f"{value:.6f}" for value in quaternion),
            *(f"  {line}" for line in _uncertainty_lines(calibration)),
            f"  residuals       mean reprojection error (AED) {metrics.aed_px:.2f} px, CDSD {metrics.cdsd_px:.2f} px, "
            f"RMS {metrics.rms_px:.2f} px",
            "  leave-one-out   " + (f"{held_out_px:.2f} px" if np.isfinite(held_out_px) else "unknown"),
            "  warnings        " + (", ".join(warning.code for warning in calibration.warnings) or "none"),
            "  next placement  " + advice,
        )
    )


def _uncertainty_lines(calibration: Calibration) -> tuple[str, ...]:
    """Say how certain the pose is, and which errors make up a third or more of that."""
    stated, firm = calibration.covariance, calibration.firm_covariance
    if not np.isfinite(stated).all():
        return "one sigma       unknown: this method has no noise model", "systematic      unknown"
    if calibration.sees_elevation:
        lines: tuple[str, ...] = (f"one sigma       {camera_axes_text(stated)}",)
    else:
        known, assumed = (sigma_in_radar_axes(calibration.camera_from_radar, one) for one in (firm, stated))
        image = f"in the image {calibration.metrics.picture_sigma_px:.1f} px"
        lines = (f"one sigma       {firm_text(known)}; {image}", f"not measured    {open_text(assumed)}")
    return (*lines, "systematic      " + dominance_text(calibration.dominant_errors()))


def firm_text(sigma: RadarAxesSigma) -> str:
    """Write what a radar without elevation determines."""
    forward, left = 100.0 * sigma.position_m[:2]
    return f"forward {forward:.1f}, left {left:.1f} cm; yaw {np.rad2deg(sigma.rotation_rad[2]):.2f} deg"


def open_text(sigma: RadarAxesSigma) -> str:
    """Write what such a radar leaves to assumptions."""
    roll, pitch = np.rad2deg(sigma.rotation_rad[:2])
    return (
        f"up {100.0 * sigma.position_m[2]:.0f} cm; pitch {pitch:.1f}, roll {roll:.1f} deg: the radar has no elevation"
    )


def camera_axes_text(covariance: np.ndarray) -> str:
    """Write the standard deviations of the translation and of the rotation about the camera's x, y and z axes."""
    sigma = np.sqrt(np.diag(covariance))
    (x, y, z), (about_x, about_y, about_z) = 100.0 * sigma[:3], np.rad2deg(sigma[3:])
    return f"x {x:.2f}, y {y:.2f}, z {z:.2f} cm; about x {about_x:.3f}, y {about_y:.3f}, z {about_z:.3f} deg"
