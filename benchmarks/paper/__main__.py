"""`python -m benchmarks.paper`: measure the rows, draw the figures, and write docs/paper-experiments.md."""

import argparse
import datetime
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

from benchmarks.paper.fit import FIT_FILE, fit, read_fit, write_lines
from benchmarks.paper.images import write_images
from benchmarks.paper.judgement import differing
from benchmarks.paper.moving import MOVING, acc_of, assumptions_of
from benchmarks.paper.page import MEASURED_FILE, Measured, page, read_measured, table
from benchmarks.paper.rows import Seed, measure
from benchmarks.paper.settings import FITTED, SEED_SETS, Settings

_ROOT = Path(__file__).resolve().parents[2]
_OTHER_SEEDS, _ACC_SEEDS = 4, 3
_OTHERS: Mapping[str, Settings] = {
    "20 placements": replace(FITTED, placements=20),
    "the fit's second place": replace(FITTED, constant_elevation_deg=0.2, board_corners=20),
    "a lens without distortion": replace(FITTED, distortion=False),
    "1280 x 720": replace(FITTED, width_px=1280),
    "640 x 360": replace(FITTED, width_px=640),
    "a mounting error of 2 deg": replace(FITTED, mounting_error_deg=2.0),
    "a mounting error of 5 deg": replace(FITTED, mounting_error_deg=5.0),
    "clicks with 3 px of error": replace(FITTED, click_sigma_px=3.0),
    "nothing is outshone": replace(FITTED, outshone_share=0.0),
    "everything is outshone": replace(FITTED, outshone_share=1.0),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure what is asked for and write the page; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description=__doc__)
    parser.add_argument("--seeds", type=int, default=len(SEED_SETS[0]), help="number of seeds of each set")
    parser.add_argument("--fit", action="store_true", help="run the fit and write fit.json; write no page")
    parser.add_argument("--rewrite", action="store_true", help="measure nothing; write the page from measured.json")
    parser.add_argument("--images", action="store_true", help="measure nothing; draw the figures")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="number of processes")
    given = parser.parse_args(arguments)
    with ProcessPoolExecutor(max_workers=given.workers) as pool:
        if given.fit:
            write_lines(FIT_FILE, fit(pool), "settings")
            return 0
        if not (given.rewrite or given.images):
            write_lines(MEASURED_FILE, _measured(pool, given.seeds), "rows")
    measured = read_measured()
    if not given.rewrite:
        write_images(_ROOT / "docs" / "images" / "paper", measured, FITTED)
    (_ROOT / "docs" / "paper-experiments.md").write_text(page(measured, FITTED, read_fit()), encoding="utf-8")
    print(table(measured))
    return 0


def _measured(pool: Executor, seeds: int) -> Measured:
    one, other = (_seeds(pool, FITTED, some[:seeds]) for some in SEED_SETS)
    sets = one, other
    print(f"{seeds} seeds of both sets; {len(differing(*sets))} of 18 judgements differ", flush=True)
    few, first = SEED_SETS[0][:_OTHER_SEEDS], sets[0][:_OTHER_SEEDS]
    others = {what: _seeds(pool, replace(changed, gross_pairs=0), few) for what, changed in _OTHERS.items()}
    print(f"{len(others)} other settings", flush=True)
    for_acc = SEED_SETS[0][:_ACC_SEEDS]
    accs = {name: tuple(pool.map(partial(acc_of, name, settings=FITTED), for_acc)) for name in MOVING}
    assumptions = tuple(pool.map(partial(assumptions_of, settings=FITTED), for_acc))
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    return Measured(today, sets, {"nothing": first, **others}, {str(name): accs[name] for name in accs}, assumptions)


def _seeds(pool: Executor, settings: Settings, seeds: Sequence[int]) -> tuple[Seed, ...]:
    return tuple(pool.map(partial(measure, settings=settings), seeds))


if __name__ == "__main__":
    raise SystemExit(main())
