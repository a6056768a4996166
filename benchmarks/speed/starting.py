"""How long imports and commands take to start."""

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.speed.rows import Row, Table

__all__ = ["as_installed", "measure_starting"]

_REPEATS = 7
_AIM_RATIO = 2.0
_AIM_S = 0.3


def measure_starting(sample: Path) -> Table:
    """Start fresh processes; the best of each is compared with importing NumPy alone."""
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
    seconds = {name: min(times[name] for times in rounds) for name in jobs}
    base_s = seconds["`import numpy`"]
    rows = tuple(
        Row(name, f"{value_s * 1000:.0f} ms", f"{value_s / base_s:.1f} x NumPy's import", *_aim(name, value_s, base_s))
        for name, value_s in seconds.items()
    )
    how = f"A fresh process each time, in turn; time of the processor, user and system, the least of {_REPEATS}."
    return Table("Starting", how, rows)


def as_installed(bytecode: Path) -> dict[str, str]:
    """Return the environment with bytecode kept in a folder, as any installation keeps it, whatever this shell says about it."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    return environment | {"PYTHONPYCACHEPREFIX": str(bytecode)}


def _aim(name: str, value_s: float, base_s: float) -> tuple[str, bool]:
    if "calib_core" in name:
        return f"at most {_AIM_RATIO:g} x", value_s <= _AIM_RATIO * base_s
    if name in ("`cocalib --version`", "`cocalib --help`"):
        return f"under {_AIM_S * 1000:.0f} ms", value_s < _AIM_S
    return "", True


def _processor_s(job: list[str], environment: dict[str, str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(job, check=True, capture_output=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
