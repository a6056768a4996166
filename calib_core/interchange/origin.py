"""What an exported file says of the calibration that it was made from: evidence, hash, figures, warnings, what it cannot hold."""

import re
from dataclasses import dataclass

import numpy as np

from calib_core.interchange.calibration_file import CalibrationFile, Evidence, stated_evidence
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.results import Calibration

_ORIGIN = re.compile(r"evidence: ([^;\s]+); from the calibration with sha256 ([0-9a-f]{64})")


@dataclass(frozen=True, slots=True)
class Origin:
    """What an exported file states about where it comes from.

    Attributes:
        evidence: what the pose rests on; None if it states none.
        calibration_sha256: of the calibration-1 file that it was made from; None if it states none.
    """

    evidence: Evidence | None = None
    calibration_sha256: str | None = None


def origin_lines(file: CalibrationFile) -> tuple[str, ...]:
    """Return what every exported file says about its calibration, one line each; `stated_origin` reads the first."""
    calibration = file.calibration
    lines = [
        f"evidence: {file.rests_on}; from the calibration with sha256 {calibration_sha256(file)}",
        _figures(calibration),
    ]
    if file.verdict is not None:
        lines.append(f"verdict: {file.verdict.level}, {_one_line(file.verdict.reason)}")
    if calibration.warnings:
        codes = dict.fromkeys(_one_line(warning.code) for warning in calibration.warnings)
        lines.append(f"warnings of the calibration, explained in calibration.json: {', '.join(codes)}")
    return (*(line for line in lines if line), *missing_map(calibration))


def missing_map(calibration: Calibration) -> tuple[str, ...]:
    """Return the line about the angle map that only calibration-1 and the pack hold; nothing if there is no map."""
    grid = calibration.angle_map
    if grid is None:
        return ()
    return (
        f"NOT IN THIS FILE: the radar's angle map. Without it the pairs are {grid.raw_aed_px:.3g} px off, with it "
        f"{grid.corrected_aed_px:.3g} px; take radar_angle_map from calibration.json, or export the pack",
    )


def stated_origin(text: str) -> Origin:
    """Find the evidence and the calibration's hash in a file's text."""
    match = _ORIGIN.search(text)
    return Origin(stated_evidence(match[1]), match[2]) if match else Origin()


def _figures(calibration: Calibration) -> str:
    metrics, parts = calibration.metrics, []
    if np.isfinite(metrics.aed_px):
        held_out = f", held-out {metrics.held_out_aed_px:.3g} px" if np.isfinite(metrics.held_out_aed_px) else ""
        parts.append(f"AED {metrics.aed_px:.3g} px over {metrics.n} pairs{held_out}")
    variances = np.diag(calibration.covariance)
    if np.isfinite(variances).all() and (variances >= 0).all():
        sigma = np.sqrt(variances)
        cm, deg = (", ".join(f"{value:.2g}" for value in part) for part in (sigma[:3] * 100, np.degrees(sigma[3:])))
        parts.append(f"sigma of camera_from_radar in camera axes: x, y, z {cm} cm; rotX, rotY, rotZ {deg} deg")
    return "; ".join(parts)


def _one_line(text: str) -> str:
    return " ".join(text.split())
