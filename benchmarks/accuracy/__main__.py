"""`python -m benchmarks.accuracy`: measure the trials that are not kept yet, and write docs/accuracy.md."""

import argparse
import os
import sys
from pathlib import Path

from benchmarks.accuracy import advice, clutter, coverage, efficiency, many, mirrored, real, smooth, verdicts
from benchmarks.accuracy.defects import (
    adversarial,
    crying_wolf,
    dragging,
    flat_radars,
    handedness,
    several_topics,
    shared_errors,
    two_reflectors,
)
from benchmarks.accuracy.fresh_seeds import fresh_seeds, last_fresh_seeds
from benchmarks.accuracy.keeping import Keeper, digest_of_sources
from benchmarks.accuracy.page import page
from benchmarks.accuracy.rows import Kept, Row, Section
from benchmarks.accuracy.running import kept_figures, run

__all__ = ["TABLES", "main", "sections"]

_ROOT = Path(__file__).resolve().parents[2]
TABLES: dict[str, tuple[Row, ...]] = {
    "real": real.ROWS,
    "handedness": handedness.ROWS,
    "drag": dragging.ROWS,
    "placements": two_reflectors.ROWS,
    "topics": several_topics.ROWS,
    "wolf": crying_wolf.ROWS,
    "verdict": verdicts.ROWS,
    "shared": shared_errors.ROWS,
    "clean": shared_errors.CLEAN_ROWS,
    "flat": flat_radars.ROWS,
    "adversarial": adversarial.ROWS,
    "mirrored": mirrored.ROWS,
    "clutter": clutter.ROWS,
    "smooth": smooth.ROWS,
    "many": many.ROWS,
    "advice": advice.ROWS,
    "coverage": coverage.ROWS,
    "peers": efficiency.PEER_ROWS,
    "efficiency": efficiency.ROWS,
}
"""The rows by their name for --only, in the order they are measured: the longest table is last."""


def sections(kept: Kept) -> tuple[Section, ...]:
    """Return the sections in the order of the page."""
    return (
        verdicts.section(kept),
        shared_errors.section(kept),
        shared_errors.clean_section(kept),
        adversarial.section(kept),
        crying_wolf.section(kept),
        flat_radars.section(kept),
        handedness.section(kept),
        dragging.section(kept),
        two_reflectors.section(kept),
        several_topics.section(kept),
        efficiency.section(kept),
        efficiency.peer_section(kept),
        coverage.section(kept),
        clutter.section(kept),
        smooth.section(kept),
        many.section(kept),
        real.section(kept),
        mirrored.section(kept),
        advice.section(kept),
    )


def main() -> int:
    """Measure the accuracy and write the page. An interrupted run resumes if the code is unchanged."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy", description=main.__doc__)
    parser.add_argument(
        "--only", action="append", choices=sorted(TABLES), help="measure this table only; may be repeated"
    )
    parser.add_argument("--trials", type=int, default=None, help="largest number of trials per row")
    parser.add_argument(
        "--seed",
        choices=("fixed", "fresh"),
        default="fixed",
        help="fixed, or drawn from the present commit's hash; the page shows both (default: fixed)",
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: one per processor)")
    parser.add_argument("--scratch", type=Path, default=_ROOT / "build" / "accuracy", help="where raw figures are kept")
    parser.add_argument("--page", type=Path, default=_ROOT / "docs" / "accuracy.md", help="the page that is written")
    parser.add_argument("--write-only", action="store_true", help="write the page from kept figures, measure nothing")
    parser.add_argument(
        "--kept", type=Path, help="continue with this folder of raw figures, whatever version of the code made it"
    )
    arguments = parser.parse_args()
    keeper = Keeper(arguments.kept or arguments.scratch / digest_of_sources())
    fresh = fresh_seeds(keeper.folder) if arguments.seed == "fresh" else last_fresh_seeds(keeper.folder)
    first = fresh.first_trial if fresh is not None and arguments.seed == "fresh" else 0
    rows = [row for name in TABLES if not arguments.only or name in arguments.only for row in TABLES[name]]
    if not arguments.write_only:
        run(rows, keeper, jobs=arguments.jobs, most=arguments.trials, first=first)
    everything = [row for several in TABLES.values() for row in several]
    fixed_sections = sections(kept_figures(everything, keeper, most=arguments.trials))
    if fresh is None:
        text = page(fixed_sections)
    else:
        kept = kept_figures(everything, keeper, most=arguments.trials, first=fresh.first_trial)
        text = page(fixed_sections, sections(kept), commit=fresh.commit)
    arguments.page.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.stderr.write("interrupted; measured trials are kept, run the same command to resume\n")
        sys.stderr.flush()
        os._exit(130)  # without waiting for running trials; the child processes end with this one
