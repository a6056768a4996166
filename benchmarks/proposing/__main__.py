"""`python -m benchmarks.proposing`: propose on recordings that nobody looked at, and write accuracy.md beside this file."""

import argparse
import shlex
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from benchmarks.accuracy.fresh_seeds import fresh_seeds
from benchmarks.accuracy.keeping import Keeper, digest_of_sources
from benchmarks.accuracy.rows import Figures
from benchmarks.proposing.left_alone import measure_mismatched
from benchmarks.proposing.measured import measure_case, measure_square
from benchmarks.proposing.speed import speed_table
from benchmarks.proposing.tables import aims_table, traits_table
from benchmarks.proposing.without_reflector import measure_drive
from benchmarks.proposing.wrong_tables import drives_table, mismatched_table, real_table

__all__ = ["main"]

_ROOT = Path(__file__).resolve().parents[2]
_NAMES = ("cases", "square", "mismatched", "drives", "real", "speed")
_HEAD = """# Accuracy of proposals

Written by `python -m benchmarks.proposing`; do not edit. Simulated recordings of 10 to 14 placements, images of
1280 x 720: field, aisle, rooftop and a checkerboard wall, with either radar and every level of clutter in turn; at random
light that changes (brightness by up to 60 %, tint, one change of exposure), passers-by, two reflectors at a time, a
tripod, noise of the camera. A seed names one recording; seeds from 20,000 were not looked at before. "After one click" means
that the person clicks the first proposal of a placement at the true pixel with an error of 0.7 px; that placement counts
as right. A person accepts what lies on the reflector, within half of its width. What is not proposed is not right. A pose is
confidently wrong if the truth is outside twice its stated 99.9 % region, or more than 5 deg away although its verdict is good
or usable; a weak verdict says itself how far off the pose may be.
"""


@dataclass(frozen=True, slots=True)
class _Measure:
    """How a table is measured, seed by seed.

    Attributes:
        figures: of a seed.
        draws: the usual number.
        texts: of the tables that follow.
    """

    figures: Callable[[int], Figures]
    draws: int
    texts: Callable[[Mapping[int, Figures]], tuple[str, ...]]


def _measures(given: argparse.Namespace) -> Mapping[str, _Measure]:
    frames, first = given.frames or given.scratch / "frames", given.first
    mismatched = partial(measure_mismatched, frames, first, given.recordings)
    return {
        "cases": _Measure(
            partial(measure_case, frames), 200, lambda kept: (aims_table(kept).text, traits_table(kept).text)
        ),
        "square": _Measure(
            partial(measure_square, frames / "square"),
            12,
            lambda kept: (aims_table(kept, "a reflector of squares on a pole, which nothing was developed on").text,),
        ),
        "mismatched": _Measure(mismatched, 1000, lambda kept: (mismatched_table(kept, given.recordings).text,)),
        "drives": _Measure(partial(measure_drive, frames), 20, lambda kept: (drives_table(kept).text,)),
        "real": _Measure(lambda seed: {}, 0, lambda kept: (real_table().text,)),
        "speed": _Measure(lambda seed: {}, 0, lambda kept: (speed_table(first, frames).text,)),
    }


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.proposing", description=main.__doc__)
    parser.add_argument("--rows", nargs="+", choices=_NAMES, help="measure these tables only")
    parser.add_argument("--draws", type=int, help="number of recordings of each table")
    parser.add_argument("--first", type=int, default=20_000, help="seed of the first recording")
    parser.add_argument("--recordings", type=int, default=40, help="recordings of which images and radar are mixed")
    parser.add_argument("--scratch", type=Path, default=_ROOT / "build" / "proposing", help="where figures are kept")
    parser.add_argument("--frames", type=Path, help="where rendered frames are kept; by default below --scratch")
    parser.add_argument("--page", type=Path, default=Path(__file__).with_name("accuracy.md"), help="the page to write")
    return parser.parse_args()


def main() -> int:
    """Measure tables, keep each, and write the page from all that are kept."""
    given = _arguments()
    measures, commit = _measures(given), fresh_seeds(given.scratch).commit
    for name in given.rows or measures:
        measure = measures[name]
        draws = measure.draws if given.draws is None else given.draws
        kept = _measured(f"{name}-{given.recordings}" if name == "mismatched" else name, measure, given, draws)
        command = ["python", "-m", "benchmarks.proposing", "--rows", name, "--first", str(given.first)]
        command += ["--draws", str(draws)] if measure.draws else []
        command += ["--recordings", str(given.recordings)] if name == "mismatched" else []
        text = "\n".join((*measure.texts(kept), f"`{shlex.join(command)}`, at {commit[:10]}\n"))
        sys.stderr.write(text)
        (given.scratch / f"{name}.md").write_text(text, encoding="utf-8")
    parts = [given.scratch / f"{name}.md" for name in measures]
    page = "\n".join([_HEAD, *(part.read_text(encoding="utf-8") for part in parts if part.is_file())])
    given.page.write_text(page, encoding="utf-8")
    return 0


def _measured(key: str, measure: _Measure, given: argparse.Namespace, draws: int) -> Mapping[int, Figures]:
    """Measure the seeds whose figures are not kept yet."""
    keeper, seeds = Keeper(given.scratch / digest_of_sources()), range(given.first, given.first + draws)
    for seed in seeds if measure.draws else ():
        if seed not in keeper.read(key):
            keeper.add(key, [(seed, measure.figures(seed))])
            sys.stderr.write(f"{key} {seed - given.first + 1}/{draws}\n")
    return {seed: one for seed, one in keeper.read(key).items() if seed in seeds}


if __name__ == "__main__":
    raise SystemExit(main())
