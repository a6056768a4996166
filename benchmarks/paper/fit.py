"""The fit: radar errors and corners of the board on D1 and D2 alone, and the assumption that is chosen for DR+D3.

Over a grid of constant azimuth and elevation errors and of the number of corners, it looks for the smallest sum of squared
logarithms of ours over the paper's AED and CDSD of PPM+D1, PPM+D2 and CCM+D2, each as the median over seeds that the table
does not use. Then, with these settings, it looks for the gross errors that come nearest to PPM+DR+D3; that row is no
prediction. `python -m benchmarks.paper --fit` writes both to fit.json; the best places are `FITTED`.
"""

import itertools
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.paper.judgement import CHOSEN_ROW, PAPER
from benchmarks.paper.rows import MOST_GROSS, Figures, figures_of, measure, with_gross_errors
from benchmarks.paper.settings import FIT_SEEDS, Settings, other_rig, session
from calib_core.results import Calibration

AZIMUTHS_DEG = (0.4, 0.5, 0.6, 0.7, 0.8)
ELEVATIONS_DEG = (0.2, 0.4, 0.6, 0.8, 1.0)
CORNERS = (12, 20, 30)
GROSS_M = (1.0, 2.0, 3.0, 4.0, 6.0)
FITTED_ROWS = ("PPM+D1", "PPM+D2", "CCM+D2")
FIT_FILE = Path(__file__).with_name("fit.json")


@dataclass(frozen=True, slots=True)
class Place:
    """One place of a grid: the settings in its order, the medians of AED and CDSD by row, and their distance."""

    settings: tuple[float, ...]
    rows: dict[str, tuple[float, float]]
    mismatch: float


@dataclass(frozen=True, slots=True)
class Fit:
    """The places of both grids, the best first: (azimuth, elevation, corners), and (pairs, metres) of gross errors."""

    places: tuple[Place, ...]
    gross: tuple[Place, ...]


def mismatch_of(rows: Mapping[str, tuple[float, float]]) -> float:
    """Return the sum of squared logarithms of AED and CDSD over the paper's."""
    logs = np.log([ours / theirs for name in rows for ours, theirs in zip(rows[name], PAPER[name], strict=True)])
    return float(np.square(logs).sum())


def fit(pool: Executor, seeds: Sequence[int] = FIT_SEEDS) -> Fit:
    """Try every place of both grids."""
    places = []
    for place in itertools.product(AZIMUTHS_DEG, ELEVATIONS_DEG, CORNERS):
        found = pool.map(partial(measure, settings=Settings(*place), datasets=("d1", "d2")), seeds)
        places.append(_place(place, [one.rows for one in found], FITTED_ROWS))
        print(places[-1], flush=True)
    places.sort(key=lambda one: one.mismatch)
    azimuth_deg, elevation_deg, number = places[0].settings
    best = Settings(azimuth_deg, elevation_deg, int(number))
    by_seed = list(pool.map(partial(_gross, settings=best), seeds))
    gross = [_place(key, [{CHOSEN_ROW: one[key]} for one in by_seed if key in one], [CHOSEN_ROW]) for key in by_seed[0]]
    return Fit(tuple(places), tuple(sorted(gross, key=lambda one: one.mismatch)))


def read_fit() -> Fit:
    """Read the places that the last fit wrote."""
    return msgspec.json.decode(FIT_FILE.read_bytes(), type=Fit)


def write_lines(path: Path, value: object, first_key: str) -> None:
    """Write a value as JSON, each object that begins with a key on a line of its own."""
    start = f'{{"{first_key}"'.encode()
    path.write_bytes(msgspec.json.encode(value).replace(start, b"\n" + start) + b"\n")


def _gross(seed: int, settings: Settings) -> dict[tuple[float, ...], Figures]:
    other = other_rig(session("d3", seed, settings))
    tried = itertools.product(range(1, MOST_GROSS + 1), GROSS_M)
    outcomes = ((place, with_gross_errors(other, *place)) for place in tried)
    return {place: figures_of(outcome) for place, outcome in outcomes if isinstance(outcome, Calibration)}


def _place(settings: tuple[float, ...], seeds: Sequence[Mapping[str, Figures]], names: Sequence[str]) -> Place:
    figures = {name: [(one[name].aed_px, one[name].cdsd_px) for one in seeds if name in one] for name in names}
    rows = {name: tuple(np.median(some, axis=0).round(2).tolist()) for name, some in figures.items()}
    return Place(settings, rows, round(mismatch_of(rows), 4))
