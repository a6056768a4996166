"""The rows and tables of docs/speed.md, and the earlier versions that some compare with."""

import os
import platform
import subprocess
import tarfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from io import BytesIO
from pathlib import Path

import numpy as np

__all__ = ["Row", "Table", "earlier_version", "median_ms", "page", "section"]

_ROOT = Path(__file__).resolve().parents[2]


def earlier_version(commit: str, scratch: Path) -> Path:
    """Unpack the tree of a commit into a folder of its own, and return that."""
    archive = subprocess.run(["git", "-C", str(_ROOT), "archive", commit], check=True, capture_output=True).stdout
    with tarfile.open(fileobj=BytesIO(archive)) as files:
        files.extractall(scratch / commit, filter="data")
    return scratch / commit


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a table.

    Attributes:
        what: what was measured.
        figure: the measured value as text, with its unit; a row without one is left out.
        ratio: compared with another measurement in the same run; "" if there is none.
        aim: the value to reach; "" if there is none.
        met: whether the aim is met.
    """

    what: str
    figure: str
    ratio: str = ""
    aim: str = ""
    met: bool = True


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under one heading, and how they were measured."""

    title: str
    how: str
    rows: tuple[Row, ...]


def page(tables: Sequence[Table], *, command: str) -> str:
    """Return the page in Markdown, with the command that measured it."""
    lines = [
        "# Speed",
        "",
        f"Written by `{command}`. Machine: {_machine()}.",
        "Medians, 95th percentiles in parentheses.",
    ]
    for table in tables:
        lines += ["", *section(table)]
    return "\n".join(lines) + "\n"


def section(table: Table) -> list[str]:
    """Return one table in Markdown, under its heading, with the commit that it was measured at."""
    show = ["git", "show", "-s", "--format=%h, %as", "HEAD"]
    commit = subprocess.run(show, cwd=Path(__file__).parent, check=True, capture_output=True, text=True).stdout.strip()
    head = [f"## {table.title}", "", f"{table.how} Measured at {commit}.", ""]
    rows = [f"| {row.what} | {row.figure} | {row.ratio} | {_aim(row)} |" for row in table.rows if row.figure]
    return [*head, "| what | measured | compared | aim |", "|---|---|---|---|", *rows]


def median_ms(times_ms: Sequence[float]) -> str:
    """Return the median and the 95th percentile as text."""
    return f"{np.median(times_ms):.0f} ms ({np.percentile(times_ms, 95):.0f} ms)"


def _aim(row: Row) -> str:
    return f"{row.aim}: {'met' if row.met else '**missed**'}" if row.aim else ""


def _machine() -> str:
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        named = [
            line.partition(":")[2].strip() for line in cpuinfo.read_text().splitlines() if line.startswith("model name")
        ]
        model = named[0] if named else model
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return (
        f"{model}, {cores} cores, no GPU (WebGL in software), {platform.system()}, Python {platform.python_version()}, "
        f"NumPy {version('numpy')}, OpenCV {version('opencv-python-headless')}, viser {version('viser')}"
    )
