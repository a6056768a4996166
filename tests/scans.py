"""Scans of returns whose noise nobody states."""

from collections.abc import Sequence

import numpy as np

from calib_core.measurements import NS_PER_S, RadarScan, TimeNs

Numbers = float | Sequence[float] | np.ndarray


def scan_of(
    time_s: float,
    points_radar_m: Sequence[Sequence[float]] | np.ndarray,
    *,
    doppler_mps: Numbers = 0.0,
    snr_db: Numbers = np.nan,
    alternative_of: np.ndarray | None = None,
) -> RadarScan:
    """Return a scan of positions (n, 3); a single number holds for all of them."""
    points = np.array(points_radar_m, dtype=np.float64).reshape(-1, 3)
    n = len(points)
    time, unknown = TimeNs(round(time_s * NS_PER_S)), np.full((n, 3), np.nan)
    return RadarScan(time, points, np.full(n, doppler_mps), np.full(n, snr_db), unknown, alternative_of)
