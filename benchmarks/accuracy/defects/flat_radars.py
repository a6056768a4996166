"""Radars without elevation: are new placements predicted as well as by Algorithm 1?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from benchmarks.accuracy.defects.adversaries import draw_flat
from benchmarks.accuracy.figures import Measured, at_most, column, fewest, share, summed_up
from benchmarks.accuracy.outcomes import outcome_figures
from benchmarks.accuracy.rows import Figures, Kept, Part, Row, Section
from benchmarks.simulated_pairs import NoiseName, SimulatedPairs
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration

__all__ = ["ROWS", "measure_flat", "section"]

_TRIALS = 300
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_COUNTS = (5, 6, 8, 10, 15)
_HELD_OUT = 20
_MEDIAN, _TENTH = 1.0, 1.1  # largest ratios of the medians and of the 90 % points
_RESAMPLED = 200


@dataclass(frozen=True, slots=True)
class _Flat:
    """Noise and number of pairs."""

    noise: NoiseName
    pairs: int

    @property
    def key(self) -> str:
        """A file name."""
        return f"flat-{self.noise}-{self.pairs}"


_CASES = tuple(_Flat(noise, pairs) for noise, pairs in product(_NOISES, _COUNTS))


def measure_flat(noise: NoiseName, pairs: int, trial: int) -> Figures:
    """Solve one set by both methods, and measure both on placements that neither has used."""
    everything = draw_flat(np.random.default_rng([2033, pairs, trial]), pairs + _HELD_OUT, noise=noise)
    used = everything.pairs[:pairs]
    ours = calibrate_pairs(used, everything.camera, CalibrationOptions())
    paper = calibrate_pairs(used, everything.camera, CalibrationOptions(method="paper"))
    return outcome_figures(ours, everything.camera_from_radar) | {
        "ours_px": _held_out_px(everything, pairs, ours),
        "paper_px": _held_out_px(everything, pairs, paper),
    }


def _held_out_px(everything: SimulatedPairs, pairs: int, outcome: object) -> float | None:
    """Return the AED over the placements after the first ones; None without a pose."""
    if not isinstance(outcome, Calibration):
        return None
    rest = everything.pairs[pairs:]
    projected_px = outcome.reproject(np.array([pair.candidates[0].position_radar_m for pair in rest]))
    away_px = np.linalg.norm(projected_px - np.array([pair.pixel_px for pair in rest]), axis=1)
    return float(away_px.mean()) if np.isfinite(away_px).all() else None


ROWS = tuple(Row(case.key, _TRIALS, partial(measure_flat, case.noise, case.pairs)) for case in _CASES)


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, verdicts = [], []
    for case in _CASES:
        trials = kept.get(case.key, ())
        if np.isfinite(column(trials, "paper_px")).sum() < 2:
            continue
        paper_px = column(trials, "paper_px")
        both = [one for one, value in zip(trials, paper_px, strict=True) if np.isfinite(value)]
        points = [_points(both, level) for level in (0.5, 0.9)]
        ratios = [_ratio(both, level) for level in (0.5, 0.9)]
        judged = [at_most(ratio, aim) for ratio, aim in zip(ratios, (_MEDIAN, _TENTH), strict=True)]
        verdicts += judged
        squared, quantile = column(trials, "squared"), column(trials, "quantile")
        covered = share(np.where(np.isfinite(squared), squared <= quantile, np.nan))
        shown = [f"{ours:.1f} / {paper:.1f} px" for ours, paper in points]
        what = (case.noise, str(case.pairs), str(len(trials)))
        told = (*map(str, ratios), f"{_MEDIAN:g} / {_TENTH:g}", " / ".join(judged))
        what = (*what, f"{np.isnan(paper_px).mean():.0%}")
        cells.append((*what, shown[0], shown[1], *told, covered.percent))
    head = (
        *(
            "noise",
            "pairs",
            "trials",
            "paper without a pose",
            "median, ours / paper",
            "90 % point, ours / paper",
            "ratio of medians",
        ),
        *("ratio of 90 % points", "aim", "", "c"),
    )
    aim = "2D radars: held-out residual, median at most 1.0 and 90 % point at most 1.1 times Algorithm 1's"
    claim = summed_up(aim, verdicts, fewest(kept, [row.key for row in ROWS]))
    title = "Radars without elevation: how well are new placements predicted?"
    return Section(title, _TEXT, (Part("", head, tuple(cells)),), (claim,))


def _points(trials: Sequence[Figures], level: float) -> tuple[float, float]:
    """Return a quantile of our residuals and of Algorithm 1's."""
    return _quantile(column(trials, "ours_px"), level), _quantile(column(trials, "paper_px"), level)


def _ratio(trials: Sequence[Figures], level: float) -> Measured:
    """Return the ratio of two quantiles over the same sets; its two standard errors are those of resampled sets."""
    rng = np.random.default_rng(1)
    rows = rng.integers(len(trials), size=(_RESAMPLED, len(trials)))
    ours, paper = column(trials, "ours_px"), column(trials, "paper_px")
    drawn = [_quantile(ours[some], level) / _quantile(paper[some], level) for some in rows]
    best, other = _points(trials, level)
    return Measured(best / other, float(2.0 * np.std(drawn)) if np.isfinite(drawn).all() else float("inf"))


def _quantile(values_px: np.ndarray, level: float) -> float:
    """Return a quantile; a trial without a figure counts as infinitely bad."""
    return float(np.quantile(np.where(np.isfinite(values_px), values_px, np.inf), level, method="lower"))


_TEXT = """Field scene, camera position free, no wrong pairs. The radar reports elevation 0; its tilt (10 deg) and its height
above the ground (1 m, at least 0.2 m) are drawn for every set, so that all placements are in view. Residuals are those of 20
placements that were not used, in reported radar coordinates, with `--method paper` at its defaults, over the sets in which it
has a pose. A set in which only ours has none, or puts a placement behind the camera, counts as infinitely bad. `c` is the
coverage of the stated 95 % ellipsoid."""
