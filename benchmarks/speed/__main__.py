"""Measure everything and write docs/speed.md; --large opens recordings of 5 GB and, sparse, 100 GB as well."""

import sys
import tempfile
from pathlib import Path

from benchmarks.speed.board_search import measure_board_search
from benchmarks.speed.channel import measure_channel
from benchmarks.speed.checking import measure_checking
from benchmarks.speed.paging import measure_page
from benchmarks.speed.recordings import measure_recordings
from benchmarks.speed.rows import page
from benchmarks.speed.serving import measure_serving
from benchmarks.speed.showing import measure_showing
from benchmarks.speed.solving import measure_solving
from benchmarks.speed.starting import measure_starting
from cocalib.platform.resources import sample_folder

_PAGE = Path(__file__).resolve().parents[2] / "docs" / "speed.md"


def main() -> int:
    """Run every measurement; the exit code is 0 whatever the figures."""
    large = "--large" in sys.argv
    with tempfile.TemporaryDirectory() as scratch:
        tables = [
            *measure_page(Path(scratch)),
            measure_serving(Path(scratch)),
            measure_channel(),
            measure_solving(),
            measure_checking(Path(scratch)),
            measure_board_search(),
            measure_starting(sample_folder() / "rooftop"),
            measure_recordings(Path(scratch), large=large),
            measure_showing(Path(scratch)),
        ]
    text = page(tables, command="make bench BENCH=--large" if large else "make bench")
    _PAGE.write_text(text, encoding="utf-8")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
