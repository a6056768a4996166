"""The fit of the two radar errors, on PPM+D1 and PPM+D2 and nothing else.

Over a grid of constant azimuth and elevation errors, it looks for the smallest sum of squared logarithms of ours over the
paper's: AED and CDSD of D1, and the ratio of the two of D2, each as the median over seeds that the table does not use.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.paper.rows import calibrated
from benchmarks.paper.settings import FIT_SEEDS, FITTED, Settings
from calib_core.results import Calibration

__all__ = ["AZIMUTHS_DEG", "ELEVATIONS_DEG", "Fitted", "fit"]

AZIMUTHS_DEG = (0.15, 0.25, 0.4)
ELEVATIONS_DEG = (0.7, 0.8, 0.9)
_D1 = (15.31, 9.40)
_D2_RATIO = 2.65


@dataclass(frozen=True, slots=True)
class Fitted:
    """One place of the grid: the settings, the medians, and how far they are from the paper's figures."""

    settings: Settings
    aed_d1_px: float
    cdsd_d1_px: float
    ratio_d2: float
    mismatch: float


def fit(seeds: tuple[int, ...] = tuple(FIT_SEEDS), report: Callable[[str], None] = print) -> tuple[Fitted, ...]:
    """Try every place of the grid; the best is first."""
    found = []
    for azimuth_deg, elevation_deg in itertools.product(AZIMUTHS_DEG, ELEVATIONS_DEG):
        settings = Settings(azimuth_deg, elevation_deg, FITTED.width_px, FITTED.placements)
        d1, d2 = (_medians(dataset, seeds, settings) for dataset in ("d1", "d2"))
        ratio = float(d2[0] / d2[1])
        logs = np.log([d1[0] / _D1[0], d1[1] / _D1[1], ratio / _D2_RATIO])
        found.append(Fitted(settings, float(d1[0]), float(d1[1]), ratio, float(np.square(logs).sum())))
        report(f"azimuth {azimuth_deg}, elevation {elevation_deg}: {found[-1].mismatch:.3f}")
    return tuple(sorted(found, key=lambda one: one.mismatch))


def _medians(dataset: str, seeds: tuple[int, ...], settings: Settings) -> np.ndarray:
    outcomes = [calibrated(dataset, seed, settings)[1] for seed in seeds]  # type: ignore[arg-type]
    figures = [(one.metrics.aed_px, one.metrics.cdsd_px) for one in outcomes if isinstance(one, Calibration)]
    return np.median(figures, axis=0) if figures else np.full(2, np.nan)
