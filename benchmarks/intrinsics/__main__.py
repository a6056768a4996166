"""`python -m benchmarks.intrinsics`: calibrate lenses on fresh draws, and write accuracy.md beside this file."""

import argparse
import json
import shlex
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from benchmarks.accuracy.fresh_seeds import FreshSeeds, fresh_seeds
from benchmarks.intrinsics.bad_views import bad_view_table
from benchmarks.intrinsics.coverage import CASES, sigma_table
from benchmarks.intrinsics.rendered import boards, films
from benchmarks.intrinsics.speed import speed_table
from benchmarks.intrinsics.tables import Table

__all__ = ["TABLES", "main"]

_ROOT = Path(__file__).resolve().parents[2]
_HEAD = """# Accuracy of calibrated lenses

Written by `python -m benchmarks.intrinsics`; do not edit. The draws come from the hash of the commit that each section
names, so that nobody has seen them before. The cameras have 1280 x 720 pixels, focal lengths, principal points and
distortion about the usual ones of each lens model; the board has 9 x 6 corners and squares of 22.14 mm, and is held tilted
by up to 45 deg all over the image, of which its corners cover about 60 %. "Blur and noise" is a blur of 0.7 px and noise
of 2 grey levels; the bent board, the changing light (brightness 0.5 to 1.15, gradients of up to 40 %, vignetting of 40 %)
and the rolling shutter (20 ms, a board that drifts at 3 cm/s and 5 deg/s) have them too. The bend is 1.5 mm along the rows
and 0.7 mm along the columns. The aims: corners within 0.03 px and the focal length within 0.1 % with blur and noise, stated
sigmas that cover 93 to 97 %.
"""
TABLES: Mapping[str, tuple[Callable[..., Table], int]] = {
    "films": (films, 4),
    "boards": (boards, 4),
    "sigmas": (sigma_table, 200),
    "bad": (bad_view_table, 6),
    "speed": (lambda first, draws: speed_table(first), 1),
}
"""The tables by their name for --only, each with its usual number of draws."""


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.intrinsics", description=main.__doc__)
    parser.add_argument(
        "--only", action="append", choices=sorted(TABLES), help="measure this table only; may be repeated"
    )
    parser.add_argument("--draws", type=int, help="number of draws per row")
    parser.add_argument("--corners", choices=CASES, help="draw the corners of --only sigmas in this way only")
    parser.add_argument("--first", type=int, help="number of the first draw; by default from the present commit's hash")
    parser.add_argument("--scratch", type=Path, default=_ROOT / "build" / "intrinsics", help="where tables are kept")
    parser.add_argument("--page", type=Path, default=Path(__file__).with_name("accuracy.md"), help="the page to write")
    return parser.parse_args()


def main() -> int:
    """Measure the tables, keep each, and write the page from all that are kept."""
    given = _arguments()
    seeds = fresh_seeds(given.scratch) if given.first is None else FreshSeeds("")
    for name in given.only or TABLES:
        measure, usual = TABLES[name]
        first = seeds.first_trial if given.first is None else given.first
        chosen = {"corners": given.corners} if name == "sigmas" else {}
        table = measure(first, given.draws or usual, **chosen)
        sys.stderr.write(table.text)
        command = shlex.join(["python", "-m", "benchmarks.intrinsics", "--only", name])
        kept = {"text": table.text, "commit": seeds.commit or f"first draw {given.first}", "command": command}
        if given.draws:
            kept["command"] += f" --draws {given.draws}"
        if given.corners and name == "sigmas":
            kept["command"] += f" --corners {shlex.quote(given.corners)}"
        (given.scratch / f"{name}.json").write_text(json.dumps(kept), encoding="utf-8")
    given.page.write_text(_page(given.scratch), encoding="utf-8")
    return 0


def _page(scratch: Path) -> str:
    parts = [_HEAD]
    for name in TABLES:
        path = scratch / f"{name}.json"
        if path.is_file():
            kept = json.loads(path.read_text(encoding="utf-8"))
            parts.append(f"{kept['text']}\n`{kept['command']}`, draws from {kept['commit'][:10]}.\n")
    return "\n".join(parts)


if __name__ == "__main__":
    raise SystemExit(main())
