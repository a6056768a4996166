"""How long a full robust solve takes, beside the paper's Algorithm 1 on the same pairs."""

import dataclasses
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks.speed.rows import Row, Table
from calib_core.calibrate import calibrate_pairs
from calib_core.options import CalibrationOptions, PaperOptions
from calib_core.synthetic import simulate_pairs

__all__ = ["measure_solving"]

_AIMS_MS = {20: 30.0, 100: None, 1000: 250.0}
_REPEATS = {20: 15, 100: 9, 1000: 5}


def measure_solving() -> Table:
    """Solve the same simulated pairs by both methods, 10 % of them wrong; medians."""
    rows = []
    for count, aim_ms in _AIMS_MS.items():
        simulated = simulate_pairs(count, rng=np.random.default_rng(count), noise="ti", outlier_share=0.1)
        default = CalibrationOptions()
        paper = dataclasses.replace(default, method="paper", paper=PaperOptions(ransac_threshold_px=50.0))
        ours_ms, paper_ms = (
            _median_ms(partial(calibrate_pairs, simulated.pairs, simulated.camera, options), _REPEATS[count])
            for options in (default, paper)
        )
        rows.append(
            Row(
                f"{count} pairs, default",
                f"{ours_ms:.1f} ms",
                f"{ours_ms / paper_ms:.1f} x Algorithm 1",
                f"under {aim_ms:.0f} ms" if aim_ms else "",
                aim_ms is None or ours_ms < aim_ms,
            )
        )
        rows.append(Row(f"{count} pairs, Algorithm 1 (threshold 50 px)", f"{paper_ms:.1f} ms"))
    return Table(
        "Solving", "Simulated pairs of a TI-like radar in a field, 10 % of them wrong, one core; medians.", tuple(rows)
    )


def _median_ms(work: Callable[[], object], repeats: int) -> float:
    work()
    times_s = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times_s.append(time.perf_counter() - start)
    return float(np.median(times_s)) * 1000
