"""What the radar alone tells about the whole recording: where the reflector stood still, and how much there was to see."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.web.messages import PlacementRow
from calib_core.arrays import TimesNs
from calib_core.measurements import NS_PER_S, RadarScans
from calib_core.options import GatingOptions
from calib_core.placements import Placement, find_placements

__all__ = ["Activity", "Survey", "placements_at", "survey_of"]

_MOST_SLICES = 800


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
        placements: where the reflector stood still, those without a frame left out.
        rows: the same as the page shows them.
        activity: of the radar.
    """

    placements: tuple[Placement, ...]
    rows: tuple[PlacementRow, ...]
    activity: Activity


def survey_of(scans: RadarScans, image_times: TimesNs, options: GatingOptions) -> Survey:
    """Survey a whole recording.

    Args:
        scans: all of them.
        image_times: (m,) stamps of the frames [ns], ascending.
        options: which returns can be the reflector.
    """
    seen = [
        (placement, row)
        for placement in find_placements(scans, options)
        if (row := _row(placement, image_times)) is not None
    ]
    placements, rows = tuple(pair[0] for pair in seen), tuple(pair[1] for pair in seen)
    return Survey(placements, rows, _activity(scans, image_times))


def _row(placement: Placement, image_times: TimesNs) -> PlacementRow | None:
    """Return the line of a placement, with the frame nearest to its middle; None when no frame shows it."""
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


def _activity(scans: RadarScans, image_times: TimesNs) -> Activity:
    length_s = max((int(image_times[-1]) - int(image_times[0])) / NS_PER_S, 1e-3)
    slices = max(1, min(_MOST_SLICES, int(length_s / 0.25)))
    step_s = length_s / slices
    place = ((scans.times_ns - image_times[0]) / NS_PER_S // step_s).astype(np.int64)
    inside = (place >= 0) & (place < slices)
    returns = np.bincount(place[inside], weights=np.diff(scans.first_return)[inside], minlength=slices)
    count = np.bincount(place[inside], minlength=slices)
    return Activity(step_s, tuple(np.round(returns / np.maximum(count, 1), 2).tolist()))


def placements_at(survey: Survey | None, time: int) -> Sequence[Placement]:
    """Return the placements that a moment [ns] lies in."""
    if survey is None:
        return ()
    return [placement for placement in survey.placements if placement.start <= time <= placement.end]
