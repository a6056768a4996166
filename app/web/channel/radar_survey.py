"""What the radar alone says about the whole recording: where the reflector stood still, and how many returns there were."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from app.web.messages import PlacementRow
from calib_core.arrays import TimesNs
from calib_core.association.gating import static_returns
from calib_core.association.placements import Placement, find_placements
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.options import GatingOptions
from calib_core.recordings.radar.scan_stream import join_scans

__all__ = ["Activity", "GrowingSurvey", "Survey", "placements_at", "survey_of"]

_MOST_SLICES = 800
_MOST_STATIC_RETURNS = 1_000_000
"""Limit of one stretch: more than an hour of 25 static returns in each of 10 scans a second; searching it takes about 200 MB."""


@dataclass(frozen=True, slots=True)
class Activity:
    """How many returns there are in each slice of time, from the first frame on.

    Attributes:
        step_s: length of a slice [s].
        returns: mean number of returns per scan; 0 where there is no scan.
    """

    step_s: float
    returns: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """The radar's view of the whole recording.

    Attributes:
        placements: where the reflector stood still, without those that no frame shows.
        rows: the same in the form sent to the page.
        activity: of the radar.
    """

    placements: tuple[Placement, ...]
    rows: tuple[PlacementRow, ...]
    activity: Activity


def survey_of(windows: Iterable[RadarScans], image_times: TimesNs, options: GatingOptions) -> Survey:
    """Survey a whole recording.

    Memory is bounded: only the static returns of each window are kept, and a recording with too many of them is searched one
    stretch after another.

    Args:
        windows: all scans, in order of time.
        image_times: (m,) stamps of the frames [ns], ascending.
        options: which returns can be the reflector.
    """
    activity = _ActivitySum(image_times)
    seen = [
        (placement, row)
        for stretch in _stretches(map(activity.note, windows), options)
        for placement in find_placements(stretch, options)
        if (row := _row(placement, image_times)) is not None
    ]
    return Survey(tuple(pair[0] for pair in seen), tuple(pair[1] for pair in seen), activity.total())


class GrowingSurvey:
    """Surveys a recording that is still being written: each scan is read once, and the placements are searched for again.

    Memory is bounded as in `survey_of`: the placements of a full stretch stay as they are.

    Args:
        options: which returns can be the reflector.
    """

    def __init__(self, options: GatingOptions) -> None:
        self._options = options
        self._static = RadarScans()
        self._settled: tuple[Placement, ...] = ()
        self._times: list[TimesNs] = []
        self._counts: list[np.ndarray] = []

    @property
    def until(self) -> TimeNs | None:
        """The stamp of the last scan noted; None before the first."""
        return TimeNs(int(self._times[-1][-1])) if self._times else None

    def note(self, scans: RadarScans) -> None:
        """Add scans that are later than all before."""
        if not len(scans):
            return
        if len(self._static.points_radar_m) > _MOST_STATIC_RETURNS:
            self._settled = (*self._settled, *find_placements(self._static, self._options))
            self._static = RadarScans()
        self._static = join_scans([self._static, static_returns(scans, self._options)])
        self._times.append(scans.times_ns)
        self._counts.append(np.diff(scans.first_return))

    def survey(self, image_times: TimesNs) -> Survey:
        """Return what is known now.

        Args:
            image_times: (m,) stamps of the frames [ns], ascending.
        """
        found = (*self._settled, *find_placements(self._static, self._options))
        seen = [(one, row) for one in found if (row := _row(one, image_times)) is not None]
        activity = _ActivitySum(image_times)
        if self._times:
            activity.count(np.concatenate(self._times), np.concatenate(self._counts))
        return Survey(tuple(pair[0] for pair in seen), tuple(pair[1] for pair in seen), activity.total())


def _stretches(windows: Iterable[RadarScans], options: GatingOptions) -> Iterator[RadarScans]:
    """Yield the static returns of a recording; in several pieces if there are too many."""
    pieces: list[RadarScans] = []
    for window in windows:
        pieces.append(static_returns(window, options))
        if sum(len(piece.points_radar_m) for piece in pieces) > _MOST_STATIC_RETURNS:
            yield join_scans(pieces)
            pieces = []
    yield join_scans(pieces)


def _row(placement: Placement, image_times: TimesNs) -> PlacementRow | None:
    """Return the row of a placement, with the frame nearest to its middle; None if no frame shows it."""
    first, last = np.searchsorted(image_times, [placement.start, placement.end])
    if first >= last:
        return None
    middle = (int(placement.start) + int(placement.end)) // 2
    frame = int(first + np.argmin(np.abs(image_times[first:last] - middle)))
    origin = int(image_times[0])
    return PlacementRow(
        start_s=(int(placement.start) - origin) / NS_PER_S,
        end_s=(int(placement.end) - origin) / NS_PER_S,
        frame=frame,
        range_m=float(np.linalg.norm(placement.position_radar_m)),
        score=placement.score,
    )


class _ActivitySum:
    """Counts scans and returns by slices of time.

    Args:
        image_times: (m,) stamps of the frames [ns], ascending.
    """

    def __init__(self, image_times: TimesNs) -> None:
        length_s = max((int(image_times[-1]) - int(image_times[0])) / NS_PER_S, 1e-3)
        self._slices = max(1, min(_MOST_SLICES, int(length_s / 0.25)))
        self._step_s = length_s / self._slices
        self._origin = image_times[0]
        self._returns, self._scans = np.zeros(self._slices), np.zeros(self._slices, dtype=np.int64)

    def note(self, scans: RadarScans) -> RadarScans:
        """Count some scans; return them."""
        self.count(scans.times_ns, np.diff(scans.first_return))
        return scans

    def count(self, times_ns: TimesNs, counts: np.ndarray) -> None:
        """Count scans by their stamps [ns] and numbers of returns."""
        place = ((times_ns - self._origin) / NS_PER_S // self._step_s).astype(np.int64)
        inside = (place >= 0) & (place < self._slices)
        self._returns += np.bincount(place[inside], weights=counts[inside], minlength=self._slices)
        self._scans += np.bincount(place[inside], minlength=self._slices)

    def total(self) -> Activity:
        """Return the mean number of returns per scan in each slice."""
        return Activity(self._step_s, tuple(np.round(self._returns / np.maximum(self._scans, 1), 2).tolist()))


def placements_at(survey: Survey | None, time: int) -> Sequence[Placement]:
    """Return the placements that include a time [ns]."""
    if survey is None:
        return ()
    return [placement for placement in survey.placements if placement.start <= time <= placement.end]
