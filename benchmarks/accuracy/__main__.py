"""`python -m benchmarks.accuracy`: measure the trials that are not kept yet, and write docs/accuracy.md."""

import argparse
import os
import shlex
import sys
from collections.abc import Callable, Collection
from fnmatch import fnmatch
from pathlib import Path

from benchmarks.accuracy import efficiency, smooth, verdicts
from benchmarks.accuracy.defects import (
    adversarial,
    crying_wolf,
    dragging,
    flat_radars,
    handedness,
    measured_positions,
    shared_errors,
    two_reflectors,
    wrong_lens,
)
from benchmarks.accuracy.fresh_seeds import FreshSeeds, fresh_seeds, last_fresh_seeds
from benchmarks.accuracy.keeping import Keeper, digest_of_sources
from benchmarks.accuracy.page import page, table
from benchmarks.accuracy.rows import Kept, Row, Section
from benchmarks.accuracy.running import kept_figures, run

_ROOT = Path(__file__).resolve().parents[2]
_SECTIONS: dict[str, tuple[tuple[Row, ...], Callable[[Kept], Section]]] = {
    "shared": (shared_errors.ROWS, shared_errors.section),
    "smooth": (smooth.ROWS, smooth.section),
    "verdict": (verdicts.ROWS, verdicts.section),
    "measured": (measured_positions.ROWS, measured_positions.section),
    "defects": (adversarial.ROWS, adversarial.section),
    "warnings": (crying_wolf.ROWS, crying_wolf.section),
    "handedness": (handedness.ROWS, handedness.section),
    "lens": (wrong_lens.ROWS, wrong_lens.section),
    "flat": (flat_radars.ROWS, flat_radars.section),
    "returns": (two_reflectors.ROWS, two_reflectors.section),
    "drag": (dragging.ROWS, dragging.section),
    "bound": (efficiency.ROWS, efficiency.section),
}
"""The rows of each question by its name for --only, and what judges them, in the order of the page."""
TABLES = {name: rows for name, (rows, _) in _SECTIONS.items()}


def sections(kept: Kept, only: Collection[str] = ()) -> dict[str, Section]:
    """Return what was measured of all questions, or of some only, in the order of the page."""
    measured = {
        name: judge(kept) for name, (rows, judge) in _SECTIONS.items() if any(kept.get(row.key) for row in rows)
    }
    return {name: section for name, section in measured.items() if not only or name in only}


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy", description=main.__doc__)
    parser.add_argument(
        "--only", action="append", choices=sorted(TABLES), help="measure this table only; may be repeated"
    )
    parser.add_argument(
        "--rows", action="append", help="measure rows with such a key only, such as 'peers-*-20-*'; may be repeated"
    )
    parser.add_argument("--alone", action="store_true", help="write the tables of --only and no others")
    parser.add_argument("--trials", type=int, default=None, help="sets per row instead of its own number")
    parser.add_argument(
        "--seed",
        default="fixed",
        help="fixed, fresh: from the present commit's hash, or the hash of a run to repeat it",
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: one per processor)")
    parser.add_argument("--scratch", type=Path, default=_ROOT / "build" / "accuracy", help="where raw figures are kept")
    parser.add_argument("--page", type=Path, default=_ROOT / "docs" / "accuracy.md", help="the page that is written")
    parser.add_argument(
        "--tables", type=Path, default=Path(__file__).with_name("tables"), help="the folder of the detailed tables"
    )
    parser.add_argument("--write-only", action="store_true", help="write the page from kept figures, measure nothing")
    parser.add_argument(
        "--kept", type=Path, help="continue with this folder of raw figures, whatever version of the code made it"
    )
    return parser.parse_args()


def main() -> int:
    """Measure the accuracy and write the page. An interrupted run resumes if the code is unchanged."""
    arguments = _arguments()
    keeper = Keeper(arguments.kept or arguments.scratch / digest_of_sources())
    if arguments.seed == "fresh":
        fresh = last_fresh_seeds(keeper.folder) if arguments.write_only else fresh_seeds(keeper.folder)
    else:
        fresh = None if arguments.seed == "fixed" else FreshSeeds(arguments.seed)
    first = 0 if fresh is None else fresh.first_trial
    rows = [row for name in TABLES if not arguments.only or name in arguments.only for row in TABLES[name]]
    rows = [row for row in rows if not arguments.rows or any(fnmatch(row.key, one) for one in arguments.rows)]
    if not arguments.write_only:
        run(rows, keeper, jobs=arguments.jobs, trials=arguments.trials, first=first)
    everything = [row for several in TABLES.values() for row in several]
    kept = kept_figures(everything, keeper, trials=arguments.trials, first=first)
    alone = arguments.only if arguments.alone and arguments.only else ()
    command = f"make bench-accuracy SEED={fresh.commit[:8]}" if fresh else "make bench-accuracy"
    if arguments.alone:
        command = shlex.join(["python", "-m", "benchmarks.accuracy", *sys.argv[1:]])
    measured = sections(kept, alone)
    arguments.tables.mkdir(parents=True, exist_ok=True)
    for name, section in measured.items():
        (arguments.tables / f"{name}.csv").write_text(table(section.rows), encoding="utf-8")
    counts = sum(map(len, kept.values())), sum(row.trials for row in everything)
    text = page(measured, commit="" if fresh is None else fresh.commit, command=command, counts=counts)
    arguments.page.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.stderr.write("interrupted; measured trials are kept, run the same command to resume\n")
        sys.stderr.flush()
        os._exit(130)  # without waiting for running trials; the child processes end with this one
