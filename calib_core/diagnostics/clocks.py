"""Clock offset: do both sensors use the same clock, as far as static placements can show?

While the reflector rests, radar and camera see the same scene whatever the clocks say: an offset that leaves every click
inside its dwell does no harm, and the pairs do not show it. What shows is a click whose reflector the radar does not see at
that moment, but only later or only earlier. One such click may be a mistimed one; several, all to the same side, mean a
clock offset, or a clicking habit with the same effect. With [a_i, b_i] the dwell around click i by the radar's stamps,
relative to the click, an offset s of the radar's stamps satisfies a_i <= s <= b_i.

Clocks that differ by a dwell or more give each click the return of another placement. Where placements follow a pattern, such
as the rows of a grid, that is a shift which most pairs agree on; only the ends of the rows do not. So where pairs disagree, the
clicks are also tried with the returns of the placements after and before their own: each such deal is a reading of the pairs,
and the likeliest is named (`marginal_likelihood`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Points3, TimesNs, Values
from calib_core.association.clustering import CLUSTER_SCALE
from calib_core.association.gating import static_returns
from calib_core.camera import Camera
from calib_core.estimation.best_fit import quick_fit
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.marginal_likelihood import log_marginal_likelihood
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.geometry import RigidTransform
from calib_core.measurements import NS_PER_S, Facts, Pair, RadarScans
from calib_core.options import CalibrationOptions, GatingOptions
from calib_core.radar import direction_cosines
from calib_core.results import Calibration, DataWarning, PairResult

CLOCK_CODES = ("clock-bias-suspected",)
"""Codes of the warnings that need the recording: pairs alone cannot show them."""

_LEAST_OUTSIDE = 3  # clicks: one or two may be mistimed themselves (a choice)
_LEAST_SHARE = 0.25  # of the clicks with a dwell: those outside it
_MOST_OTHER_SIDE = 0.1  # share of those outside that is to the other side
_TOLERANCE_S = 0.3  # the reflector is being put down, or one or two scans miss it
_LARGEST_GAP_S = 0.7  # a longer gap ends a dwell
_SHORTEST_DWELL_S = 0.5
_REACH = 1.5  # steps of CLUSTER_SCALE from the candidate to a return of the same reflector
_STEP_S = 0.05  # between the offsets tried: half the time between scans at 10 Hz
_AROUND_S = 4.0  # as far as the scans around a click reach by default
_MOST_STEPS = 3  # placements tried where the pose may be turned, which takes a fit each
_MOST_CHEAP_STEPS = 20  # where it is not: the longest row
_SCALES_APART_S = (
    ("TAI and UTC before July 2015", 35.0), ("TAI and UTC before 2017", 36.0), ("GPS time and UTC", 18.0), ("TAI and UTC", 37.0),
)  # fmt: skip
"""The likeliest last: of those that fit alike, the last is named."""
_WITHIN_DWELL_S = 4.0  # a reflector that stands still as long as it is asked to has stood for this long about a click
_LEAST_APART = 2
_LEAST_CLICKS = 8  # with a return in a deal, a choice: fewer agree with some pose by chance
_APART = 0.01  # probability that the clocks differ by placements, shared by all deals tried: a choice
_SOUND_SHARE = 0.6  # a pose with which more pairs agree than this, no noisier, may be off by a step, but is not turned
_SOUND_NOISE = 1.8  # times the assumed one
_SHIFT_ROUNDS = 8  # steps of reweighted least squares (Weiszfeld); a count of pairs needs no exact shift
_LEAST_ANGLE_RAD = np.deg2rad(0.1)  # added to each, so that no weight is infinite: less than a radar's noise
_NEAR_RAD = np.deg2rad(4.0)  # wide of the noise, because too small a count would leave a right deal untried (a choice)


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """The estimated offset of the radar's stamps, positive if they are ahead of the camera's.

    Attributes:
        least_s: smallest offset that puts the most clicks inside their dwells; negative: the radar's stamps lag.
        most_s: the largest such offset, limited by the scans around the clicks.
        outside: ids of the clicks outside their dwell.
        clicks: number of clicks with a dwell.
    """

    least_s: float
    most_s: float
    outside: tuple[str, ...]
    clicks: int

    @property
    def nearest_s(self) -> float:
        """The bound of smaller magnitude: the offset is at least this large."""
        return self.least_s if abs(self.least_s) < abs(self.most_s) else self.most_s


def clocks(calibration: Calibration, scans: RadarScans) -> list[DataWarning]:
    """Warn of a clock offset: by the radar's stamps, several clicks lie before, or after, their dwells.

    Args:
        calibration: its inlier pairs say which return was the reflector.
        scans: around the clicks, as given to the calibration.
    """
    offset = clock_offset(calibration.pairs, scans, calibration.options.gating)
    if offset is None:
        return []
    return [
        DataWarning(
            "clock-bias-suspected", {"ids": offset.outside, "clicks": offset.clicks, "offset_s": offset.nearest_s}
        )
    ]


def clocks_apart(
    pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions, fit: ErrorsInVariablesFit | None = None
) -> list[DataWarning]:
    """Warn if more clicks agree with the returns of placements after or before their own: the clocks differ by placements.

    Args:
        pairs: one for each placement, in order of time.
        camera: the intrinsics.
        options: of the solver.
        fit: the answer to them; None without one.
    """
    times = [pair.image_time for pair in pairs if pair.image_time is not None]
    if len(times) < len(pairs):
        return []
    agreeing = 0 if fit is None else int(fit.inliers.sum())
    sound = fit is not None and agreeing > _SOUND_SHARE * len(pairs) and fit.noise_scale.max() < _SOUND_NOISE
    if len(pairs) - agreeing < _LEAST_APART:
        return []
    least = max(_LEAST_CLICKS, agreeing)
    deals = [one for one in _deals(np.array(times, dtype=np.int64), sound=sound) if len(one.clicks) >= least]
    if not deals:
        return []
    rays = camera.rays(np.array([pair.pixel_px for pair in pairs]))
    points_m = np.array([pair.candidates[0].position_radar_m for pair in pairs])
    known = fit.camera_from_radar if fit is not None and sound else None
    as_given = 0.0 if fit is None else log_marginal_likelihood(pair_measurements(pairs, camera, options), fit)
    best, chosen = as_given - np.log(_APART / len(deals)), None
    facts: Facts = {}
    for tried in deals:
        clicks, seen = tried.clicks, tried.seen
        if known is not None and _most_once_shifted(rays[clicks], points_m[seen], known) < agreeing:
            continue
        moved = [replace(pairs[a], candidates=pairs[b].candidates) for a, b in zip(clicks, seen, strict=True)]
        measurements = pair_measurements(moved, camera, options)
        other = quick_fit(measurements, options, None)
        log_likelihood = -np.inf if other is None else log_marginal_likelihood(measurements, other)
        if other is not None and log_likelihood >= best:  # of deals alike, the time scale, which comes last
            best, chosen = log_likelihood, tried
            facts = {"shifted_agreeing": int(other.inliers.sum()), "shifted_clicks": len(clicks)}
    if chosen is None:
        return []
    named: Facts = {"scales": chosen.scales} if chosen.scales else {}
    away: Facts = {"placements": chosen.placements, "apart_s": chosen.apart_s}
    return [DataWarning("clocks-apart", {**facts, **away, "agreeing": agreeing, "clicks": len(pairs), **named})]


@dataclass(frozen=True, slots=True, eq=False)
class _Deal:
    """Clicks with the returns of other placements, as another clock of the radar would give them.

    Attributes:
        clicks: (n,) rows of the clicks.
        seen: (n,) rows of the pairs whose returns they get.
        placements: by how many placements these are later.
        apart_s: by how much later [s].
        scales: the time scales that are as far apart; "" if none are.
    """

    clicks: Indices
    seen: Indices
    placements: int
    apart_s: float
    scales: str = ""


def _deals(times_ns: TimesNs, *, sound: bool) -> Iterator[_Deal]:
    """Yield the deals to try: placement by placement, then the offsets between time scales."""
    rows, times_s = np.arange(len(times_ns)), (times_ns - times_ns[0]) / NS_PER_S
    for size in range(1, (_MOST_CHEAP_STEPS if sound else _MOST_STEPS) + 1):
        early, late = rows[:-size], rows[size:]
        apart_s = float(np.median(times_ns[late] - times_ns[early])) / NS_PER_S if len(late) else 0.0
        yield from (_Deal(early, late, size, apart_s), _Deal(late, early, -size, -apart_s))
    for scales, size_s in _SCALES_APART_S:
        for apart_s in (size_s, -size_s):
            away_s = np.abs(times_s[None, :] - times_s[:, None] - apart_s)
            nearest = away_s.argmin(axis=1)
            clicks = rows[away_s.min(axis=1) < _WITHIN_DWELL_S]
            seen = nearest[clicks]
            placements = int(np.median(seen - clicks)) if len(clicks) else 0
            if placements:
                yield _Deal(clicks, seen, placements, apart_s, scales)


def _most_once_shifted(rays: Points3, points_m: Points3, pose: RigidTransform) -> int:
    """Return about how many pairs can agree if the pose is shifted and not turned, which is what a grid's step does to it."""
    known = np.isfinite(rays).all(axis=1)  # the lens model has none outside its image
    rays, turned_m = rays[known], points_m[known] @ pose.rotation.T
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    weights = 1.0 / np.linalg.norm(turned_m, axis=1)
    for _ in range(_SHIFT_ROUNDS):  # the shift with the least sum of angles
        squared = across * (weights**2)[:, None, None]
        shift_m = -np.linalg.lstsq(squared.sum(axis=0), (squared @ turned_m[:, :, None]).sum(axis=0), rcond=None)[0][
            :, 0
        ]
        placed_m = turned_m + shift_m
        range_m = np.linalg.norm(placed_m, axis=1)
        angles = np.linalg.norm((across @ placed_m[:, :, None])[:, :, 0], axis=1) / range_m
        weights = 1.0 / (range_m * np.sqrt(angles + _LEAST_ANGLE_RAD))
    return int((angles < _NEAR_RAD).sum())


def clock_offset(pairs: Sequence[PairResult], scans: RadarScans, gating: GatingOptions) -> ClockOffset | None:
    """Find the offset that several clicks outside their dwells agree on; None if they do not agree, or there are none."""
    dwells = _dwells(pairs, scans, gating)
    if not len(dwells.ids):
        return None
    late, early = dwells.starts_s > _TOLERANCE_S, dwells.ends_s < -_TOLERANCE_S
    outside = late if late.sum() >= early.sum() else early
    count, other = int(outside.sum()), int((late | early).sum() - outside.sum())
    if count < max(_LEAST_OUTSIDE, _LEAST_SHARE * len(outside)) or other > _MOST_OTHER_SIDE * count:
        return None
    least_s, most_s = dwells.agreed_s()
    if least_s <= _TOLERANCE_S and most_s >= -_TOLERANCE_S:
        return None
    return ClockOffset(least_s, most_s, tuple(np.asarray(dwells.ids)[outside].tolist()), len(dwells.ids))


@dataclass(frozen=True, slots=True, eq=False)
class _Dwells:
    """The interval in which the radar sees the reflector of each click, relative to the click.

    Attributes:
        ids: of the clicks.
        starts_s: (n,).
        ends_s: (n,).
    """

    ids: tuple[str, ...]
    starts_s: Values
    ends_s: Values

    def agreed_s(self) -> tuple[float, float]:
        """Return the span of offsets that puts the most clicks inside their dwells."""
        tried = np.arange(self.starts_s.min(), self.ends_s.max() + _STEP_S, _STEP_S)
        inside = (self.starts_s[:, None] <= tried) & (tried <= self.ends_s[:, None])
        best = tried[inside.sum(axis=0) == inside.sum(axis=0).max()]
        return float(best[0]), float(best[-1])


def _dwells(pairs: Sequence[PairResult], scans: RadarScans, gating: GatingOptions) -> _Dwells:
    static = static_returns(scans, gating)
    steps = direction_cosines(static.points_radar_m) / CLUSTER_SCALE
    found = []
    for pair in pairs:
        if pair.inlier and pair.image_time is not None:
            dwell = _dwell(static, steps, direction_cosines(pair.point_radar_m) / CLUSTER_SCALE, pair.image_time)
            found.extend([] if dwell is None else [(pair.id, *dwell)])
    ids, starts, ends = zip(*found, strict=True) if found else ((), (), ())
    return _Dwells(ids, np.array(starts), np.array(ends))


def _dwell(static: RadarScans, steps: Points3, place: Values, click_ns: int) -> tuple[float, float] | None:
    """Return start and end [s after the click] of the presence at a place nearest to a click; None if it is too short."""
    rows = _rows_around(static, click_ns)
    near = ((steps[rows] - place) ** 2).sum(axis=1) <= _REACH**2
    owners = np.searchsorted(static.first_return, np.flatnonzero(near) + rows.start, side="right") - 1
    seen_s: Values = (np.unique(static.times_ns[owners]) - click_ns) / NS_PER_S
    if not len(seen_s):
        return None
    breaks = np.flatnonzero(np.diff(seen_s) > _LARGEST_GAP_S)
    starts, ends = seen_s[np.concatenate([[0], breaks + 1])], seen_s[np.append(breaks, len(seen_s) - 1)]
    long = ends - starts >= _SHORTEST_DWELL_S
    if not long.any():
        return None
    away = np.where(long, np.maximum(np.maximum(starts, -ends), 0.0), np.inf)
    nearest = int(np.argmin(away))
    return float(starts[nearest]), float(ends[nearest])


def _rows_around(static: RadarScans, click_ns: int) -> slice:
    times: TimesNs = static.times_ns
    reach_ns = int(_AROUND_S * NS_PER_S)
    first, last = np.searchsorted(times, [click_ns - reach_ns, click_ns + reach_ns])
    return slice(int(static.first_return[first]), int(static.first_return[last]))
