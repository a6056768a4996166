"""Choose between the two clocks of a recording: the stamps in the messages and the recorder's receive times.

Header stamps are the time of measurement and the default. Receive times are used if the stamps cannot be right; the
other sensor must then not silently stay on a different clock. Receive times that cannot be right themselves are used
only where the stamps are worse.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.measurements import NS_PER_S, DataWarning
from calib_core.recordings.time.written_times import span_text

YEAR_2000_NS = 946_684_800 * NS_PER_S
_YEAR_2100_NS = 4_102_444_800 * NS_PER_S
MANY = 0.01
HALF_DISTINCT, RETURNS_DISTINCT = 0.5, 0.0
"""Plausible shares of different stamps: of images and scans, which some drivers send twice; of messages of one return."""
_RECEIVE_DISTINCT = 0.9
_WORST_BACK_S = 1.0
Clock = Literal["auto", "header", "receive"]
_AGREE_NS = NS_PER_S
_BLOCK = 11
_FEW_BLOCKS = 0.05
_FEWEST_BLOCKS, _MOST_BLOCKS = 4, 1000
_CLOCK_WORDS = {"header": "stamps", "receive": "receive times"}


@dataclass(frozen=True, slots=True, eq=False)
class Stamps:
    """Both clocks of one topic, message by message in the order received.

    Attributes:
        topic: its name.
        receive_ns: (n,) the recorder's clock.
        header_ns: (n,) the stamps in the messages; None if they carry none.
        distinct: the least share of different stamps that is plausible: a few images may be sent twice, and the returns
            of one scan may share one.
        written: (n,) the messages in the order of the file, which shows a recorder's clock that was set back; None if unknown.
    """

    topic: str
    receive_ns: TimesNs
    header_ns: TimesNs | None
    distinct: float = HALF_DISTINCT
    written: Indices | None = None

    @property
    def offset_ns(self) -> float:
        """Median of receive time minus stamp [ns]."""
        assert self.header_ns is not None
        return float(np.median(self.receive_ns - self.header_ns))

    def earlier(self, by_ns: int) -> "Stamps":
        """Return the stamps reduced by a time, and the receive times if they are of the same clock; stamps of zero stay."""
        same_clock = self.header_ns is None or not len(self.receive_ns) or abs(self.offset_ns) < NS_PER_S
        return replace(
            self,
            receive_ns=self.receive_ns - by_ns if same_clock else self.receive_ns,
            header_ns=None if self.header_ns is None else np.where(self.header_ns == 0, 0, self.header_ns - by_ns),
        )


def header_fault(stamps: Stamps) -> str | None:
    """Explain why the header stamps of a topic cannot be used, as a phrase that follows its name; None if they can."""
    header, n = stamps.header_ns, len(stamps.receive_ns)
    if header is None:
        return "has no stamps"
    if n == 0:
        return None
    zero = int(np.count_nonzero(header == 0))
    if zero == n:
        return f"has only zero stamps ({n} messages)"
    if n > 1 and np.all(header == header[0]):
        return f"has the same stamp in all {n} messages"
    if zero > MANY * n:
        return f"has {zero} zero stamps in {n} messages"
    if ancient(header) and not ancient(stamps.receive_ns):
        seconds = float(np.median(header)) / NS_PER_S
        return f"has stamps from the year 1970 ({seconds:.3f} s), which count from the start of a device"
    if np.median(header) > _YEAR_2100_NS:
        return "has stamps later than the year 2100"
    return _repeats(header, stamps) or _wrong_order(header, stamps)


def receive_fault(stamps: Stamps) -> str | None:
    """Explain why the receive times of a topic cannot be used, as a phrase; None if they can."""
    receive, n = stamps.receive_ns, len(stamps.receive_ns)
    if n == 0:
        return None
    if not receive.any():
        return f"all {n} receive times are zero"
    if n > 1 and np.all(receive == receive[0]):
        return f"all {n} receive times are equal"
    zero = int(np.count_nonzero(receive == 0))
    if zero > MANY * n:
        return f"{zero} of {n} receive times are zero"
    header = stamps.header_ns
    if header is None or not header.any():
        return None
    if stamps.distinct and distinct_times(receive) < _RECEIVE_DISTINCT * distinct_times(header):
        return f"{n} messages have only {distinct_times(receive)} different receive times"
    if (
        stamps.written is not None
        and disorder(receive[stamps.written])
        and not disorder(_dated(header[stamps.written]))
    ):
        return "the receive times go backwards within the file: the recorder's clock was set back"
    return None


def distinct_times(times_ns: TimesNs) -> int:
    """Return how many different times there are."""
    return len(np.unique(times_ns))


def ancient(times_ns: TimesNs) -> bool:
    """Return whether times lie before the year 2000, so that they are no dates."""
    return bool(np.median(times_ns) < YEAR_2000_NS)


def disorder(times_ns: TimesNs) -> str | None:
    """Describe times that go backwards often or far, as a phrase; None for a few small steps."""
    steps = np.diff(times_ns)
    back = int(np.count_nonzero(steps < 0))
    worst_s = -float(steps.min(initial=0)) / NS_PER_S
    if back > max(1, MANY * len(steps)) or worst_s > _WORST_BACK_S:
        return f"has {back} of {len(times_ns)} stamps that go backwards, by up to {worst_s:.3f} s"
    return None


def _dated(header: TimesNs) -> TimesNs:
    return header[header != 0]


def _repeats(header: TimesNs, stamps: Stamps) -> str | None:
    """Describe stamps that several messages share although their receive times tell them apart."""
    here, there = distinct_times(header), distinct_times(stamps.receive_ns)
    if here >= stamps.distinct * there:
        return None
    return f"has only {here} different stamps in {len(header)} messages"


def _wrong_order(header: TimesNs, stamps: Stamps) -> str | None:
    found = disorder(_dated(header))
    if found is not None and stamps.written is not None and disorder(_dated(header[stamps.written])) is None:
        return None  # the order received is wrong, not the stamps
    return found


@dataclass(frozen=True, slots=True, eq=False)
class ClockChoice:
    """The clock chosen for each topic.

    Attributes:
        clocks: "header" or "receive" for each topic, in the order given.
        warnings: what the user must know about it.
    """

    clocks: tuple[Literal["header", "receive"], ...]
    warnings: tuple[DataWarning, ...]


def choose_clocks(radar: Stamps, camera: Stamps, requested: Clock = "auto") -> ClockChoice:
    """Choose the clock of both sensors so that their times can be compared.

    Args:
        radar: the radar's stamps; for drivers that send one message per return, one per message.
        camera: the camera's stamps.
        requested: "auto", or the clock the user asked for.
    """
    if requested != "auto":
        return ClockChoice((requested, requested), ())
    both = (radar, camera)
    if any(receive_fault(stamps) for stamps in both):
        return _without_the_recorder(both)
    faults = tuple(header_fault(stamps) for stamps in both)
    if faults == (None, None) or (_from_boot(radar) and _from_boot(camera) and _are_near(radar, camera)):
        return _both_usable(radar, camera)
    warnings = [_fell_back(stamps, fault) for stamps, fault in zip(both, faults, strict=True) if fault]
    for number, (sound, fault) in enumerate(zip(both, faults, strict=True)):
        if fault is None and len(sound.receive_ns):
            lag_s = sound.offset_ns / NS_PER_S
            if abs(lag_s) <= 1.0:
                clocks: tuple[Literal["header", "receive"], ...] = ("receive", "header")
                return ClockChoice(clocks if number else clocks[::-1], tuple(warnings))
            warnings.append(
                _mixed_clocks_warning(
                    f"the stamps of {sound.topic} differ from the receive times by {span_text(lag_s)}"
                )
            )
    return ClockChoice(("receive", "receive"), tuple(warnings))


def _without_the_recorder(both: tuple[Stamps, Stamps]) -> ClockChoice:
    """Choose the better clock of each topic where receive times cannot be right, and so tell nothing about the stamps."""
    choices = [_better(stamps) for stamps in both]
    clocks = tuple(choice.clocks[0] for choice in choices)
    warnings = [warning for choice in choices for warning in choice.warnings]
    if len(set(clocks)) > 1:
        names = " and ".join(
            f"{stamps.topic} ({_CLOCK_WORDS[clock]})" for stamps, clock in zip(both, clocks, strict=True)
        )
        warnings.append(
            DataWarning.reported(
                "mixed-clocks",
                f"the times of {names} come from clocks that cannot be compared, because each topic has only one usable clock",
                "check in the page that radar and image show the same moment; if they do not, record again",
            )
        )
    return ClockChoice(clocks, tuple(warnings))


def _better(stamps: Stamps) -> ClockChoice:
    """Choose the better clock of one topic: the one without fault, or else the one with more different times."""
    fault, received = header_fault(stamps), receive_fault(stamps)
    if fault is None or (_from_boot(stamps) and received is not None):
        return ClockChoice(("header",), ())
    if received is None:
        return ClockChoice(("receive",), (_fell_back(stamps, fault),))
    by_stamps = stamps.header_ns is not None and distinct_times(stamps.header_ns) > distinct_times(stamps.receive_ns)
    clock: Literal["header", "receive"] = "header" if by_stamps else "receive"
    return ClockChoice(
        (clock,),
        (
            DataWarning.reported(
                "stamps-unusable",
                f"{stamps.topic} {fault}, and {received}; its {_CLOCK_WORDS[clock]} are used, which have more different times",
                "do not trust times of this topic: record again with a driver that fills in header.stamp",
            ),
        ),
    )


def _from_boot(stamps: Stamps) -> bool:
    """Return whether stamps are sound but close to 1970: simulated time, or a machine whose date is not set."""
    if stamps.header_ns is None or not len(stamps.header_ns) or not stamps.header_ns.any():
        return False
    constant = len(stamps.header_ns) > 1 and bool(np.all(stamps.header_ns == stamps.header_ns[0]))
    return ancient(stamps.header_ns) and not constant and disorder(stamps.header_ns) is None


def _are_near(radar: Stamps, camera: Stamps) -> bool:
    return abs(radar.offset_ns - camera.offset_ns) <= _AGREE_NS


def _both_usable(radar: Stamps, camera: Stamps) -> ClockChoice:
    if not (len(radar.receive_ns) and len(camera.receive_ns)):
        return ClockChoice(("header", "header"), ())
    if _are_near(radar, camera):
        worst_s = _divergence_s(radar, camera)
        if worst_s <= _AGREE_NS / NS_PER_S:
            return ClockChoice(("header", "header"), ())
        divergence = f"the stamps of {radar.topic} and {camera.topic} diverge during the recording, by up to {span_text(worst_s)}"
        return ClockChoice(("receive", "receive"), (_mixed_clocks_warning(divergence),))
    assert radar.header_ns is not None
    assert camera.header_ns is not None
    if not _overlap(radar.receive_ns, camera.receive_ns) and _overlap(radar.header_ns, camera.header_ns):
        return ClockChoice(("header", "header"), ())
    apart_s = (radar.offset_ns - camera.offset_ns) / NS_PER_S
    return ClockChoice(
        ("receive", "receive"),
        (
            _mixed_clocks_warning(
                f"the stamps of {radar.topic} and {camera.topic} come from clocks that are {span_text(apart_s)} apart"
            ),
        ),
    )


def _divergence_s(radar: Stamps, camera: Stamps) -> float:
    """Return the largest difference between both delays [s], ignoring a few outliers; 0 for short recordings.

    A sensor clock that drifts or is set during the recording changes one delay; the recorder's own clock changes both.
    """
    (at_ns, lag_s), (other_ns, other_s) = _median_lags(radar), _median_lags(camera)
    if min(len(at_ns), len(other_ns)) < _FEWEST_BLOCKS:
        return 0.0
    apart_s = np.abs(lag_s - np.interp(at_ns, other_ns, other_s))
    return float(np.quantile(apart_s, 1.0 - _FEW_BLOCKS))


def _median_lags(stamps: Stamps) -> tuple[np.ndarray, np.ndarray]:
    """Return receive times [ns] and median delays [s] of blocks of eleven messages, for at most a thousand blocks."""
    assert stamps.header_ns is not None
    dated = np.flatnonzero(stamps.header_ns)
    blocks = len(dated) // _BLOCK
    begins = np.linspace(0, blocks - 1, min(blocks, _MOST_BLOCKS)).astype(np.int64) * _BLOCK
    rows = dated[begins[:, None] + np.arange(_BLOCK)]
    received = stamps.receive_ns[rows]
    lags_s = (received - stamps.header_ns[rows]) / NS_PER_S
    return received[:, _BLOCK // 2].astype(np.float64), np.median(lags_s, axis=1)


def _overlap(a: TimesNs, b: TimesNs) -> bool:
    return bool(a.min() <= b.max() and b.min() <= a.max())


def _mixed_clocks_warning(why: str) -> DataWarning:
    return DataWarning.reported(
        "mixed-clocks",
        f"{why}: receive times are used for both sensors",
        "receive times include driver delays: keep the reflector still for longer at each placement, or choose the clock "
        "yourself (--clock header or --clock receive)",
    )


def _fell_back(stamps: Stamps, fault: str) -> DataWarning:
    return DataWarning.reported(
        "stamps-unusable",
        f"{stamps.topic} {fault}; receive times are used instead",
        "receive times include the driver delay: keep the reflector still for longer at each placement, and have the driver "
        "fill in header.stamp next time",
    )


def choose_clock(stamps: Stamps, requested: Clock = "auto") -> ClockChoice:
    """Choose the clock of a single topic."""
    if requested != "auto":
        return ClockChoice((requested,), ())
    return ClockChoice(("header",), ()) if _from_boot(stamps) else _better(stamps)
