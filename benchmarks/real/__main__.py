"""`python -m benchmarks.real --data FOLDER`: solve public sets, and compare with what their authors published."""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.real.judging import Judged, judged
from benchmarks.real.page import page, set_table, table_csv
from benchmarks.real.sets import SETS, RealSet
from calib_core.errors import CalibrationError

_ROOT = Path(__file__).resolve().parents[2]


def outcome_of(row: RealSet, data: Path) -> Judged | str:
    """Return what a set gives, or why it was not run.

    Args:
        row: the set.
        data: the folder with the checkouts.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="cocalib-real-") as scratch:
            return judged(row.contents(data, Path(scratch)), row.noise)
    except CalibrationError as error:
        return str(error)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the page, or write it and the figures; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.real", description=__doc__)
    parser.add_argument("--data", type=Path, help="folder with the checkouts, each named like its repository")
    parser.add_argument("--list", action="store_true", help="print where the sets are, and run nothing")
    parser.add_argument("--only", action="append", choices=sorted(SETS), help="this set only; may be repeated")
    parser.add_argument("--write", action="store_true", help="write docs/real.md and benchmarks/real/results.csv")
    given = parser.parse_args(arguments)
    rows = [row for row in SETS.values() if not given.only or row.name in given.only]
    if given.list:
        print(set_table(rows), *dict.fromkeys(row.clone for row in rows), sep="\n")
        return 0
    if given.data is None:
        parser.error("--data FOLDER is missing; --list prints what belongs there")
    outcomes = {row: outcome_of(row, given.data) for row in rows}
    if not given.write:
        print(page(outcomes))
        return 0
    (_ROOT / "docs" / "real.md").write_text(page(outcomes), encoding="utf-8")
    (_ROOT / "benchmarks" / "real" / "results.csv").write_text(table_csv(outcomes), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
