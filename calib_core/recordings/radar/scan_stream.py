"""The stream of radar scans of a recording, decoded in blocks and by window."""

import contextlib
import copy
import threading
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calib_core.arrays import Points3, TimesNs, frozen_array
from calib_core.errors import MessageError, RecordingError
from calib_core.geometry import RigidTransform
from calib_core.measurements import NS_PER_S, RETURN_COLUMNS, RadarScans, TimeNs
from calib_core.recordings.radar.columns import Returns, no_returns
from calib_core.recordings.radar.layouts import RadarLayout
from calib_core.recordings.radar.message_layouts.point_clouds import CloudLayout
from calib_core.recordings.radar.message_layouts.single_returns import PointLayout, first_of_scans
from calib_core.recordings.topics import Topic

_BLOCK_SCANS = 128
_CACHED_RETURNS = 1_000_000
_WINDOW_RETURNS = 50_000
_FIRST_WINDOW_SCANS = 16
_MOST_WINDOW_SCANS = 2048
_USUAL_CLOUD_BYTES = 4096
_SMALLEST_CLOUD_BYTES = 256
_LONGEST_TOGETHER = 1 << 17
_CLAIMS_OF_A_SCAN = 16
_MOST_WINDOW_BYTES = 1 << 23


@dataclass(frozen=True, slots=True)
class Losses:
    """Returns that have no position although their messages do not mark them as invalid, and what was read.

    Attributes:
        lost: their number: the position is no number, or the message holds more returns than it states.
        read: number of all returns that were looked at.
    """

    lost: int = 0
    read: int = 0

    def __add__(self, other: "Losses") -> "Losses":
        return Losses(self.lost + other.lost, self.read + other.read)

    @property
    def share(self) -> float:
        """Of what was looked at."""
        return self.lost / max(self.read, 1)


class ScanBlocks(ABC):
    """Scans in order of time, decoded on demand; memory is bounded, and reading is thread-safe.

    Args:
        times_ns: (k,) stamps of the scans, ascending.
    """

    def __init__(self, times_ns: TimesNs) -> None:
        self.times_ns = times_ns
        self._blocks: OrderedDict[int, RadarScans] = OrderedDict()
        self._lock = threading.Lock()

    @abstractmethod
    def decoded(self, scans: np.ndarray) -> RadarScans:
        """Decode the scans with the given numbers, ascending, without caching."""

    @property
    @abstractmethod
    def most_together(self) -> int:
        """The largest number of scans to decode at once."""

    def scans(self, start: TimeNs | None = None, end: TimeNs | None = None) -> RadarScans:
        """Decode the scans with start <= stamp <= end."""
        first = 0 if start is None else int(np.searchsorted(self.times_ns, start, side="left"))
        last = len(self.times_ns) if end is None else int(np.searchsorted(self.times_ns, end, side="right"))
        return self._scans_between(first, max(first, last))

    def around(self, times: Sequence[TimeNs], half_window_s: float) -> RadarScans:
        """Decode the scans within half_window_s of any of the times, each once."""
        half = round(half_window_s * NS_PER_S)
        wanted = np.zeros(len(self.times_ns) + 1, dtype=np.int64)
        for time in times:
            wanted[np.searchsorted(self.times_ns, int(time) - half, side="left")] += 1
            wanted[np.searchsorted(self.times_ns, int(time) + half, side="right")] -= 1
        inside = np.concatenate([[False], np.cumsum(wanted)[:-1] > 0, [False]])
        edges = np.flatnonzero(np.diff(inside.astype(np.int8)))
        return RadarScans.joined([self._scans_between(int(a), int(b)) for a, b in edges.reshape(-1, 2)])

    def _scans_between(self, first: int, last: int) -> RadarScans:
        """Return the scans first to last - 1."""
        pieces = []
        for number in range(first // _BLOCK_SCANS, -(-last // _BLOCK_SCANS)):
            block, base = self._block(number), number * _BLOCK_SCANS
            pieces.append(block.part(max(first - base, 0), min(last - base, len(block))))
        return RadarScans.joined(pieces)

    def _block(self, number: int) -> RadarScans:
        with self._lock:
            if number in self._blocks:
                self._blocks.move_to_end(number)
                return self._blocks[number]
        block = self.decoded(np.arange(number * _BLOCK_SCANS, min((number + 1) * _BLOCK_SCANS, len(self.times_ns))))
        with self._lock:
            self._blocks[number] = block
            while len(self._blocks) > 2 and sum(len(b.points_radar_m) for b in self._blocks.values()) > _CACHED_RETURNS:
                self._blocks.popitem(last=False)
        return block

    def windows(self) -> Iterator[RadarScans]:
        """Decode all scans in order, about equally many returns at a time, without caching."""
        first, count = 0, _FIRST_WINDOW_SCANS
        while first < len(self.times_ns):
            scans = self.decoded(np.arange(first, min(first + count, len(self.times_ns))))
            yield scans
            first += len(scans)
            per_scan = max(1.0, len(scans.points_radar_m) / len(scans))
            count = max(1, min(int(_WINDOW_RETURNS / per_scan), _MOST_WINDOW_SCANS, self.most_together))

    def sample(self, count: int) -> RadarScans:
        """Decode at most count scans spread evenly over the recording."""
        places = np.linspace(0, len(self.times_ns) - 1, min(count, len(self.times_ns)))
        return self.decoded(np.unique(places.astype(np.int64)))


class RadarStream(ScanBlocks):
    """The scans of one radar topic, decoded in blocks on demand.

    Args:
        topic: the radar topic.
        layouts: one per part of the topic.
        stamps_ns: (n,) one time per message, by the chosen clock.
        heads: (n, size) the first bytes of the messages, at least as many as PointLayout.group_bytes.
        is_timed: whether anything states the times.
    """

    def __init__(
        self,
        topic: Topic,
        layouts: Sequence[RadarLayout],
        stamps_ns: TimesNs,
        heads: np.ndarray,
        *,
        is_timed: bool = True,
    ) -> None:
        self.topic = topic
        self.is_timed = is_timed
        self.layout: RadarLayout = layouts[0]
        """The layout of the first part; with one return per message, all parts share it."""
        self._layouts = layouts
        self.unreadable: Mapping[int, str] = {}
        self._read_of, self._lost_of = np.zeros((2, len(topic)), dtype=np.int32)
        self._cloud_bytes = _USUAL_CLOUD_BYTES
        first = np.arange(len(topic))
        if isinstance(self.layout, PointLayout):
            first = first_of_scans(stamps_ns, *self._numbers(self.layout, heads))
        order = np.argsort(stamps_ns[first], kind="stable")
        last = np.append(first[1:], len(topic))
        self._first, self._last = first[order], last[order]
        super().__init__(frozen_array(stamps_ns[first][order], (None,), dtype=np.int64))

    def at_azimuth(self, column: str) -> "RadarStream":
        """Return the same scans with the returns at another azimuth that the messages give for each."""
        return self._with_plan(azimuth_from=column)

    def seen_from(self, mount: RigidTransform) -> "RadarStream":
        """Return the same scans with the returns in the frame of a radar, given its pose in the frame that they are in."""
        return self._with_plan(mount=mount)

    def _with_plan(self, **changes: Any) -> "RadarStream":
        other = copy.copy(self)
        other.layout, *rest = (replace(layout, plan=replace(layout.plan, **changes)) for layout in self._layouts)
        other._layouts = (other.layout, *rest)
        other._read_of, other._lost_of = np.zeros((2, len(self.topic)), dtype=np.int32)
        ScanBlocks.__init__(other, self.times_ns)
        return other

    def unreadable_times(self) -> TimesNs:
        """Return the stamps of the scans with a message that could not be read so far."""
        messages = np.array(sorted(self.unreadable), dtype=np.int64)[:, None]
        return self.times_ns[((self._first <= messages) & (messages < self._last)).any(axis=0)]

    def losses(self, times: Sequence[TimeNs] | None = None, half_window_s: float = 0.0) -> Losses:
        """Count what was lost in the scans read so far: in all, or in those within half_window_s of any of the times."""
        if self.layout.plan.azimuth_from is not None:
            return Losses()  # a return may have no other azimuth
        if times is None:
            return Losses(int(self._lost_of.sum()), int(self._read_of.sum()))
        half_ns = round(half_window_s * NS_PER_S)
        ends = [np.searchsorted(self.times_ns, [int(time) - half_ns, int(time) + half_ns + 1]) for time in times]
        scans = np.unique(np.concatenate([np.zeros(0, np.int64), *(np.arange(low, high) for low, high in ends)]))
        first, last = self._first[scans], self._last[scans]
        lost, read = (np.concatenate([[0], np.cumsum(of, dtype=np.int64)]) for of in (self._lost_of, self._read_of))
        return Losses(int((lost[last] - lost[first]).sum()), int((read[last] - read[first]).sum()))

    def _count(self, messages: np.ndarray, counts: np.ndarray, returns: Returns) -> None:
        """Note how many returns of each message were read and lost."""
        self._read_of[messages] = counts
        if returns.lost is not None:
            ends = np.cumsum(counts)
            before = np.concatenate([[0], np.cumsum(returns.lost)])
            self._lost_of[messages] = before[ends] - before[ends - counts]

    def _numbers(self, layout: PointLayout, heads: np.ndarray) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Read the numbers that separate scans; if a message's strings are longer than the first's, from the whole message."""
        frame, point = layout.numbers(heads)
        for row in np.flatnonzero(layout.misfits(heads)).tolist():
            with contextlib.suppress(RecordingError):  # reported when the scan itself is read
                message = layout.message(self.topic.payload(row))
                for numbers, name in ((frame, layout.frame_number), (point, layout.point_number)):
                    if numbers is not None and name:
                        numbers[row] = message.number(name)
        return frame, point

    @property
    def receive_ns(self) -> TimesNs:
        """When the first message of each scan (k,) arrived, no earlier than that of the scan before."""
        return np.maximum.accumulate(self.topic.receive_ns[self._first])

    @property
    def delay_ns(self) -> int:
        """The median time from a scan's stamp to the arrival of its first message [ns]."""
        delays = self.topic.receive_ns[self._first] - self.times_ns
        return int(np.median(delays)) if len(delays) else 0

    @property
    def parts(self) -> tuple["RadarStream", ...]:
        """The streams of single topics that it is made of: itself."""
        return (self,)

    @property
    def most_together(self) -> int:
        """The largest number of scans to decode at once."""
        return _MOST_WINDOW_BYTES // self._cloud_bytes

    def claims(self, count: int) -> Returns:
        """Decode ranges and angles as given, and positions in the message's own axes, of at most count scans."""
        plan = self.layout.plan
        layout = replace(self.layout, plan=replace(plan, claiming=True, axes=plan.axes if plan.mount else None))
        places = np.unique(np.linspace(0, len(self.times_ns) - 1, min(count, len(self.times_ns))).astype(np.int64))
        first, last = self._first[places], np.minimum(self._last[places], self._first[places] + _CLAIMS_OF_A_SCAN)
        rows = np.concatenate([np.zeros(0, np.int64), *(np.arange(a, b) for a, b in zip(first, last, strict=True))])
        rows = rows[self.topic.part[rows] == self.topic.part[0]] if len(rows) else rows
        if isinstance(layout, PointLayout):
            heads = self.topic.heads(rows, layout.dtype.itemsize)
            whole = (heads.lengths >= layout.dtype.itemsize) & ~layout.misfits(heads.rows)
            return layout.returns_of_rows(heads.rows[whole])
        found = []
        for row in rows.tolist():
            with contextlib.suppress(RecordingError):  # reported when the scan itself is read
                found.append(layout.returns(self.topic.payload(row)))
        return _join_returns(found)

    def decoded(self, scans: np.ndarray) -> RadarScans:
        """Decode the scans with the given numbers, ascending, without caching."""
        if isinstance(self.layout, PointLayout):
            return self._decoded_points(self.layout, scans)
        if isinstance(self.layout, CloudLayout) and len(self._layouts) == 1 and len(scans) > 1:
            together = self._decoded_clouds(self.layout, scans)
            if together is not None:
                return together
        messages = self._first[scans]
        returns = [self._returns(int(message)) for message in messages]
        for message, scan in zip(messages, returns, strict=True):
            self._count(np.array([message]), np.array([len(scan)]), scan)
        return _stacked(self.times_ns[scans], [len(scan) for scan in returns], _join_returns(returns))

    def _decoded_clouds(self, layout: CloudLayout, scans: np.ndarray) -> RadarScans | None:
        """Decode clouds with equal layout at once; None if they must be read one by one."""
        messages = self._first[scans]
        heads = self.topic.heads(messages, self._cloud_bytes)
        longest = int(heads.lengths.max())
        if heads.rows.shape[1] < longest <= _LONGEST_TOGETHER:
            heads = self.topic.heads(messages, longest)
        self._cloud_bytes = max(_SMALLEST_CLOUD_BYTES, min(longest + longest // 8, _LONGEST_TOGETHER))
        if longest > heads.rows.shape[1] or int(heads.lengths.min()) < 0:
            return None
        found = layout.returns_of_rows(heads.rows, heads.lengths)
        if found is None:
            return None
        self._count(messages, found[1], found[0])
        return _stacked(self.times_ns[scans], found[1].tolist(), found[0])

    def _returns(self, message: int) -> Returns:
        """Decode one message; an unreadable one becomes an empty scan and is reported."""
        layout = self._layouts[int(self.topic.part[message])]
        assert not isinstance(layout, PointLayout)
        try:
            return layout.returns(self.topic.payload(message))
        except MessageError as error:
            self._note_unreadable({message: str(error)})
            return no_returns()

    def _note_unreadable(self, found: Mapping[int, str]) -> None:
        with self._lock:
            self.unreadable = {**self.unreadable, **found}

    def _decoded_points(self, layout: PointLayout, scans: np.ndarray) -> RadarScans:
        counts = self._last[scans] - self._first[scans]
        if not len(counts):
            return RadarScans()
        messages = np.concatenate([np.arange(a, b) for a, b in zip(self._first[scans], self._last[scans], strict=True)])
        heads = self.topic.heads(messages, layout.dtype.itemsize)
        short = heads.lengths < layout.dtype.itemsize
        returns = layout.returns_of_rows(heads.rows)
        misfit = layout.misfits(heads.rows) & ~short
        if returns.lost is not None:
            returns.lost[short | misfit] = False  # not read yet
        self._count(messages, np.ones(len(messages), dtype=np.int64), returns)
        if short.any():
            returns.points_radar_m[short] = np.nan
            self._note_unreadable(dict.fromkeys(messages[short].tolist(), "the message is truncated"))
        misfits = np.flatnonzero(misfit).tolist()
        returns = _join_returns([returns, no_returns()]) if misfits else returns  # a writable copy
        for row in misfits:
            self._reread(layout, int(messages[row]), row, returns)
        return _stacked(self.times_ns[scans], counts.tolist(), returns)

    def _reread(self, layout: PointLayout, message: int, row: int, returns: Returns) -> None:
        """Read a return whose field offsets differ from the first message's, and store it in its row."""
        try:
            single = layout.returns(self.topic.payload(message))
        except MessageError as error:
            returns.points_radar_m[row] = np.nan
            self._note_unreadable({message: str(error)})
            return
        self._count(np.array([message]), np.ones(1, dtype=np.int64), single)
        for name in RETURN_COLUMNS:
            getattr(returns, name)[row] = getattr(single, name)[0]


def _join_returns(scans: Sequence[Returns]) -> Returns:
    if len(scans) < 2:
        return scans[0] if scans else no_returns()
    columns = {name: np.concatenate([getattr(scan, name) for scan in scans]) for name in RETURN_COLUMNS}
    return Returns(**columns, claimed_polar=_joined_claims(scans))


def _joined_claims(scans: Sequence[Returns]) -> Points3 | None:
    claims = [scan.claimed_polar for scan in scans if scan.claimed_polar is not None]
    return np.concatenate(claims) if claims else None


def _stacked(times_ns: TimesNs, counts: Sequence[int], returns: Returns) -> RadarScans:
    """Build scans from returns that nothing else references."""
    columns = {name: getattr(returns, name) for name in RETURN_COLUMNS}
    for column in columns.values():
        column.setflags(write=False)
    first_return = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return RadarScans(times_ns=times_ns, first_return=first_return, **columns)
