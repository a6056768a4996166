"""Residuals for the plots and the table: of the own pairs or at clicks."""

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

_NS_PER_S = 1e9


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
        """(n,) what counts in sentences: the pairs that agree, or all that are not excluded if fewer than half agree."""
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
        held_out_px=np.full(len(figures.ids), np.nan) if figures.held_out is None else figures.held_out.distances_px,
        outlier_probability=_values(same, attrgetter("outlier_probability")),
        influence=_values(same, attrgetter("influence")),
        solved_from=2 * sum(pair is not None for pair in same) >= len(same) > 0,
    )


def _values(pairs: Sequence[PairResult | None], value_of: Callable[[PairResult], float]) -> Values:
    """Return one value of each pair; NaN where there is no pair."""
    return np.array([np.nan if pair is None else value_of(pair) for pair in pairs], dtype=np.float64)


def _seconds(times: Sequence[int | None]) -> Values:
    """Return stamps as seconds since the first; NaN where there is none."""
    first = min((time for time in times if time is not None), default=0)
    return np.array([np.nan if time is None else (time - first) / _NS_PER_S for time in times], dtype=np.float64)
