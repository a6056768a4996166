"""What `cocalib watch` sees, on simulated recordings.

python -m benchmarks.watch [traffic] [--seed 2000] [--count 39] [--seconds 900] [--keep FOLDER] [--processes 2]
python -m benchmarks.watch image [--seed 2100] [--count 8] [--keep FOLDER]

traffic: boxes as a detector would draw them, edges off by 1 px and 2 % in each frame and by 2 % for a whole track, one box in
twenty missed, no tracks. image: rendered scenes in other light, with other cars, in rain. Recordings and scenes have one seed
each, counted up from --seed. What is simulated or rendered is kept in --keep, which resumes a run.
"""

import argparse
import sys
from pathlib import Path

from benchmarks.watch import still_image, traffic

__all__ = ["main"]

_SEEDS = {"traffic": 2000, "image": 2100}
_COUNTS = {"traffic": 39, "image": 8}


def main() -> int:
    """Print the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="?", choices=[*_SEEDS], default="traffic")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--count", type=int)
    parser.add_argument("--seconds", type=int, default=900)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    seed, count = given.seed or _SEEDS[given.what], given.count or _COUNTS[given.what]
    lines = (
        traffic.report(seed, given.seconds, count, given.keep, given.processes)
        if given.what == "traffic"
        else still_image.report(seed, count, given.keep)
    )
    for line in lines:
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
