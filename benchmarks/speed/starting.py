"""How long imports and commands take to start."""

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.speed.rows import Row, Table, median_ms

__all__ = ["as_installed", "measure_starting"]

_REPEATS = 7
_AIM_RATIO = 2.0
_AIM_MS = 300.0


def measure_starting(sample: Path) -> Table:
    """Start fresh processes, and compare them with importing NumPy alone."""
    bags = [str(sample / "radar.bag"), str(sample / "camera.bag")]
    command = [str(Path(sys.executable).with_name("cocalib"))]
    python = [sys.executable, "-c"]
    jobs = {
        "`import numpy`": [*python, "import numpy"],
        "`import calib_core.calibration`": [*python, "import calib_core.calibration"],
        "`cocalib --version`": [*command, "--version"],
        "`cocalib --help`": [*command, "--help"],
        "`cocalib info --help`": [*command, "info", "--help"],
        "`cocalib info` on the sample": [*command, "info", *bags],
        "`cocalib solve` on the sample, 20 clicks": [*command, "solve", *bags, "--clicks", str(sample / "clicks.json")],
    }
    with tempfile.TemporaryDirectory() as bytecode:
        environment = as_installed(Path(bytecode))  # the first round writes the bytecode
        rounds = [{name: _processor_s(job, environment) for name, job in jobs.items()} for _ in range(_REPEATS + 1)][1:]
    times_ms = {name: [1000 * times[name] for times in rounds] for name in jobs}
    base_ms = float(np.median(times_ms["`import numpy`"]))
    rows = tuple(_row(name, values_ms, base_ms) for name, values_ms in times_ms.items())
    how = f"A fresh process each time, in turn, {_REPEATS} rounds; time of the processor, user and system."
    return Table("Starting", how, rows)


def _row(name: str, values_ms: Sequence[float], base_ms: float) -> Row:
    median = float(np.median(values_ms))
    return Row(name, median_ms(values_ms), f"{median / base_ms:.1f} x NumPy's import", *_aim(name, median, base_ms))


def as_installed(bytecode: Path) -> dict[str, str]:
    """Return the environment with bytecode kept in a folder, as any installation keeps it, whatever this shell says about it."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    return environment | {"PYTHONPYCACHEPREFIX": str(bytecode)}


def _aim(name: str, value_ms: float, base_ms: float) -> tuple[str, bool]:
    if "calib_core" in name:
        return f"at most {_AIM_RATIO:g} x", value_ms <= _AIM_RATIO * base_ms
    if name in ("`cocalib --version`", "`cocalib --help`"):
        return f"under {_AIM_MS:.0f} ms", value_ms < _AIM_MS
    return "", True


def _processor_s(job: list[str], environment: dict[str, str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(job, check=True, capture_output=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
