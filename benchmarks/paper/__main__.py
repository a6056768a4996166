"""`python -m benchmarks.paper`: measure the rows, draw the figures, and write docs/paper-experiments.md."""

import argparse
import datetime
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

from benchmarks.paper.fit import fit, read_fit, write_fit
from benchmarks.paper.measured import AccRow, Measured, read_measured, write_measured
from benchmarks.paper.moving import MOVING, acc_of
from benchmarks.paper.page import page
from benchmarks.paper.pictures import write_pictures
from benchmarks.paper.rows import Seed, by_mounting, calibrated, measure
from benchmarks.paper.settings import FITTED, SEEDS, Dataset, Settings
from calib_core.results import Calibration
from calib_core.synthetic import PresetName

__all__ = ["main"]

_ROOT = Path(__file__).resolve().parents[2]
_RANGE_SEEDS = tuple(range(1, 5))
_ACC_SEEDS = tuple(range(1, 4))
_NARROW = replace(
    FITTED,
    width_px=640,
    constant_azimuth_deg=3.0 * FITTED.constant_azimuth_deg,
    constant_elevation_deg=3.0 * FITTED.constant_elevation_deg,
)
_BOTH: tuple[Dataset, ...] = ("d1", "d3")
_RANGE: Mapping[str, tuple[Settings, tuple[Dataset, ...]]] = {
    "20 placements": (replace(FITTED, placements=20), _BOTH),
    "112 placements, for which the aisle has no room": (replace(FITTED, placements=112), ("d1",)),
    "1280 x 720": (replace(FITTED, width_px=1280), _BOTH),
    "640 x 360, constant errors three times as large": (_NARROW, _BOTH),
    "the same, and a mounting error of 7 deg": (replace(_NARROW, mounting_error_deg=7.0), _BOTH),
    "a mounting error of 2 deg": (replace(FITTED, mounting_error_deg=2.0), _BOTH),
    "nothing is outshone": (replace(FITTED, outshone_share=0.0), _BOTH),
    "everything is outshone": (replace(FITTED, outshone_share=1.0), _BOTH),
}
_ACC_OF_PAPER = {"people": "89 %", "cars-near": "66 %, distance not available to us", "cars-far": "the same"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure what is asked for and write the page; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description=__doc__)
    parser.add_argument("--seeds", type=int, default=len(SEEDS), help="number of seeds of the table")
    parser.add_argument("--fit", action="store_true", help="run the fit and write fit.json; write no page")
    parser.add_argument("--rewrite", action="store_true", help="measure nothing; write the page from measured.json")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="number of processes")
    given = parser.parse_args(arguments)
    if given.fit:
        write_fit(fit())
        return 0
    if not given.rewrite:
        write_measured(_measured(given.seeds, given.workers))
    _draw(_ROOT / "docs" / "pictures" / "paper")
    text = page(read_measured(), FITTED, read_fit(), command="make paper")
    (_ROOT / "docs" / "paper-experiments.md").write_text(text, encoding="utf-8")
    return 0


def _measured(seeds: int, workers: int) -> Measured:
    with ProcessPoolExecutor(max_workers=workers) as pool:
        rows = tuple(pool.map(partial(measure, settings=FITTED), range(1, seeds + 1)))
        print(f"{len(rows)} seeds of the table", flush=True)
        ranges = (
            ("nothing", rows[: len(_RANGE_SEEDS)]),
            *((what, _some(pool, settings, datasets)) for what, (settings, datasets) in _RANGE.items()),
        )
        print(f"{len(ranges)} other settings", flush=True)
        accs = tuple(_acc_row(name, list(pool.map(partial(_acc, name), _ACC_SEEDS))) for name in MOVING)
    return Measured(datetime.datetime.now(tz=datetime.UTC).date().isoformat(), rows, ranges, accs)


def _some(pool: ProcessPoolExecutor, settings: Settings, datasets: Sequence[Dataset]) -> tuple[Seed, ...]:
    return tuple(pool.map(partial(measure, settings=settings, datasets=datasets), _RANGE_SEEDS))


def _acc(name: PresetName, seed: int) -> tuple[float | None, ...]:
    judged = acc_of(name, _solved(calibrated("d1", seed, FITTED)[1]), seed, FITTED)
    own = judged.by_targets
    return own.acc, own.acc_without_zero_frames, judged.by_labels.acc, own.chance


def _acc_row(name: PresetName, seeds: Sequence[tuple[float | None, ...]]) -> AccRow:
    columns = (tuple(float("nan") if one is None else one for one in column) for column in zip(*seeds, strict=True))
    return AccRow(MOVING[name], _ACC_OF_PAPER.get(name, "not available to us"), *columns)


def _draw(folder: Path) -> None:
    """Draw the figures of the first seed."""
    first, by_points = calibrated("d1", 1, FITTED)
    in_aisle = calibrated("d3", 1, FITTED)[1]
    ppm = _solved(by_points)
    calibrations = [
        ("D1 by PPM", ppm),
        ("D1 by PMM", by_mounting(first)),
        ("D3 by PPM", _solved(in_aisle)),
    ]
    targets: tuple[PresetName, ...] = ("people", "cars-near", "cars-far")
    write_pictures(folder, calibrations, [(MOVING[name], acc_of(name, ppm, 1, FITTED).by_targets) for name in targets])


def _solved(outcome: object) -> Calibration:
    assert isinstance(outcome, Calibration), outcome
    return outcome


if __name__ == "__main__":
    raise SystemExit(main())
