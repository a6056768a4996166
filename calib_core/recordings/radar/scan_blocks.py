"""Streams of scans: decoded in blocks with a bounded cache, and by window; what they decode is theirs."""

import threading
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Iterator, Sequence

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs

_BLOCK_SCANS = 128
_CACHED_RETURNS = 1_000_000
_WINDOW_RETURNS = 50_000
_FIRST_WINDOW_SCANS = 16
_MOST_WINDOW_SCANS = 2048


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
        return self._between(first, max(first, last))

    def around(self, times: Sequence[TimeNs], half_window_s: float) -> RadarScans:
        """Decode the scans within half_window_s of any of the times, each once."""
        half = round(half_window_s * NS_PER_S)
        wanted = np.zeros(len(self.times_ns) + 1, dtype=np.int64)
        for time in times:
            wanted[np.searchsorted(self.times_ns, int(time) - half, side="left")] += 1
            wanted[np.searchsorted(self.times_ns, int(time) + half, side="right")] -= 1
        inside = np.concatenate([[False], np.cumsum(wanted)[:-1] > 0, [False]])
        edges = np.flatnonzero(np.diff(inside.astype(np.int8)))
        return RadarScans.joined([self._between(int(a), int(b)) for a, b in edges.reshape(-1, 2)])

    def _between(self, first: int, last: int) -> RadarScans:
        """Return the scans first to last - 1."""
        pieces = []
        for number in range(first // _BLOCK_SCANS, -(-last // _BLOCK_SCANS)):
            block, base = self._block(number), number * _BLOCK_SCANS
            pieces.append(_cut(block, max(first - base, 0), min(last - base, len(block))))
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


def _cut(scans: RadarScans, first: int, last: int) -> RadarScans:
    """Keep the scans first to last - 1."""
    if first == 0 and last == len(scans):
        return scans
    low, high = int(scans.first_return[first]), int(scans.first_return[last])
    return RadarScans(
        times_ns=scans.times_ns[first:last],
        first_return=scans.first_return[first : last + 1] - low,
        points_radar_m=scans.points_radar_m[low:high],
        doppler_mps=scans.doppler_mps[low:high],
        snr_db=scans.snr_db[low:high],
        sigma_polar=scans.sigma_polar[low:high],
        alternative_of=None if scans.alternative_of is None else scans.alternative_of[low:high],
    )
