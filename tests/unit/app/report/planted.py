"""Residuals with a planted pattern, and calibrations to report."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from app.report.making import subject_of
from app.report.residual_rows import ResidualRows
from app.report.subject import ReportSubject
from calib_core.interchange import imported, read_calibration
from calib_core.results import Calibration

__all__ = ["SIZE_PX", "golden", "planted_rows", "subject_for"]

SIZE_PX = (640, 480)
_N = 60


def planted_rows(*, growing_with: str = "", shift_px: float = 0.0, n: int = _N) -> ResidualRows:
    """Return residuals of about 2 px in all directions, three times as long at the upper end of one quantity.

    Args:
        growing_with: "range", "azimuth" (to both sides), "left", "column", "middle" (away from it), "time"; "" for none.
        shift_px: added to all of them, to the right.
        n: number of pairs.
    """
    rng = np.random.default_rng(3)
    ranges, azimuths = rng.uniform(3.0, 20.0, n), rng.uniform(-40.0, 40.0, n)
    pixels = rng.uniform((0, 0), SIZE_PX, (n, 2))
    times = rng.uniform(0.0, 100.0, n)
    quantity = {
        "range": ranges,
        "azimuth": np.abs(azimuths),
        "left": azimuths,
        "column": pixels[:, 0],
        "middle": np.linalg.norm(pixels - (np.array(SIZE_PX) - 1) / 2, axis=1),
        "time": times,
    }.get(growing_with, np.zeros(n))
    share = (quantity - quantity.min()) / max(float(np.ptp(quantity)), 1e-9)
    lengths = rng.uniform(1.0, 3.0, n) * (1.0 + 3.0 * share)
    angles = rng.uniform(0.0, 2.0 * np.pi, n)
    residuals = lengths[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1) + (shift_px, 0.0)
    bearing = np.deg2rad(azimuths)
    points = np.stack([ranges * np.cos(bearing), ranges * np.sin(bearing), np.zeros(n)], axis=1)
    unknown = np.full(n, np.nan)
    return ResidualRows(
        tuple(f"c{index}" for index in range(n)),
        ("used",) * n,
        points,
        pixels,
        pixels + residuals,
        times,
        unknown,
        unknown,
        unknown,
        unknown,
        solved_from=True,
    )


def golden(project_root: Path) -> Calibration:
    """Return the calibration of the golden file: five pairs, a warning, a click without a pair."""
    path = project_root / "tests" / "golden" / "calibration-1.json"
    return read_calibration(path.read_text(encoding="utf-8"), path.name).calibration


def subject_for(project_root: Path, calibration: Calibration | None = None) -> ReportSubject:
    """Return what is reported of the golden file, with another calibration in it if one is given."""
    path = project_root / "tests" / "golden" / "calibration-1.json"
    file = read_calibration(path.read_text(encoding="utf-8"), path.name)
    file = file if calibration is None else replace(file, calibration=calibration)
    return subject_of(imported(file), file.calibration, path.name)
