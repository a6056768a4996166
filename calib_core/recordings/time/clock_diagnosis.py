"""How good the two clocks of a topic are, and which one is used and why."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calib_core.arrays import TimesNs, Values
from calib_core.measurements import NS_PER_S
from calib_core.recordings.time.clocks import Clock, Stamps, header_fault
from calib_core.recordings.time.dates import span_text
from calib_core.results import DataWarning

__all__ = ["ClockDiagnosis", "about_clocks", "between_islands", "diagnose"]

_YEAR_2000_NS = 946_684_800 * NS_PER_S
_GAP_PERIODS = 5.0
_ISLAND_S = 10.0
_JUMP_S = 0.25
_WINDOW = 11
_DRIFT_S = 0.05


@dataclass(frozen=True, slots=True)
class ClockDiagnosis:
    """What is known about the clocks of one topic.

    Attributes:
        topic: its name.
        chosen: the clock its times are by.
        reason: why, in words.
        messages: how many were looked at.
        stamped: the messages carry stamps; without them all that compares stamps is None or 0.
        zero_stamps: stamps that are zero.
        from_1970: the stamps are no dates, but count from the start of a device.
        repeated_stamps: stamps that are the same as the one before.
        backward_stamps: stamps before the one before.
        worst_step_back_s: the largest of those steps [s].
        delay_s: by how much receiving usually lags the stamp [s].
        delay_jitter_s: median deviation of that from its median [s].
        drift_ppm: by how much the stamps run fast against receiving, in millionths; None for short recordings.
        drift_s: what that comes to from beginning to end [s].
        jumps: how often the delay changes suddenly and stays.
        largest_jump_s: by how much at most [s].
        period_s: usual time between scans or images [s]; None with fewer than two.
        gaps: times between neighbours longer than five periods.
        longest_gap_s: the longest time between neighbours [s].
        islands: stretches of data with more than ten seconds of nothing between them.
        covered_s: how long those stretches are together [s].
        one_per_return: every message is a single radar return, with a stamp of its own.
    """

    topic: str
    chosen: Literal["header", "receive"]
    reason: str
    messages: int
    stamped: bool
    zero_stamps: int = 0
    from_1970: bool = False
    repeated_stamps: int = 0
    backward_stamps: int = 0
    worst_step_back_s: float = 0.0
    delay_s: float | None = None
    delay_jitter_s: float | None = None
    drift_ppm: float | None = None
    drift_s: float = 0.0
    jumps: int = 0
    largest_jump_s: float = 0.0
    period_s: float | None = None
    gaps: int = 0
    longest_gap_s: float = 0.0
    islands: int = 0
    covered_s: float = 0.0
    one_per_return: bool = False

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is worth knowing, in words; empty where all is as it should be."""
        found = [
            (self.zero_stamps > 0, f"{self.zero_stamps} of {self.messages} stamps are zero"),
            (self.from_1970, "the stamps count from the start of a device, not from 1970"),
            (self.one_per_return, "one message per return: the stamps within a scan differ"),
            (
                self.repeated_stamps > 0 and not self.one_per_return,
                f"{_counted(self.repeated_stamps, 'stamp repeats', 'stamps repeat')} the one before",
            ),
            (
                self.backward_stamps > 0,
                f"{_counted(self.backward_stamps, 'stamp goes', 'stamps go')} back, by up to {self.worst_step_back_s:.3f} s",
            ),
            (
                self.jumps > 0,
                f"the delay jumps {_counted(self.jumps, 'time', 'times')}, by up to {span_text(self.largest_jump_s)}",
            ),
            (self._drifts, f"the stamps drift by {self.drift_s * 1e3:.0f} ms ({self.drift_ppm or 0:.0f} ppm)"),
            (self.islands > 1, f"{self.islands} stretches of data, {span_text(self.covered_s)} in all"),
            (self.gaps > 0, f"{_counted(self.gaps, 'gap', 'gaps')}, the longest {span_text(self.longest_gap_s)}"),
        ]
        return tuple(text for there, text in found if there)

    @property
    def _drifts(self) -> bool:
        return self.drift_ppm is not None and abs(self.drift_s) > _DRIFT_S


def _counted(count: int, one: str, many: str) -> str:
    return f"{count} {one if count == 1 else many}"


def diagnose(
    stamps: Stamps,
    *,
    times_ns: TimesNs,
    chosen: Literal["header", "receive"],
    wish: Clock,
    one_per_return: bool = False,
) -> ClockDiagnosis:
    """Look at both clocks of a topic.

    Args:
        stamps: both clocks, message by message in the order received.
        times_ns: (k,) the times in use, of scans or images, ascending.
        chosen: the clock those are by.
        wish: the clock a person asked for.
        one_per_return: every message is a single radar return.
    """
    found = ClockDiagnosis(
        stamps.topic,
        chosen,
        _reason(stamps, chosen, wish),
        len(stamps.receive_ns),
        stamps.header_ns is not None,
        one_per_return=one_per_return,
    )
    found = _with_rhythm(found, times_ns)
    if stamps.header_ns is None or not len(stamps.header_ns):
        return found
    found = _with_delay(_with_order(found, stamps.header_ns), stamps.header_ns, stamps.receive_ns)
    if chosen == "header" and wish == "auto" and (found.jumps or found._drifts):
        return replace(found, reason="the stamps are dates in order, although they do not keep step with receiving")
    return found


def _reason(stamps: Stamps, chosen: str, wish: Clock) -> str:
    if wish != "auto":
        return f"it was asked for with --clock {wish}"
    fault = header_fault(stamps)
    if chosen == "header":
        return (
            "the stamps are sound" if fault is None else "the stamps are no dates, but both sensors have the same clock"
        )
    return f"it {fault}" if fault else "its stamps and the other sensor's cannot be compared"


def between_islands(steps_s: Values) -> np.ndarray:
    """Tell which steps in time (n,) [s] are pauses that part the data into islands."""
    return steps_s > max(_ISLAND_S, _GAP_PERIODS * float(np.median(steps_s)))


def _with_rhythm(found: ClockDiagnosis, times_ns: TimesNs) -> ClockDiagnosis:
    if len(times_ns) < 2:
        return found
    steps_s = np.diff(times_ns) / NS_PER_S
    period_s = float(np.median(steps_s))
    apart = between_islands(steps_s)
    return replace(
        found,
        period_s=period_s,
        gaps=int(np.count_nonzero(steps_s > _GAP_PERIODS * period_s)) if period_s > 0 else 0,
        longest_gap_s=float(steps_s.max()),
        islands=1 + int(np.count_nonzero(apart)),
        covered_s=float(steps_s[~apart].sum()),
    )


def _with_order(found: ClockDiagnosis, header_ns: TimesNs) -> ClockDiagnosis:
    dated = header_ns[header_ns != 0]
    steps_ns = np.diff(dated)
    return replace(
        found,
        zero_stamps=len(header_ns) - len(dated),
        from_1970=bool(len(dated)) and bool(np.median(dated) < _YEAR_2000_NS),
        repeated_stamps=int(np.count_nonzero(steps_ns == 0)),
        backward_stamps=int(np.count_nonzero(steps_ns < 0)),
        worst_step_back_s=max(0.0, -float(steps_ns.min(initial=0)) / NS_PER_S),
    )


def _with_delay(found: ClockDiagnosis, header_ns: TimesNs, receive_ns: TimesNs) -> ClockDiagnosis:
    """Compare both clocks: usual delay, sudden changes, and drift of what is left without them."""
    dated = header_ns != 0
    if not dated.any():
        return found
    received_s = (receive_ns[dated] - receive_ns[dated][0]) / NS_PER_S
    lag_ns = receive_ns[dated] - header_ns[dated]
    middle_ns = int(np.median(lag_ns))
    lag_s = (lag_ns - middle_ns) / NS_PER_S
    found = replace(found, delay_s=middle_ns / NS_PER_S, delay_jitter_s=float(np.median(np.abs(lag_s))))
    if len(lag_s) < 4 * _WINDOW:
        return found
    blocks = len(lag_s) // _WINDOW
    calm_s = np.median(lag_s[: blocks * _WINDOW].reshape(blocks, _WINDOW), axis=1)
    steps_s = np.diff(calm_s)
    jumped = np.abs(steps_s) > _JUMP_S
    starts = jumped & ~np.concatenate([[False], jumped[:-1]])
    calm_s = calm_s - np.concatenate([[0.0], np.cumsum(np.where(jumped, steps_s, 0.0))])
    at_s = received_s[: blocks * _WINDOW].reshape(blocks, _WINDOW).mean(axis=1)
    span_s = float(at_s[-1] - at_s[0])
    if span_s > 0:
        slope = float(np.polyfit((at_s - at_s[0]) / span_s, calm_s, 1)[0]) / span_s
        found = replace(found, drift_ppm=-slope * 1e6, drift_s=-slope * span_s)
    return replace(
        found, jumps=int(np.count_nonzero(starts)), largest_jump_s=float(np.abs(steps_s[jumped]).max(initial=0.0))
    )


def about_clocks(found: Sequence[ClockDiagnosis]) -> list[DataWarning]:
    """Say what in the clocks can spoil a calibration."""
    warnings = []
    for one in found:
        by_stamps = one.chosen == "header"
        if by_stamps and one.jumps:
            warnings.append(
                DataWarning(
                    "clock-jumps",
                    f"the stamps of {one.topic} jump against receive time, {_counted(one.jumps, 'time', 'times')} and by up to "
                    f"{span_text(one.largest_jump_s)}: its clock was set during the recording, or the driver hung",
                    "compare with --clock receive, and keep only clicks from one side of a jump",
                )
            )
        if by_stamps and abs(one.drift_s) > _DRIFT_S:
            warnings.append(
                DataWarning(
                    "clock-drift",
                    f"the stamps of {one.topic} drift against receive time by {abs(one.drift_s) * 1e3:.0f} ms in all "
                    f"({abs(one.drift_ppm or 0):.0f} ppm): its clock is not kept in step with the recorder's",
                    "use one clock for both sensors (PTP or NTP), or --clock receive",
                )
            )
        if one.islands > 1:
            warnings.append(
                DataWarning(
                    "islands",
                    f"{one.topic} comes in {one.islands} stretches with up to {span_text(one.longest_gap_s)} of nothing between "
                    f"them: {span_text(one.covered_s)} of data in all",
                    "click only where both sensors have data; if the stretches should be one, files may be missing",
                )
            )
    return warnings
