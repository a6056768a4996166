"""`python -m benchmarks.accuracy.coverage_guard`: does the stated 95 % region still hold the truth? `.ci/run` fails if not.

Both radars of docs/accuracy, with and without a measured camera position, with the errors that all pairs share, and with 0, 25,
49 and 81 % of the variance of the radar's angles smooth over direction, on draws from the present commit's hash: nobody has seen
them. No draw serves two cases, since their errors would be the same. Of 1,000 sets the share inside must be 90 to 99 %.
"""

import os
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np

from benchmarks.accuracy.defects.shared_errors import Shared, measure_shared
from benchmarks.accuracy.outcomes import inside
from cocalib.batch.worker_processes import WorkerProcesses

_CASES = tuple(
    Shared(noise, 20, tape_m, smooth_share=share)
    for share in (0.0, 0.25, 0.49, 0.81)
    for noise in ("ti", "imaging")
    for tape_m in (0.01, None)
)
_TRIALS, _SMOOTH_TRIALS, _CHUNK = 130, 40, 10
_LOW, _HIGH = 0.90, 0.99


def _flags(case: Shared, trials: list[int]) -> list[float]:
    return [float(one) for one in inside([measure_shared(case, trial) for trial in trials])]


def main() -> int:
    """Measure, print the share of each case, return 1 if that of all is outside the limits."""
    here = Path(__file__).resolve().parents[2]
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=here, check=True, capture_output=True).stdout
    first = 10_000_000 * (1 + zlib.crc32(commit))
    chunks = []
    for case in _CASES:
        trials = range(first, first := first + (_SMOOTH_TRIALS if case.smooth_share else _TRIALS))
        chunks += [(case, list(trials[at : at + _CHUNK])) for at in range(0, len(trials), _CHUNK)]
    found: dict[Shared, list[float]] = {case: [] for case in _CASES}
    for number, flags in WorkerProcesses(min(os.cpu_count() or 1, 4)).run_all(_flags, chunks):
        found[chunks[number][0]] += flags
    for case, flags in found.items():
        print(f"{case.key}: {np.nanmean(flags):.0%} of {len(flags)} inside the stated 95 % region")
    share = float(np.nanmean([one for flags in found.values() for one in flags]))
    print(f"all: {share:.1%}, to be within {_LOW:.0%} and {_HIGH:.0%}")
    return int(not _LOW <= share <= _HIGH)


if __name__ == "__main__":
    sys.exit(main())
