"""Measure rows trial by trial in several processes. Neither their number nor an interruption changes a figure."""

import os
import signal
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from multiprocessing import get_context, parent_process

from benchmarks.accuracy.keeping import Keeper
from benchmarks.accuracy.rows import Figures, Kept, Row

__all__ = ["kept_figures", "run"]

_CHUNK = 10
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

_Measured = list[tuple[int, Figures]]


def run(rows: Sequence[Row], keeper: Keeper, *, jobs: int, most: int | None = None, first: int = 0) -> None:
    """Measure the trials that are not kept yet.

    Args:
        rows: in the order in which they are measured.
        keeper: stores the figures.
        jobs: number of processes, one BLAS thread each; 1 measures in this process.
        most: largest number of trials per row.
        first: number of the first trial; other numbers are other draws.
    """
    chunks = [(row, chunk) for row in rows for chunk in _missing(row, keeper, most, first)]
    progress = _Progress(sum(len(chunk) for _, chunk in chunks))
    if jobs == 1:
        for row, chunk in chunks:
            keeper.add(row.key, _measure(row, chunk))
            progress.report(row.key, len(chunk))
        return
    os.environ.update(dict.fromkeys(_THREADS, "1"))  # before the children load NumPy
    pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_begin)
    try:
        running: dict[Future[_Measured], Row] = {pool.submit(_measure, row, chunk): row for row, chunk in chunks}
        for done in as_completed(running):
            row, measured = running[done], done.result()
            keeper.add(row.key, measured)
            progress.report(row.key, len(measured))
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def kept_figures(rows: Sequence[Row], keeper: Keeper, *, most: int | None = None, first: int = 0) -> Kept:
    """Read the kept figures in order of the trial number, from the first one up to the wanted number of trials."""
    kept = {}
    for row in rows:
        trials = keeper.read(row.key)
        kept[row.key] = tuple(trials[trial] for trial in sorted(trials) if first <= trial < first + _wanted(row, most))
    return kept


def _wanted(row: Row, most: int | None) -> int:
    return row.trials if most is None else min(row.trials, most)


def _missing(row: Row, keeper: Keeper, most: int | None, first: int) -> list[list[int]]:
    kept = keeper.read(row.key)
    missing = [trial for trial in range(first, first + _wanted(row, most)) if trial not in kept]
    return [missing[i : i + _CHUNK] for i in range(0, len(missing), _CHUNK)]


def _measure(row: Row, trials: list[int]) -> _Measured:
    return [(trial, row.measure(trial)) for trial in trials]


def _begin() -> None:
    """Prepare a child process: one thread, and exit when the parent ends, for whatever reason."""
    import cv2

    cv2.setNumThreads(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


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
