"""Times for the frames of a TI data-port stream, which carries none: from frame numbers, cycles and the user's start."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.plain_files.ti_packets import Packet
from calib_core.recordings.time.written_times import read_time
from calib_core.results import DataWarning

_CYCLES_PER_S = 200e6
_WRAP = 1 << 32
_DEFAULT_PERIOD_S = 0.1
_PERIODS_S = (0.005, 5.0)
_UNSTEADY = 0.2
_MAX_TABLE_BYTES = 1 << 26


@dataclass(frozen=True, slots=True, eq=False)
class StampedPackets:
    """The packets with a time.

    Attributes:
        rows: (n,) which packets they are.
        times_ns: (n,) ascending.
        clock: where the times come from, in words.
        warnings: what the user must know about the times.
        assumptions: what the stream does not state.
    """

    rows: Indices
    times_ns: TimesNs
    clock: str
    warnings: tuple[DataWarning, ...] = ()
    assumptions: tuple[Assumption, ...] = field(default=())


def stamp_packets(path: Path, packets: Sequence[Packet], start: str | None, topic: str) -> StampedPackets:
    """Give each packet a time.

    Args:
        path: the stream; NAME.csv or NAME.txt beside it may list one time per packet.
        packets: in the order sent.
        start: --radar-start: the time of the first frame, and after a comma the time between frames [s].
        topic: of the radar, for the assumptions.

    Raises:
        RecordingError: --radar-start or the list of times is wrong.
    """
    if start is None and (listed := _listed(path, len(packets))) is not None:
        order = np.argsort(listed, kind="stable")
        return StampedPackets(order, listed[order], f"times of {_table(path).name}")
    begin_ns, given_s = _start(start)
    frames, restarts = _frame_counts(packets)
    period_s = given_s if given_s is not None else _period_of_cycles(packets, frames)
    seconds = period_s if period_s is not None else _DEFAULT_PERIOD_S
    times = begin_ns + np.round(frames * (seconds * NS_PER_S)).astype(np.int64)
    assumptions = []
    if start is None:
        text = "the stream has no dates; its first frame is read as 1 s after the beginning of 1970"
        assumptions.append(Assumption("time-start", topic, text, "--radar-start TIME"))
    if given_s is None:
        assumptions.append(
            Assumption("time-unit", topic, _about_period(period_s), "--radar-start TIME,SECONDS_PER_FRAME")
        )
    return StampedPackets(
        np.arange(len(packets)),
        times,
        f"{seconds:.4g} s per frame",
        _about_restarts(path, restarts),
        tuple(assumptions),
    )


def _about_period(period_s: float | None) -> str:
    if period_s is None:
        return f"its processor cycles are not steady; {_DEFAULT_PERIOD_S} s per frame are assumed"
    return (
        f"it counts processor cycles, read as 200 MHz of the Cortex-R4F: {period_s:.4g} s per frame; at the 600 MHz of the DSP, "
        f"which older demos counted, it would be {period_s / 3:.4g} s"
    )


def _about_restarts(path: Path, restarts: int) -> tuple[DataWarning, ...]:
    if not restarts:
        return ()
    return (
        DataWarning(
            "sensor-restarted",
            f"{path.name}: the frame numbers begin again {restarts} times: the sensor was restarted, and the pause is unknown",
            "open the parts one by one, each with its own --radar-start",
        ),
    )


def _start(start: str | None) -> tuple[int, float | None]:
    """Read --radar-start."""
    if start is None:
        return NS_PER_S, None
    time, _, period = start.partition(",")
    try:
        seconds = float(period) if period else None
        if seconds is not None and not 0 < seconds < 1000:
            raise RecordingError(f"'{period}' is not a time between frames; give seconds, such as 0.05")
        return int(read_time(time)), seconds
    except ValueError as error:
        raise RecordingError(f"--radar-start: '{period}' is not a number of seconds, such as 0.05") from error
    except RecordingError as error:
        raise RecordingError(f"--radar-start: {error}") from error


def _frame_counts(packets: Sequence[Packet]) -> tuple[np.ndarray, int]:
    """Count frames from the first one, and how often the sensor was restarted; a restart counts as one frame."""
    numbers = np.array([packet.frame for packet in packets], dtype=np.int64)
    steps = np.diff(numbers)
    restarted = steps < 0
    counts = np.concatenate([[0], np.cumsum(np.where(restarted, 1, steps))])
    return counts, int(np.count_nonzero(restarted))


def _period_of_cycles(packets: Sequence[Packet], frames: np.ndarray) -> float | None:
    """Measure the time between frames by the processor's cycles, which begin again after 2 ** 32; None if they are not steady."""
    cycles = np.array([packet.cycles for packet in packets], dtype=np.int64)
    steps, passed = np.diff(frames), np.diff(cycles) % _WRAP
    single = passed[steps == 1]
    if not len(single):
        return None
    middle = float(np.median(single))
    if np.median(np.abs(single - middle)) > _UNSTEADY * middle:
        return None
    wraps = np.round((steps * middle - passed) / _WRAP)
    whole = passed + np.maximum(wraps, 0) * _WRAP
    steady = (steps > 0) & (np.abs(whole - steps * middle) < _UNSTEADY * middle * np.maximum(steps, 1))
    if not steady.any():
        return None
    period_s = float(whole[steady].sum() / steps[steady].sum() / _CYCLES_PER_S)
    return period_s if _PERIODS_S[0] <= period_s <= _PERIODS_S[1] else None


def _table(path: Path) -> Path:
    """Return the list of times beside a stream."""
    name = path.name if path.is_dir() else path.stem
    beside = [path.parent / f"{name}{suffix}" for suffix in (".csv", ".txt")]
    return next((table for table in beside if table.is_file()), beside[0])


def _listed(path: Path, count: int) -> TimesNs | None:
    """Read one time per packet from a table beside the stream; None if there is none.

    Raises:
        RecordingError: it has another number of lines, or something other than times.
    """
    table = _table(path)
    if not table.is_file() or table.stat().st_size > _MAX_TABLE_BYTES:
        return None
    lines = [line.strip() for line in table.read_text(encoding="utf-8-sig", errors="replace").splitlines()]
    lines = [line for line in lines if line and not re.match(r"[#A-Za-z]", line)]
    if len(lines) != count:
        raise RecordingError(
            f"{table}: {len(lines)} times for the {count} packets of {path.name}; give one line per packet, or --radar-start"
        )
    try:
        return np.array([read_time(re.split(r"[,;\s]+", line)[-1]) for line in lines], dtype=np.int64)
    except RecordingError as error:
        raise RecordingError(f"{table}: {error}") from error
