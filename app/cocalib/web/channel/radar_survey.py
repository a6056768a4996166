"""What the radar alone says about the whole recording: where the reflector stood still, and how many returns there were."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.association.gating import static_returns
from calib_core.association.placements import MOST_STATIC_RETURNS, Placement, find_placements, in_stretches
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.options import GatingOptions
from calib_core.radar import polar_from_cartesian
from cocalib.web.channel.placement_words import SHORTEST_S, placement_figures, placement_note, placement_summary
from cocalib.web.channel.radar_map import RadarMapSum
from cocalib.web.messages import PlacementRow, Placements, RadarMap

_MOST_SLICES = 8000
_AT_RANGE_M = 1.0
_OWN_RETURNS_M, _OWN_SHARE = 0.5, 0.1
"""Returns this far from a placement belong to it [m], and this share of its range more: angles scatter."""
_STRONG = 0.9


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
        map: of the static returns.
        message: the placements for the page, with what they are good for.
    """

    placements: tuple[Placement, ...]
    rows: tuple[PlacementRow, ...]
    activity: Activity
    map: RadarMap
    message: Placements


def survey_of(windows: Iterable[RadarScans], moments: TimesNs, options: GatingOptions) -> Survey:
    """Survey a whole recording.

    Memory is bounded: only the static returns of each window are kept, and a recording with too many of them is searched one
    stretch after another.

    Args:
        windows: all scans, in order of time.
        moments: (m,) stamps of the frames [ns], ascending; of the scans if there are no frames.
        options: which returns can be the reflector.
    """
    activity, cells = _ActivitySum(moments), RadarMapSum(options)
    seen = [
        (placement, row)
        for stretch in in_stretches(_static(map(activity.note, windows), options, cells))
        if _length_s(stretch.times_ns) >= SHORTEST_S  # searching a few dense clouds in vain would take minutes
        for placement in find_placements(stretch, options, min_dwell_s=SHORTEST_S)
        if (row := _row(placement, moments, stretch)) is not None
    ]
    return _survey(seen, activity, cells, moments)


class GrowingSurvey:
    """Surveys a recording that is still being written: each scan is read once, and the placements are searched for again.

    Memory is bounded as in `survey_of`: the placements of a full stretch stay as they are.

    Args:
        options: which returns can be the reflector.
    """

    def __init__(self, options: GatingOptions) -> None:
        self._options = options
        self._static = RadarScans()
        self._cells = RadarMapSum(options)
        self._settled: list[tuple[Placement, PlacementRow]] = []
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
        static = static_returns(scans, self._options)
        self._cells.add(static)
        self._static = RadarScans.joined([self._static, static])
        self._times.append(scans.times_ns)
        self._counts.append(np.diff(scans.first_return))

    def survey(self, moments: TimesNs) -> Survey:
        """Return what is known now.

        Args:
            moments: (m,) stamps of the frames [ns], ascending.
        """
        found = find_placements(self._static, self._options, min_dwell_s=SHORTEST_S)
        new = [(one, row) for one in found if (row := _row(one, moments, self._static)) is not None]
        seen = [*self._settled, *new]
        if len(self._static.points_radar_m) > MOST_STATIC_RETURNS:
            self._settled, self._static = seen, RadarScans()
        activity = _ActivitySum(moments)
        if self._times:
            activity.count(np.concatenate(self._times), np.concatenate(self._counts))
        return _survey(seen, activity, self._cells, moments)


def _survey(
    seen: Sequence[tuple[Placement, PlacementRow]], activity: "_ActivitySum", cells: RadarMapSum, moments: TimesNs
) -> Survey:
    rows = tuple(pair[1] for pair in seen)
    figures = placement_figures(rows, *activity.rates())
    message = Placements(rows, placement_summary(rows, _length_s(moments)), figures)
    return Survey(tuple(pair[0] for pair in seen), rows, activity.total(), cells.total(), message)


def _static(windows: Iterable[RadarScans], options: GatingOptions, cells: RadarMapSum) -> Iterator[RadarScans]:
    """Yield the static returns of each window, and put them on the map."""
    for window in windows:
        static = static_returns(window, options)
        cells.add(static)
        yield static


def _length_s(times_ns: TimesNs) -> float:
    return (int(times_ns[-1]) - int(times_ns[0])) / NS_PER_S if len(times_ns) else 0.0


def _row(placement: Placement, moments: TimesNs, static: RadarScans) -> PlacementRow | None:
    """Return the row of a placement, with the frame nearest to its middle; None if no frame shows it."""
    first, last = np.searchsorted(moments, [placement.start, placement.end])
    if first >= last:
        return None
    middle = (int(placement.start) + int(placement.end)) // 2
    frame = int(first + np.argmin(np.abs(moments[first:last] - middle)))
    origin = int(moments[0])
    start_s, end_s = ((int(time) - origin) / NS_PER_S for time in (placement.start, placement.end))
    x_m, y_m, z_m = (round(float(value), 3) for value in placement.position_radar_m)
    stands_out_db = _stands_out_db(placement, static)
    return PlacementRow(
        start_s=start_s,
        end_s=end_s,
        frame=frame,
        range_m=float(np.linalg.norm(placement.position_radar_m)),
        score=placement.score,
        position_radar_m=(x_m, y_m, z_m),
        azimuth_deg=float(np.rad2deg(polar_from_cartesian(placement.position_radar_m)[1])),
        snr_db=None if np.isnan(placement.snr_db) else round(placement.snr_db, 1),
        stands_out_db=stands_out_db,
        note=placement_note(end_s - start_s, stands_out_db),
    )


def _stands_out_db(placement: Placement, static: RadarScans) -> float | None:
    """Return how far a placement is above the strong static returns elsewhere at its range while it stood; None if unknown."""
    meanwhile = static.between(placement.start, placement.end)
    ranges_m = np.linalg.norm(meanwhile.points_radar_m, axis=1)
    range_m = float(np.linalg.norm(placement.position_radar_m))
    apart_m = np.linalg.norm(meanwhile.points_radar_m - placement.position_radar_m, axis=1)
    near = (np.abs(ranges_m - range_m) < _AT_RANGE_M) & (apart_m > _OWN_RETURNS_M + _OWN_SHARE * range_m)
    others_db = meanwhile.snr_db[near & np.isfinite(meanwhile.snr_db)]
    if np.isnan(placement.snr_db) or not len(others_db):
        return None
    return round(placement.snr_db - float(np.quantile(others_db, _STRONG)), 1)


class _ActivitySum:
    """Counts scans and returns by slices of time.

    Args:
        moments: (m,) stamps of the frames [ns], ascending; of the scans if there are no frames.
    """

    def __init__(self, moments: TimesNs) -> None:
        length_s = max((int(moments[-1]) - int(moments[0])) / NS_PER_S, 1e-3)
        self._slices = max(1, min(_MOST_SLICES, int(length_s / 0.25)))
        self._step_s = length_s / self._slices
        self._origin = moments[0]
        self._returns, self._scans = np.zeros(self._slices), np.zeros(self._slices, dtype=np.int64)

        self._intervals_s: list[float] = []

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
        if len(times_ns) > 1:
            self._intervals_s.append(float(np.median(np.diff(times_ns))) / NS_PER_S)

    def rates(self) -> tuple[float, float]:
        """Return the mean number of returns per scan, and the number of scans per second, NaN if unknown."""
        returns = float(self._returns.sum() / max(self._scans.sum(), 1))
        interval_s = float(np.median(self._intervals_s)) if self._intervals_s else 0.0
        return returns, 1.0 / interval_s if interval_s > 0 else float("nan")

    def total(self) -> Activity:
        """Return the mean number of returns per scan in each slice."""
        return Activity(self._step_s, tuple(np.round(self._returns / np.maximum(self._scans, 1), 2).tolist()))


def placements_at(survey: Survey | None, time: int) -> Sequence[Placement]:
    """Return the placements that include a time [ns]."""
    if survey is None:
        return ()
    return [placement for placement in survey.placements if placement.start <= time <= placement.end]
