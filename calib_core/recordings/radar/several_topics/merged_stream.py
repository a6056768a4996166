"""The stream of a radar that publishes several topics: near and far scans, or two azimuths of each return."""

from collections.abc import Sequence

import numpy as np

from calib_core.measurements import RadarScans
from calib_core.recordings.radar.columns import Returns
from calib_core.recordings.radar.layouts import RadarLayout
from calib_core.recordings.radar.scan_blocks import ScanBlocks
from calib_core.recordings.radar.scan_stream import RadarStream
from calib_core.recordings.radar.several_topics.merging import Spread, aligned, merged, moments_of, spread_of
from calib_core.recordings.topics import Topic

_STRETCHES = 3
_SCANS_OF_A_STRETCH = 10


class MergedStream(ScanBlocks):
    """The scans of several topics of one radar, moment by moment, with the same face as the stream of one topic.

    Args:
        parts: the streams of the topics, the most useful first.
        repeats: for each topic, the one whose returns it repeats at another azimuth; itself if it repeats none.
    """

    def __init__(self, parts: Sequence[RadarStream], repeats: Sequence[int]) -> None:
        self.parts: tuple[RadarStream, ...] = tuple(parts)
        self.topic: Topic = parts[0].topic
        self.layout: RadarLayout = parts[0].layout
        self._repeats = tuple(repeats)
        moments = moments_of([part.times_ns for part in parts])
        self._scan_of = moments.scan_of
        self._spreads: tuple[Spread, ...] = tuple(map(measured_spread, parts))
        super().__init__(moments.times_ns)

    @property
    def other_azimuths(self) -> tuple[str, ...]:
        """The topics, or the columns of a topic, that hold other azimuths of the returns of another topic."""
        found = []
        for place, part in enumerate(self.parts):
            column = part.layout.plan.azimuth_from
            if self._repeats[place] != place:
                found.append(part.topic.name if column is None else f"{column} of {part.topic.name}")
        return tuple(found)

    @property
    def most_together(self) -> int:
        """The largest number of scans to decode at once."""
        return min(part.most_together for part in self.parts)

    def decoded(self, scans: np.ndarray) -> RadarScans:
        """Decode the moments with the given numbers, ascending, without caching."""
        return merged([self._aligned(part, scans) for part in range(len(self.parts))], self._spreads, self._repeats)

    def _aligned(self, part: int, moments: np.ndarray) -> RadarScans:
        numbers = self._scan_of[part][moments]
        wanted = np.unique(numbers[numbers >= 0])
        places = np.where(numbers >= 0, np.searchsorted(wanted, numbers), -1)
        return aligned(self.parts[part].decoded(wanted), places, self.times_ns[moments])

    def claims(self, count: int) -> Returns:
        """Decode ranges and angles as given by the first topic; see RadarStream."""
        return self.parts[0].claims(count)


def measured_spread(stream: RadarStream) -> Spread:
    """Measure how far apart two reports of one return lie, in a few stretches of consecutive scans."""
    first = np.linspace(0, max(len(stream.times_ns) - _SCANS_OF_A_STRETCH, 0), _STRETCHES).astype(np.int64)
    wanted = np.unique((first[:, None] + np.arange(_SCANS_OF_A_STRETCH)).ravel())
    return spread_of(stream.decoded(wanted[wanted < len(stream.times_ns)]))
