"""`python -m benchmarks.paper`: measure the rows, draw the figures, and write docs/paper-experiments.md."""

import argparse
import datetime
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

from benchmarks.paper.fit import fit
from benchmarks.paper.moving import MOVING, acc_of
from benchmarks.paper.page import page
from benchmarks.paper.pictures import write_pictures
from benchmarks.paper.rows import Seed, calibrated, measure
from benchmarks.paper.settings import FITTED, SEEDS, Settings, pmm_options
from calib_core.calibration import calibrate
from calib_core.results import Calibration
from calib_core.synthetic import PresetName

__all__ = ["main"]

_ROOT = Path(__file__).resolve().parents[2]
_RANGE_SEEDS = tuple(range(1, 5))
_ACC_SEEDS = tuple(range(1, 4))
_RANGE = {
    "the best of the fit's grid": replace(FITTED, constant_azimuth_deg=0.4, constant_elevation_deg=0.7),
    "20 placements": replace(FITTED, placements=20),
    "1280 x 720": replace(FITTED, width_px=1280),
    "640 x 360": replace(FITTED, width_px=640),
    "half the constant errors": replace(FITTED, constant_azimuth_deg=0.125, constant_elevation_deg=0.4),
    "nothing is outshone": replace(FITTED, outshone_share=0.0),
    "everything is outshone": replace(FITTED, outshone_share=1.0),
}
_ACC_OF_PAPER = {"people": "89 %", "cars-near": "66 %, distance not available to us", "cars-far": "the same"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure what is asked for and write the page; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description=__doc__)
    parser.add_argument("--seeds", type=int, default=len(SEEDS), help="number of seeds of the table")
    parser.add_argument("--fit", action="store_true", help="run the fit and print it; write no page")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="number of processes")
    given = parser.parse_args(arguments)
    if given.fit:
        for place in fit():
            print(place)
        return 0
    with ProcessPoolExecutor(max_workers=given.workers) as pool:
        rows = list(pool.map(partial(measure, settings=FITTED), range(1, given.seeds + 1)))
        print(f"{len(rows)} seeds of the table")
        ranges = [("nothing", rows[: len(_RANGE_SEEDS)])]
        ranges += [(what, _some(pool, settings)) for what, settings in _RANGE.items()]
        print(f"{len(ranges)} other settings")
        found = {name: list(pool.map(partial(_acc, name), _ACC_SEEDS)) for name in MOVING}
    places = fit()
    accs = [
        (
            MOVING[name],
            *(list(column) for column in zip(*values, strict=True)),
            _ACC_OF_PAPER.get(name, "not available to us"),
        )
        for name, values in found.items()
    ]
    _draw(_ROOT / "docs" / "pictures" / "paper")
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    text = page(rows, FITTED, places, ranges, accs, date=today, command="make paper")  # type: ignore[arg-type]
    (_ROOT / "docs" / "paper-experiments.md").write_text(text, encoding="utf-8")
    return 0


def _some(pool: ProcessPoolExecutor, settings: Settings) -> list[Seed]:
    return list(pool.map(partial(measure, settings=settings, datasets=("d1", "d3")), _RANGE_SEEDS))


def _acc(name: PresetName, seed: int) -> tuple[float, float, float]:
    calibration = _solved(calibrated("d1", seed, FITTED)[1])
    figures = acc_of(name, calibration, seed, FITTED)
    values = (figures.acc, figures.acc_without_zero_frames, figures.chance)
    return tuple(float("nan") if value is None else value for value in values)  # type: ignore[return-value]


def _draw(folder: Path) -> None:
    """Draw the figures of the first seed."""
    first, by_points = calibrated("d1", 1, FITTED)
    by_mounting = calibrate(first.clicks, first.scans, first.camera, pmm_options(first))
    in_aisle = calibrated("d3", 1, FITTED)[1]
    ppm = _solved(by_points)
    calibrations = [
        ("D1 by PPM", ppm),
        ("D1 by PMM", _solved(by_mounting)),
        ("D3 by PPM", _solved(in_aisle)),
    ]
    people, cars = (acc_of(name, ppm, 1, FITTED) for name in ("people", "cars-far"))
    write_pictures(folder, calibrations, people, cars)


def _solved(outcome: object) -> Calibration:
    assert isinstance(outcome, Calibration), outcome
    return outcome


if __name__ == "__main__":
    raise SystemExit(main())
