"""Diagnose the two clocks of a topic: how regular they are, which one is used, and why."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calib_core.arrays import TimesNs, Values
from calib_core.measurements import NS_PER_S, DataWarning
from calib_core.recordings.time.clock_choice import YEAR_2000_NS, Clock, Stamps, header_fault, receive_fault
from calib_core.recordings.time.written_times import span_text

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
        chosen: the clock used for its times.
        reason: why that clock was chosen.
        messages: number of messages examined.
        stamped: whether the messages have stamps; if not, everything that compares stamps is None or 0.
        zero_stamps: number of zero stamps.
        from_1970: the stamps are not dates, but count from the start of a device.
        repeated_stamps: number of stamps equal to the previous one.
        backward_stamps: number of stamps earlier than the previous one.
        worst_step_back_s: the largest such step [s].
        delay_s: median receive time minus stamp [s]; None if the receive times cannot be right.
        delay_jitter_s: median absolute deviation of that delay from its median [s].
        drift_ppm: by how much the stamps run faster than the receive times [ppm]; None for short recordings.
        drift_s: the total drift over the recording [s].
        jumps: number of sudden, lasting changes of the delay.
        largest_jump_s: the largest such change [s].
        period_s: median time between scans or images [s]; None with fewer than two.
        gaps: number of gaps longer than five periods.
        longest_gap_s: longest time between consecutive scans or images [s].
        islands: number of stretches of data separated by pauses of more than ten seconds.
        covered_s: total length of those stretches [s].
        one_per_return: every message is a single radar return with its own stamp.
        times_from: where the times of files come from, after "times are"; "" if messages state them.
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
    times_from: str = ""

    @property
    def is_assumed(self) -> bool:
        """Whether nothing states the times, so that nothing can be said of the clock."""
        return self.times_from.startswith("assumed")

    @property
    def remarks(self) -> tuple[str, ...]:
        """Notable observations as text; empty if there are none."""
        if self.is_assumed:
            return ()
        found = [
            (self.zero_stamps > 0, f"{self.zero_stamps} of {self.messages} stamps are zero"),
            (self.from_1970, "the stamps count from the start of a device, not from 1970"),
            (self.one_per_return, "one message per return: stamps differ within a scan"),
            (
                self.repeated_stamps > 0 and not self.one_per_return,
                f"{_count(self.repeated_stamps, 'stamp repeats', 'stamps repeat')} the previous one",
            ),
            (
                self.backward_stamps > 0,
                f"{_count(self.backward_stamps, 'stamp goes', 'stamps go')} backwards, by up to {self.worst_step_back_s:.3f} s",
            ),
            (
                self.jumps > 0,
                f"the delay jumps {_count(self.jumps, 'time', 'times')} by up to {span_text(self.largest_jump_s)}",
            ),
            (self._drifts, f"the stamps drift by {self.drift_s * 1e3:.0f} ms ({self.drift_ppm or 0:.0f} ppm)"),
            (self.islands > 1, f"{self.islands} separate stretches of data, {span_text(self.covered_s)} in total"),
            (self.gaps > 0, f"{_count(self.gaps, 'gap', 'gaps')}, the longest {span_text(self.longest_gap_s)}"),
        ]
        return tuple(text for there, text in found if there)

    @property
    def _drifts(self) -> bool:
        return self.drift_ppm is not None and abs(self.drift_s) > _DRIFT_S


def _count(count: int, one: str, many: str) -> str:
    return f"{count} {one if count == 1 else many}"


def diagnose(
    stamps: Stamps,
    *,
    times_ns: TimesNs,
    chosen: Literal["header", "receive"],
    requested: Clock,
    one_per_return: bool = False,
    times_from: str = "",
) -> ClockDiagnosis:
    """Diagnose both clocks of a topic.

    Args:
        stamps: both clocks, message by message in the order received.
        times_ns: (k,) the times of scans or images in use, ascending.
        chosen: the clock of those times.
        requested: the clock the user asked for.
        one_per_return: every message is a single radar return.
        times_from: where the times of files come from; "" for messages.
    """
    diagnosis = ClockDiagnosis(
        stamps.topic,
        chosen,
        _reason(stamps, chosen, requested),
        len(stamps.receive_ns),
        stamps.header_ns is not None,
        one_per_return=one_per_return,
        times_from=times_from,
    )
    diagnosis = _with_rhythm(diagnosis, times_ns)
    if stamps.header_ns is None or not len(stamps.header_ns):
        return diagnosis
    diagnosis = _with_order(diagnosis, stamps.header_ns)
    if receive_fault(stamps) is not None:
        return diagnosis
    diagnosis = _with_delay(diagnosis, stamps.header_ns, stamps.receive_ns)
    if chosen == "header" and requested == "auto" and (diagnosis.jumps or diagnosis._drifts):
        return replace(
            diagnosis, reason="the stamps are in order, although they jump or drift relative to the receive times"
        )
    return diagnosis


def _reason(stamps: Stamps, chosen: str, requested: Clock) -> str:
    if requested != "auto":
        return f"--clock {requested} was given"
    fault, received = header_fault(stamps), receive_fault(stamps)
    if chosen == "header" and received is not None:
        return f"{received}, and the stamps {'are sound' if fault is None else 'have more different times'}"
    if chosen == "header":
        return (
            "the stamps are sound" if fault is None else "the stamps are not dates, but both sensors use the same clock"
        )
    return f"it {fault}" if fault else "its stamps cannot be compared with the other sensor's"


def between_islands(steps_s: Values) -> np.ndarray:
    """Return which time steps (n,) [s] are long pauses that separate stretches of data (islands)."""
    return steps_s > max(_ISLAND_S, _GAP_PERIODS * float(np.median(steps_s)))


def _with_rhythm(diagnosis: ClockDiagnosis, times_ns: TimesNs) -> ClockDiagnosis:
    if len(times_ns) < 2:
        return diagnosis
    steps_s = np.diff(times_ns) / NS_PER_S
    period_s = float(np.median(steps_s))
    apart = between_islands(steps_s)
    return replace(
        diagnosis,
        period_s=period_s,
        gaps=int(np.count_nonzero(steps_s > _GAP_PERIODS * period_s)) if period_s > 0 else 0,
        longest_gap_s=float(steps_s.max()),
        islands=1 + int(np.count_nonzero(apart)),
        covered_s=float(steps_s[~apart].sum()),
    )


def _with_order(diagnosis: ClockDiagnosis, header_ns: TimesNs) -> ClockDiagnosis:
    dated = header_ns[header_ns != 0]
    steps_ns = np.diff(dated)
    return replace(
        diagnosis,
        zero_stamps=len(header_ns) - len(dated),
        from_1970=bool(len(dated)) and bool(np.median(dated) < YEAR_2000_NS),
        repeated_stamps=int(np.count_nonzero(steps_ns == 0)),
        backward_stamps=int(np.count_nonzero(steps_ns < 0)),
        worst_step_back_s=max(0.0, -float(steps_ns.min(initial=0)) / NS_PER_S),
    )


def _with_delay(found: ClockDiagnosis, header_ns: TimesNs, receive_ns: TimesNs) -> ClockDiagnosis:
    """Compare both clocks: median delay, sudden changes, and the drift that remains without them."""
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
    delays_s = np.median(lag_s[: blocks * _WINDOW].reshape(blocks, _WINDOW), axis=1)
    steps_s = np.diff(delays_s)
    jumped = np.abs(steps_s) > _JUMP_S
    starts = jumped & ~np.concatenate([[False], jumped[:-1]])
    delays_s = delays_s - np.concatenate([[0.0], np.cumsum(np.where(jumped, steps_s, 0.0))])
    at_s = received_s[: blocks * _WINDOW].reshape(blocks, _WINDOW).mean(axis=1)
    span_s = float(at_s[-1] - at_s[0])
    if span_s > 0:
        slope = float(np.polyfit((at_s - at_s[0]) / span_s, delays_s, 1)[0]) / span_s
        found = replace(found, drift_ppm=-slope * 1e6, drift_s=-slope * span_s)
    return replace(
        found, jumps=int(np.count_nonzero(starts)), largest_jump_s=float(np.abs(steps_s[jumped]).max(initial=0.0))
    )


def clock_warnings(diagnosises: Sequence[ClockDiagnosis]) -> list[DataWarning]:
    """Warn about clock problems that can degrade a calibration."""
    warnings = []
    for clock in diagnosises:
        by_stamps = clock.chosen == "header"
        if by_stamps and clock.jumps:
            warnings.append(
                DataWarning.reported(
                    "clock-jumps",
                    f"the stamps of {clock.topic} jump relative to the receive times, {_count(clock.jumps, 'time', 'times')} "
                    f"and by up to {span_text(clock.largest_jump_s)}: its clock was set during the recording, or the driver hung",
                    "compare with --clock receive, and keep only the clicks before or after the jump",
                )
            )
        if by_stamps and abs(clock.drift_s) > _DRIFT_S:
            warnings.append(
                DataWarning.reported(
                    "clock-drift",
                    f"the stamps of {clock.topic} drift relative to the receive times by {abs(clock.drift_s) * 1e3:.0f} ms in "
                    f"total ({abs(clock.drift_ppm or 0):.0f} ppm): its clock is not synchronised with the recorder's",
                    "synchronise the clocks of both sensors (PTP or NTP), or use --clock receive",
                )
            )
    apart = [one for one in diagnosises if one.islands > 1 and not one.is_assumed]
    if apart:
        listed = "; ".join(
            f"{one.topic} has {one.islands} stretches of data separated by up to {span_text(one.longest_gap_s)}: "
            f"{span_text(one.covered_s)} of data in total"
            for one in apart
        )
        if len(apart) > 1 and len({one.islands for one in apart}) == 1:
            listed = (
                f"{' and '.join(one.topic for one in apart)} have {apart[0].islands} stretches of data each, separated by up to "
                f"{span_text(max(one.longest_gap_s for one in apart))}"
            )
        hint = (
            "click only where both sensors have data; bags of one placement each are right; if there should be no "
            "gaps, files may be missing"
        )
        warnings.append(DataWarning.reported("islands", listed, hint))
    return warnings
