"""Measure rows trial by trial on an engine. Neither the number of workers nor an interruption changes a figure.

All rows advance together, so that a run that is cut has measured the same share of each.
"""

import sys
import time
from collections.abc import Sequence

from benchmarks.accuracy.keeping import Keeper
from benchmarks.accuracy.rows import Figures, Kept, Row
from cocalib.batch.engine import Engine, InProcess
from cocalib.batch.worker_processes import WorkerProcesses

_CHUNK, _APART = 4, 10_000

_Measured = list[tuple[int, Figures]]


def run(rows: Sequence[Row], keeper: Keeper, *, jobs: int, trials: int | None = None, first: int = 0) -> None:
    """Measure the trials that are not kept yet.

    Args:
        rows: what is measured.
        keeper: stores the figures.
        jobs: number of worker processes, one thread each; 1 measures in this process.
        trials: of each row; None takes the row's own number.
        first: number of the first trial; other numbers are other draws.
    """
    chunks = [(row, chunk) for row in rows for chunk in _missing(row, keeper, trials, first)]
    chunks.sort(key=lambda chunk: (chunk[1][0] - first) / (trials or chunk[0].trials))
    progress = _Progress(sum(len(chunk) for _, chunk in chunks))
    engine: Engine = InProcess() if jobs == 1 else WorkerProcesses(jobs)
    for number, measured in engine.run_all(_measure, chunks):
        row, _ = chunks[number]
        keeper.add(row.key, measured)
        progress.report(row.key, len(measured))


def kept_figures(rows: Sequence[Row], keeper: Keeper, *, trials: int | None = None, first: int = 0) -> Kept:
    """Read the kept figures in order of the trial number, from the first one up to the wanted number of trials."""
    kept = {}
    for row in rows:
        read, past = keeper.read(row.key), first + (trials or row.trials)
        kept[row.key] = tuple(read[trial] for trial in sorted(read) if first <= trial < past)
    return kept


def _missing(row: Row, keeper: Keeper, trials: int | None, first: int) -> list[list[int]]:
    kept = keeper.read(row.key)
    missing = [trial for trial in range(first, first + (trials or row.trials)) if trial not in kept]
    return [missing[i : i + _CHUNK] for i in range(0, len(missing), _CHUNK)]


def _measure(row: Row, trials: list[int]) -> _Measured:
    return [(trial, row.measure(trial + _APART * row.draws)) for trial in trials]


class _Progress:
    """Reports progress on stderr, twice a minute."""

    def __init__(self, total: int) -> None:
        self._total, self._done, self._start_s = total, 0, time.monotonic()
        self._reported_s = 0.0

    def report(self, key: str, count: int) -> None:
        self._done += count
        now_s = time.monotonic()
        if now_s - self._reported_s < 30.0 and self._done < self._total:
            return
        self._reported_s = now_s
        left_min = (now_s - self._start_s) * (self._total - self._done) / self._done / 60.0
        sys.stderr.write(f"{self._done}/{self._total} trials, about {left_min:.0f} min left ({key})\n")
        sys.stderr.flush()
