"""How long imports and commands take to start."""

import statistics
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.speed.rows import Row, Table

__all__ = ["measure_starting"]

_REPEATS = 5


def measure_starting(sample: Path) -> Table:
    """Start fresh processes; the best of each is compared with importing NumPy alone."""
    bags = [str(sample / "radar.bag"), str(sample / "camera.bag")]
    command = [str(Path(sys.executable).with_name("cocalib"))]
    python = [sys.executable, "-c"]
    jobs = {
        "`import numpy`": [*python, "import numpy"],
        "`import calib_core.calibration`": [*python, "import calib_core.calibration"],
        "`cocalib --version`": [*command, "--version"],
        "`cocalib info` on the sample": [*command, "info", *bags],
        "`cocalib solve` on the sample, 20 clicks": [*command, "solve", *bags, "--clicks", str(sample / "clicks.json")],
    }
    seconds = {name: _median_s(job) for name, job in jobs.items()}
    base = seconds["`import numpy`"]
    rows = tuple(
        Row(name, f"{value * 1000:.0f} ms", f"{value / base:.1f} x NumPy's import", *_aim(name, value / base))
        for name, value in seconds.items()
    )
    return Table("Starting", f"A fresh process each time, medians of {_REPEATS}.", rows)


def _aim(name: str, ratio: float) -> tuple[str, bool]:
    return ("at most 2 x", ratio <= 2.0) if "calib_core" in name else ("", True)


def _median_s(job: list[str]) -> float:
    times_s = []
    for _ in range(_REPEATS):
        start = time.perf_counter()
        subprocess.run(job, check=True, capture_output=True)
        times_s.append(time.perf_counter() - start)
    return statistics.median(times_s)
