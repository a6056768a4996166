"""What the radar alone says about the whole recording: placements of the reflector, in words too, and returns from above."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, TimesNs, Values
from calib_core.association.gating import static_returns
from calib_core.association.placements import MOST_STATIC_RETURNS, Placement, find_placements, in_stretches
from calib_core.measurements import MIN_PAIRS, NS_PER_S, RadarScans, TimeNs
from calib_core.options import GatingOptions
from calib_core.radar import polar_from_cartesian
from cocalib.view.model import Figure
from cocalib.view.wording import plain
from cocalib.web.messages.space_messages import PlacementRow, Placements, RadarMap

_CELLS_ACROSS = 600
_SMALLEST_CELL_M = 0.2
_MOST_CELLS = 6000
_LEAST_SCANS = 3
"""A cell with returns in fewer scans is left out: it is noise."""
_LOW_QUANTILE, _HIGH_QUANTILE = 0.05, 0.995
_DB_STEPS = np.arange(-100.0, 160.0, 0.5)
_MOST_SLICES = 8000
_AT_RANGE_M = 1.0
_OWN_RETURNS_M, _OWN_SHARE = 0.5, 0.1
"""Returns this far from a placement belong to it [m], and this share of its range more: angles scatter."""
_STRONG = 0.9
SHORTEST_S = 2.0
"""A placement lasts at least this long [s]."""
_SHORT_S = 3.0
"""A click averages the returns of this time [s]; a shorter placement has fewer."""
_WITHOUT = "it can show a calibration, and judge it"
"""What a recording without placements is good for."""
_LITTLE_DB = 6.0
"""A reflector that stands out less may be taken for clutter."""


class RadarMapSum:
    """Counts static returns by square cells, a bounded number of scans at a time; memory does not grow with the recording."""

    def __init__(self, options: GatingOptions) -> None:
        self._cell_m = max(_SMALLEST_CELL_M, 2.0 * options.max_range_m / _CELLS_ACROSS)
        self._scans = 0
        self._shown = np.zeros(_CELLS_ACROSS**2, dtype=np.int64)
        self._returns = np.zeros(_CELLS_ACROSS**2)
        self._sum_z_m = np.zeros(_CELLS_ACROSS**2)
        self._measured = np.zeros(_CELLS_ACROSS**2)
        self._sum_db = np.zeros(_CELLS_ACROSS**2)
        self._histogram = np.zeros(len(_DB_STEPS) - 1, dtype=np.int64)

    def add(self, static: RadarScans) -> None:
        """Count the static returns of some scans; scans without any count too."""
        self._scans += len(static)
        places = np.floor(static.points_radar_m[:, :2] / self._cell_m) + _CELLS_ACROSS // 2
        inside = ((places >= 0) & (places < _CELLS_ACROSS)).all(axis=1)
        cell: Indices = (places[inside, 0] * _CELLS_ACROSS + places[inside, 1]).astype(np.int64)
        scan_and_cell = np.unique(static.scan_of_return()[inside] * _CELLS_ACROSS**2 + cell)
        self._shown += np.bincount(scan_and_cell % _CELLS_ACROSS**2, minlength=_CELLS_ACROSS**2)
        snr_db = static.snr_db[inside]
        known = np.isfinite(snr_db)
        self._returns += np.bincount(cell, minlength=_CELLS_ACROSS**2)
        self._sum_z_m += np.bincount(cell, weights=static.points_radar_m[inside, 2], minlength=_CELLS_ACROSS**2)
        self._measured += np.bincount(cell[known], minlength=_CELLS_ACROSS**2)
        self._sum_db += np.bincount(cell[known], weights=snr_db[known], minlength=_CELLS_ACROSS**2)
        self._histogram += np.histogram(snr_db[known], _DB_STEPS)[0]

    def total(self) -> RadarMap:
        """Return the cells that were seen most often."""
        seen = np.flatnonzero(self._shown >= _LEAST_SCANS)
        kept = np.sort(seen[np.argsort(-self._shown[seen], kind="stable")][:_MOST_CELLS])
        low_db, high_db = (self._quantile_db(share) for share in (_LOW_QUANTILE, _HIGH_QUANTILE))
        has_db = low_db < high_db  # equal amplitudes say nothing
        middle = (np.stack(np.divmod(kept, _CELLS_ACROSS)) - _CELLS_ACROSS // 2 + 0.5) * self._cell_m
        mean_db = self._sum_db[kept] / np.maximum(self._measured[kept], 1.0)
        return RadarMap(
            cell_m=self._cell_m,
            x_m=_numbers(middle[0], 3),
            y_m=_numbers(middle[1], 3),
            z_m=_numbers(self._sum_z_m[kept] / self._returns[kept], 3),
            share=_numbers(self._shown[kept] / max(self._scans, 1), 4),
            snr_db=_numbers(mean_db, 1) if has_db else (),
            low_db=low_db if has_db else None,
            high_db=high_db if has_db else None,
        )

    def _quantile_db(self, share: float) -> float:
        """Return the amplitude that this share of the returns is below; the lowest one without any."""
        summed = np.cumsum(self._histogram)
        return float(_DB_STEPS[int(np.searchsorted(summed, share * summed[-1]))])


def _numbers(values: Values, decimals: int) -> tuple[float, ...]:
    return tuple(np.round(values, decimals).tolist())


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
        placements = find_placements(self._static, self._options, min_dwell_s=SHORTEST_S)
        new = [
            (placement, row) for placement in placements if (row := _row(placement, moments, self._static)) is not None
        ]
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


def placement_note(lasted_s: float, stands_out_db: float | None) -> str:
    """Return what is unusual about a placement; "" if nothing is.

    Args:
        lasted_s: how long it stood still [s].
        stands_out_db: above the strongest other static returns; None if unknown.
    """
    notes = [f"lasted only {lasted_s:.1f} s"] if lasted_s < _SHORT_S else []
    if stands_out_db is not None and stands_out_db < _LITTLE_DB:
        notes.append(
            f"only {stands_out_db:.0f} dB above other returns"
            if stands_out_db >= 0
            else f"{-stands_out_db:.0f} dB weaker than other returns"
        )
    return ", ".join(notes)


def placement_summary(rows: Sequence[PlacementRow], length_s: float) -> str:
    """Return one line about all placements: how many, where, the strongest, and those to look at.

    Args:
        rows: the placements.
        length_s: of the recording [s].
    """
    if length_s < SHORTEST_S:
        return f"The recording is {length_s:.1f} s long, too short for a placement of {SHORTEST_S:.0f} s or longer: {_WITHOUT}"
    if not rows:
        return (
            f"No placement found: nothing appeared, stood still for {SHORTEST_S:.0f} s or longer, and went away again. If a "
            f"reflector stood all the time, open the recordings of all placements together; else {_WITHOUT}"
        )
    ranges = [row.range_m for row in rows]
    words = [
        f"{len(rows)} placement{'s' if len(rows) > 1 else ''} found, {min(ranges):.1f} to {max(ranges):.1f} m, "
        f"azimuth {_azimuths(rows)}"
    ]
    if len(rows) < MIN_PAIRS:
        words.append(f"a calibration needs at least {MIN_PAIRS}")
    known = [(row.snr_db, number) for number, row in enumerate(rows, start=1) if row.snr_db is not None]
    if known:
        words.append(f"strongest: placement {max(known)[1]}, {max(known)[0]:.0f} dB")
    odd = [f"placement {number} {row.note}" for number, row in enumerate(rows, start=1) if row.note]
    words += odd[:2]
    if len(odd) > 2:
        words.append(f"{len(odd) - 2} more to look at")
    return "; ".join(words)


def placement_figures(rows: Sequence[PlacementRow], returns_per_scan: float, scans_per_s: float) -> tuple[Figure, ...]:
    """Return the figures about a recording without images.

    Args:
        rows: the placements.
        returns_per_scan: mean number of returns.
        scans_per_s: scans per second; NaN if there are too few.
    """
    count = Figure(
        "placements", "placements", str(len(rows)), "", "Places where something appeared, stood still, and went away again.",
        "good" if len(rows) >= MIN_PAIRS else "warning",
    )  # fmt: skip
    ranges, known = [row.range_m for row in rows], [row.snr_db for row in rows if row.snr_db is not None]
    span = f"{min(ranges):.1f}–{max(ranges):.1f}" if rows else "–"
    strength = f"{min(known):.0f}–{max(known):.0f}" if known else "–"
    return (
        count,
        Figure("range", "range", span, "m", "Distance of the nearest and of the farthest placement from the radar."),
        Figure(
            "amplitude", "amplitude", strength, "dB", "Mean amplitude of the weakest and of the strongest placement."
        ),
        Figure("returns", "returns a scan", plain(returns_per_scan), "", "Mean number of returns of a radar scan."),
        Figure("rate", "scans", plain(scans_per_s), "Hz", "Radar scans per second."),
    )


def _azimuths(rows: Sequence[PlacementRow]) -> str:
    azimuths = [row.azimuth_deg for row in rows]
    return f"{_side(min(azimuths))} to {_side(max(azimuths))}"


def _side(azimuth_deg: float) -> str:
    rounded = round(azimuth_deg)
    return "0°" if rounded == 0 else f"{abs(rounded)}° {'left' if rounded > 0 else 'right'}"
