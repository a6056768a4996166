"""Residuals for the plots and the table, of the own pairs or at clicks, and what each plot shows, in a sentence from the data."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from calib_core.arrays import Flags, Points2, Points3, Values, freeze
from calib_core.evaluation.figures import ResidualFigures
from calib_core.measurements import ReflectorClick
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration, PairResult
from cocalib.report.plots import MarkKind
from cocalib.view.wording import plain

_NS_PER_S = 1e9
_FEWEST = 8
"""With fewer pairs a rank correlation shows nothing."""
_SURE = 0.01
"""Below this probability under chance alone a trend is named; it is shared among the trends that one plot could show."""


@dataclass(frozen=True, slots=True, eq=False)
class ResidualRows:
    """Residuals of n pairs.

    Attributes:
        ids: of the pairs.
        kinds: what became of each.
        points_radar_m: (n, 3) the radar positions.
        pixels_px: (n, 2) the clicks.
        projected_px: (n, 2) where the radar positions project; NaN if nowhere.
        times_s: (n,) since the first of them; NaN where unknown.
        expected_px: (n,) root mean square length under the noise model; NaN where there is none.
        held_out_px: (n,) distance to where the other pairs predict the click; NaN where unknown.
        outlier_probability: (n,) 0 to 1; NaN where unknown.
        influence: (n,) how far the pose moves without the pair, in standard deviations; NaN where unknown.
        solved_from: whether the calibration was solved from these clicks.
    """

    ids: tuple[str, ...]
    kinds: tuple[MarkKind, ...]
    points_radar_m: Points3
    pixels_px: Points2
    projected_px: Points2
    times_s: Values
    expected_px: Values
    held_out_px: Values
    outlier_probability: Values
    influence: Values
    solved_from: bool

    def __post_init__(self) -> None:
        freeze(
            self,
            points_radar_m=(None, 3),
            pixels_px=(None, 2),
            projected_px=(None, 2),
            times_s=(None,),
            expected_px=(None,),
            held_out_px=(None,),
            outlier_probability=(None,),
            influence=(None,),
        )

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def residuals_px(self) -> Points2:
        """Reprojection minus click: (n, 2)."""
        return np.asarray(self.projected_px - self.pixels_px)

    @property
    def lengths_px(self) -> Values:
        """(n,)."""
        return np.asarray(np.linalg.norm(self.residuals_px, axis=1))

    @property
    def ranges_m(self) -> Values:
        """(n,)."""
        return np.asarray(np.linalg.norm(self.points_radar_m, axis=1))

    @property
    def azimuths_deg(self) -> Values:
        """(n,) positive to the left."""
        return np.asarray(np.rad2deg(polar_from_cartesian(self.points_radar_m)[:, 1]))

    @property
    def elevations_deg(self) -> Values:
        """(n,) positive upwards."""
        return np.asarray(np.rad2deg(polar_from_cartesian(self.points_radar_m)[:, 2]))

    @property
    def drawn(self) -> Flags:
        """(n,) whether the residual is known."""
        return np.asarray(np.isfinite(self.lengths_px))

    @property
    def used(self) -> Flags:
        """(n,) whether it is known and agrees with the calibration."""
        return np.asarray(self.drawn & np.array([kind == "used" for kind in self.kinds], dtype=bool))

    @property
    def judged(self) -> Flags:
        """(n,) what trends are looked for in: the pairs that agree, or all that are not excluded if fewer than half agree."""
        counted = self.drawn & np.array([kind != "excluded" for kind in self.kinds], dtype=bool)
        return self.used if 2 * self.used.sum() >= counted.sum() else np.asarray(counted)


def rows_of_pairs(calibration: Calibration) -> ResidualRows:
    """Return the residuals of the calibration's own pairs, in their order."""
    pairs = calibration.pairs
    return ResidualRows(
        ids=tuple(pair.id for pair in pairs),
        kinds=tuple("excluded" if pair.excluded else "used" if pair.inlier else "disagrees" for pair in pairs),
        points_radar_m=np.array([pair.point_radar_m for pair in pairs]).reshape(-1, 3),
        pixels_px=np.array([pair.pixel_px for pair in pairs]).reshape(-1, 2),
        projected_px=np.array([pair.projected_px for pair in pairs]).reshape(-1, 2),
        times_s=_seconds([pair.image_time for pair in pairs]),
        expected_px=_values(pairs, _expected_px),
        held_out_px=_values(pairs, attrgetter("held_out_px")),
        outlier_probability=_values(pairs, attrgetter("outlier_probability")),
        influence=_values(pairs, attrgetter("influence")),
        solved_from=True,
    )


def rows_at_clicks(
    figures: ResidualFigures, clicks: Sequence[ReflectorClick], calibration: Calibration
) -> ResidualRows:
    """Return the residuals at the clicks of a recording; what the calibration states of the same clicks comes along."""
    times = {click.id: click.image_time for click in clicks}
    stated = {(pair.id, *pair.pixel_px.tolist()): pair for pair in calibration.pairs if not pair.excluded}
    same = [stated.get((id_, *place)) for id_, place in zip(figures.ids, figures.pixels_px.tolist(), strict=True)]
    return ResidualRows(
        ids=figures.ids,
        kinds=tuple("used" if inlier else "disagrees" for inlier in figures.inliers.tolist()),
        points_radar_m=figures.points_radar_m,
        pixels_px=figures.pixels_px,
        projected_px=figures.projected_px,
        times_s=_seconds([times.get(id_) for id_ in figures.ids]),
        expected_px=_values(same, _expected_px),
        held_out_px=np.full(len(figures.ids), np.nan) if figures.held_out is None else figures.held_out.distances_px,
        outlier_probability=_values(same, attrgetter("outlier_probability")),
        influence=_values(same, attrgetter("influence")),
        solved_from=2 * sum(pair is not None for pair in same) >= len(same) > 0,
    )


def _values(pairs: Sequence[PairResult | None], value_of: Callable[[PairResult], float]) -> Values:
    """Return one value of each pair; NaN where there is no pair."""
    return np.array([np.nan if pair is None else value_of(pair) for pair in pairs], dtype=np.float64)


def _expected_px(pair: PairResult) -> float:
    return float(np.sqrt(np.trace(pair.expected_covariance_px2)))


def _seconds(times: Sequence[int | None]) -> Values:
    """Return stamps as seconds since the first; NaN where there is none."""
    first = min((time for time in times if time is not None), default=0)
    return np.array([np.nan if time is None else (time - first) / _NS_PER_S for time in times], dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Trend:
    """Whether residual lengths grow or fall along a quantity.

    Attributes:
        correlation: Spearman's rank correlation.
        p_value: probability of one as large by chance.
        middle: the median of the quantity.
        below_px: root mean square length up to there.
        above_px: beyond.
    """

    correlation: float
    p_value: float
    middle: float
    below_px: float
    above_px: float


def trend(values: Values, lengths_px: Values) -> Trend | None:
    """Return how lengths (n,) go with values (n,); None if there are too few, or all values are the same."""
    known = np.isfinite(values) & np.isfinite(lengths_px)
    values, lengths_px = values[known], lengths_px[known]
    if len(values) < _FEWEST or np.ptp(values) == 0 or np.ptp(lengths_px) == 0:
        return None
    middle = float(np.median(values))
    upper = values > middle
    if not upper.any():
        return None
    correlation = float(np.corrcoef(_ranks(values), _ranks(lengths_px))[0, 1])
    return Trend(
        correlation, _p_value(correlation, len(values)), middle, _rms(lengths_px[~upper]), _rms(lengths_px[upper])
    )


def range_sentence(rows: ResidualRows) -> str:
    """Say whether residuals go with range."""
    found = trend(rows.ranges_m[rows.judged], rows.lengths_px[rows.judged])
    if found is None:
        return _too_few(rows)
    where = f"{plain(found.below_px)} px (RMS) up to {plain(found.middle)} m and {plain(found.above_px)} px beyond"
    expected = _expected_halves(rows, found.middle)
    if found.p_value >= _SURE:
        return f"No trend with range: {where}{_chance(found)}{expected}."
    if found.correlation > 0:
        return f"Residuals grow with range: {where}{_chance(found)}{expected}; look at the farthest pairs first."
    return f"Residuals shrink with range: {where}{_chance(found)}{expected}; an error of the camera's position shows like this."


def azimuth_sentence(rows: ResidualRows) -> str:
    """Say whether residuals go with azimuth, from right to left or from the middle to both sides."""
    azimuths, lengths = rows.azimuths_deg[rows.judged], rows.lengths_px[rows.judged]
    sideways, outwards = trend(azimuths, lengths), trend(np.abs(azimuths), lengths)
    if sideways is None or outwards is None:
        return _too_few(rows)
    found = min(sideways, outwards, key=_p_of)
    if found.p_value >= _SURE / 2:
        return f"No trend with azimuth, neither to one side nor to both{_chance(found)}."
    halves = f"{plain(found.below_px)} and {plain(found.above_px)} px (RMS)"
    if found is outwards:
        way = "grow" if found.correlation > 0 else "shrink"
        return (
            f"Residuals {way} to both sides: {halves} within and beyond {plain(found.middle)} deg{_chance(found)}; "
            "errors of the radar's angles or of the lens show like this."
        )
    side = "left" if found.correlation > 0 else "right"
    return f"Residuals grow to the {side}: {halves} right and left of {plain(found.middle)} deg{_chance(found)}."


def place_sentence(rows: ResidualRows, image_size_px: tuple[int, int]) -> str:
    """Say whether residuals go with the place in the image: along columns, rows, or the distance from its middle."""
    pixels, lengths = rows.pixels_px[rows.judged], rows.lengths_px[rows.judged]
    centre = (np.array(image_size_px) - 1) / 2
    ways = (
        (pixels[:, 0], "to the right edge", "to the left edge"),
        (pixels[:, 1], "to the lower edge", "to the upper edge"),
        (
            np.linalg.norm(pixels - centre, axis=1),
            "away from the middle of the image",
            "toward the middle of the image",
        ),
    )
    tried = [(found, up, down) for values, up, down in ways if (found := trend(values, lengths)) is not None]
    if not tried:
        return _too_few(rows)
    found, up, down = min(tried, key=lambda one: one[0].p_value)
    if found.p_value >= _SURE / 3:
        return f"No trend across the image: along columns, along rows, from the middle outwards{_chance(found)}."
    where = up if found.correlation > 0 else down
    cause = (
        "; a wrong distortion of the lens shows like this" if up.startswith("away") and found.correlation > 0 else ""
    )
    halves = sorted((found.below_px, found.above_px))
    return f"Residuals grow {where}: from {plain(halves[0])} to {plain(halves[1])} px (RMS of halves){_chance(found)}{cause}."


def time_sentence(rows: ResidualRows) -> str:
    """Say whether residuals go with time."""
    if not np.isfinite(rows.times_s[rows.judged]).any():
        return "The pairs have no stamps, so nothing can be said about time."
    found = trend(rows.times_s[rows.judged], rows.lengths_px[rows.judged])
    if found is None:
        return _too_few(rows)
    where = (
        f"{plain(found.below_px)} px (RMS) in the first {plain(found.middle)} s and {plain(found.above_px)} px after"
    )
    if found.p_value >= _SURE:
        return f"No trend with time: {where}{_chance(found)}."
    way = "grow" if found.correlation > 0 else "shrink"
    return (
        f"Residuals {way} with time: {where}{_chance(found)}; a sensor that moved or clocks that drift show like this."
    )


def shift_sentence(rows: ResidualRows) -> str:
    """Say whether the residuals lean to one side together (Hotelling's test of their mean)."""
    residuals = rows.residuals_px[rows.judged]
    n = len(residuals)
    if n < _FEWEST:
        return _too_few(rows)
    mean = residuals.mean(axis=0)
    covariance = np.cov(residuals.T)
    if np.linalg.matrix_rank(covariance, hermitian=True) < 2:
        return f"The residuals lie on one line; their mean is {_place(mean)} px."
    from scipy.special import fdtrc

    squared = n * float(mean @ np.linalg.solve(covariance, mean))
    p = float(fdtrc(2, n - 2, squared * (n - 2) / (2 * (n - 1))))
    if p >= _SURE:
        return (
            f"The residuals share no direction: their mean, {_place(mean)} px to the right and down, is within chance "
            f"(p = {p:.2g})."
        )
    return (
        f"The residuals lean together by {_place(mean)} px to the right and down (p = {p:.2g}): "
        "the pose does not take out a shift that all of them share."
    )


def _p_of(found: Trend) -> float:
    return found.p_value


def _place(mean: np.ndarray) -> str:
    return f"({plain(float(mean[0]), 2)}, {plain(float(mean[1]), 2)})"


def _chance(found: Trend) -> str:
    return f" (rank correlation {found.correlation:.2f}, p = {found.p_value:.2g})"


def _expected_halves(rows: ResidualRows, middle: float) -> str:
    """Return what the noise model expects of the two halves of the ranges; nothing without one."""
    expected = rows.expected_px[rows.judged]
    if not np.isfinite(expected).all():
        return ""
    upper = rows.ranges_m[rows.judged] > middle
    return f"; the noise model expects {plain(_rms(expected[~upper]))} and {plain(_rms(expected[upper]))} px"


def _too_few(rows: ResidualRows) -> str:
    n = int(rows.judged.sum())
    if n >= _FEWEST:
        return f"The {n} clicks do not differ enough here to show a trend."
    return f"{n} {'click is' if n == 1 else 'clicks are'} too few to show a trend; {_FEWEST} or more are needed."


def _ranks(values: Values) -> Values:
    """Return ranks from 0, equal values with their mean rank."""
    _, places, counts = np.unique(values, return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    return np.asarray((ends - (counts + 1) / 2.0)[places])


def _p_value(correlation: float, n: int) -> float:
    """Return the two-sided probability of a rank correlation this large by chance (Student's t)."""
    from scipy.special import stdtr

    if abs(correlation) >= 1.0:
        return 0.0
    t = abs(correlation) * np.sqrt((n - 2) / (1.0 - correlation**2))
    return float(2.0 * stdtr(n - 2, -t))


def _rms(lengths_px: Values) -> float:
    return float(np.sqrt(np.mean(lengths_px**2)))
