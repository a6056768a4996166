"""The eight rows of Table I for one seed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.paper.settings import Dataset, Settings, pmm_options, ppm_options, session
from calib_core.association.pairing import pair_clicks
from calib_core.calibration import calibrate
from calib_core.measurements import Unsolvable
from calib_core.paper.other_methods import calibrate_by_mounting, judged_again, swapped
from calib_core.results import Calibration
from calib_core.synthetic import SimulatedScans

__all__ = ["DATASETS", "Figures", "Seed", "by_mounting", "calibrated", "measure"]

DATASETS: tuple[Dataset, ...] = ("d1", "d2", "d3", "dr-a", "dr-b")


@dataclass(frozen=True, slots=True)
class Figures:
    """One row for one seed.

    Attributes:
        aed_px: NaN if there is no pose, or none of the points is before the camera.
        cdsd_px: likewise.
        outside: share of the clicked radar positions that the pose puts outside the picture.
    """

    aed_px: float
    cdsd_px: float
    outside: float


@dataclass(frozen=True, slots=True)
class Seed:
    """All rows for one seed: by name, and D1's pose judged on D2 and D3."""

    rows: Mapping[str, Figures]


def calibrated(dataset: Dataset, seed: int, settings: Settings) -> tuple[SimulatedScans, Calibration | Unsolvable]:
    """Simulate a data set and calibrate it by the paper's method."""
    simulated = session(dataset, seed, settings)
    return simulated, calibrate(simulated.clicks, simulated.scans, simulated.camera, ppm_options(settings))


def by_mounting(simulated: SimulatedScans) -> Calibration:
    """Return the pose of the mounting (PMM), judged on the clicks of a simulated data set."""
    options = pmm_options(simulated)
    pairing = pair_clicks(simulated.clicks, simulated.scans, options)
    return calibrate_by_mounting(pairing.pairs, simulated.camera, options, unpaired=pairing.unpaired)


def measure(seed: int, settings: Settings, datasets: Sequence[Dataset] = DATASETS) -> Seed:
    """Simulate data sets, D1 among them, and compute the rows that they give: of all of them, the eight and some more."""
    found = {dataset: calibrated(dataset, seed, settings) for dataset in datasets}
    rows = {f"PPM+{dataset.upper()}": _figures(outcome) for dataset, (_, outcome) in found.items()}
    first, by_points = found["d1"]
    mounted = by_mounting(first)
    rows["PMM+D1"] = _figures(mounted)
    if isinstance(by_points, Calibration):
        rows["R_PPM+T_m+D1"] = _figures(swapped(by_points, mounted))
        rows["R_I+T_c+D1"] = _figures(swapped(mounted, by_points))
        for dataset in ("d2", "d3"):
            _, other = found.get(dataset, (None, None))
            if isinstance(other, Calibration):
                again = judged_again(other, by_points.camera_from_radar)
                rows[f"D1's pose on {dataset.upper()}"] = _figures(again)
    return Seed(rows)


def _figures(outcome: Calibration | Unsolvable) -> Figures:
    if isinstance(outcome, Unsolvable):
        return Figures(float("nan"), float("nan"), float("nan"))
    used = np.array([pair.projected_px for pair in outcome.pairs if not pair.excluded])
    outside = 1.0 - float(outcome.camera.in_image(used).mean())
    return Figures(outcome.metrics.aed_px, outcome.metrics.cdsd_px, outside)
