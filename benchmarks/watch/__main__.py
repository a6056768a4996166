"""What `cocalib watch` sees, on simulated recordings.

python -m benchmarks.watch [traffic] [--seed 2000] [--count 39] [--seconds 900] [--keep FOLDER] [--processes 2]
python -m benchmarks.watch --resampled 1000 --keep FOLDER
python -m benchmarks.watch --rendered --count 3
python -m benchmarks.watch image [--seed 2100] [--count 8] [--keep FOLDER]
python -m benchmarks.watch returns [--seed 2300] [--count 6]
python -m benchmarks.watch cost [--seed 2200] [--count 40]
python -m benchmarks.watch scenes --folders FIRST OTHER... --focal-px 706

traffic: boxes as a detector would draw them, edges off by 1 px and 2 % in each frame and by 2 % for a whole track, one box in
twenty missed, no tracks; with --rendered what moves in images of 960 x 540 pixels. image: rendered scenes in other light, with
other cars, in rain. returns: a radar that turns. cost: processor time and memory over --count half minutes. Recordings and
scenes have one seed each, counted up from --seed. What is simulated or rendered is kept in --keep, which resumes a run.
--resampled draws whole passages again instead of watching.
"""

import argparse
import sys
from pathlib import Path

from benchmarks.watch import cost, scenes, still_image, still_returns, traffic

__all__ = ["main"]

_SEEDS = {"traffic": 2000, "image": 2100, "returns": 2300, "cost": 2200, "scenes": 0}
_COUNTS = {"traffic": 39, "image": 8, "returns": 6, "cost": 40, "scenes": 0}


def main() -> int:
    """Print the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="?", choices=[*_SEEDS], default="traffic")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--count", type=int)
    parser.add_argument("--seconds", type=int, default=900)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--resampled", type=float, default=0.0, metavar="HOURS")
    parser.add_argument("--rendered", action="store_true")
    parser.add_argument("--folders", type=Path, nargs="+", default=[])
    parser.add_argument("--focal-px", type=float, default=1000.0)
    given = parser.parse_args()
    seed, count = given.seed or _SEEDS[given.what], given.count or _COUNTS[given.what]
    lines = {
        "traffic": lambda: traffic.report(
            *(seed, given.seconds, count, given.keep, given.processes),
            resampled_hours=given.resampled,
            rendered=given.rendered,
        ),
        "image": lambda: still_image.report(seed, count, given.keep),
        "returns": lambda: still_returns.report(seed, count),
        "scenes": lambda: scenes.report(given.folders, given.focal_px),
        "cost": lambda: cost.report(seed, count),
    }
    for line in lines[given.what]():
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
