"""The fit of the two radar errors, on PPM+D1 and PPM+D2 and nothing else.

Over a grid of constant azimuth and elevation errors, it looks for the smallest sum of squared logarithms of ours over the
paper's: AED and CDSD of D1, and the ratio of the two of D2, each as the median over seeds that the table does not use.
`python -m benchmarks.paper --fit` writes what it finds to fit.json; the best place there is `FITTED`.
"""

import dataclasses
import itertools
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.paper.rows import calibrated
from benchmarks.paper.settings import FIT_SEEDS, Settings
from calib_core.results import Calibration

__all__ = ["AZIMUTHS_DEG", "ELEVATIONS_DEG", "Fitted", "fit", "mismatch_of", "read_fit", "write_fit"]

AZIMUTHS_DEG = (0.2, 0.4, 0.5, 0.6, 0.8)
ELEVATIONS_DEG = (0.0, 0.2, 0.4, 0.6, 0.8)
_FILE = Path(__file__).with_name("fit.json")
_D1 = (15.31, 9.40)
_D2_RATIO = 2.65


@dataclass(frozen=True, slots=True)
class Fitted:
    """One place of the grid: the two errors, the medians, and how far they are from the paper's figures."""

    constant_azimuth_deg: float
    constant_elevation_deg: float
    aed_d1_px: float
    cdsd_d1_px: float
    ratio_d2: float
    mismatch: float


def mismatch_of(aed_d1_px: float, cdsd_d1_px: float, ratio_d2: float) -> float:
    """Return the sum of squared logarithms of these over the paper's."""
    logs = np.log([aed_d1_px / _D1[0], cdsd_d1_px / _D1[1], ratio_d2 / _D2_RATIO])
    return float(np.square(logs).sum())


def fit(seeds: Sequence[int] = FIT_SEEDS, report: Callable[[str], None] = print) -> tuple[Fitted, ...]:
    """Try every place of the grid; the best is first."""
    found = []
    for azimuth_deg, elevation_deg in itertools.product(AZIMUTHS_DEG, ELEVATIONS_DEG):
        settings = Settings(azimuth_deg, elevation_deg)
        d1, d2 = (_medians(dataset, seeds, settings) for dataset in ("d1", "d2"))
        figures = [round(float(one), 3) for one in (d1[0], d1[1], d2[0] / d2[1])]
        found.append(Fitted(azimuth_deg, elevation_deg, *figures, round(mismatch_of(*figures), 4)))
        report(str(found[-1]))
    return tuple(sorted(found, key=lambda one: one.mismatch))


def write_fit(places: Sequence[Fitted], path: Path = _FILE) -> None:
    """Write the places, the best first, one to a line."""
    lines = ",\n".join(f"  {json.dumps(dataclasses.asdict(one))}" for one in places)
    path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def read_fit(path: Path = _FILE) -> tuple[Fitted, ...]:
    """Read the places that the last fit wrote, the best first."""
    return tuple(Fitted(**one) for one in json.loads(path.read_text(encoding="utf-8")))


def _medians(dataset: str, seeds: Sequence[int], settings: Settings) -> np.ndarray:
    outcomes = [calibrated(dataset, seed, settings)[1] for seed in seeds]  # type: ignore[arg-type]
    figures = [(one.metrics.aed_px, one.metrics.cdsd_px) for one in outcomes if isinstance(one, Calibration)]
    return np.median(figures, axis=0) if figures else np.full(2, np.nan)
