"""Radars without elevation: are new placements predicted as well as by Algorithm 1?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from benchmarks.accuracy.defects.adversaries import draw_flat
from benchmarks.accuracy.figures import Measured, at_least, at_most, column, low, share, tally
from benchmarks.accuracy.outcomes import inside, outcome_figures
from benchmarks.accuracy.rows import Figures, Kept, Row, Section
from benchmarks.simulated_pairs import NoiseName, SimulatedPairs
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration

_TRIALS = 40
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_COUNTS = (5, 8, 15)
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


ROWS = tuple(
    Row(case.key, _TRIALS, partial(measure_flat, case.noise, case.pairs), draws) for draws, case in enumerate(_CASES)
)


def section(kept: Kept) -> Section:
    """Judge each row."""
    rows, judged, covered, outside = [], [], [], []
    for case in _CASES:
        trials, name = kept.get(case.key, ()), f"{case.noise} {case.pairs}"
        both = [one for one in trials if one["paper_px"] is not None]
        if len(both) < 2:
            continue
        ratios = [_ratio(both, level) for level in (0.5, 0.9)]
        verdicts = [at_most(one, aim) for one, aim in zip(ratios, (_MEDIAN, _TENTH), strict=True)]
        held = share(inside(trials))
        judged += [(name, f"{one.value:.2f}", verdict) for one, verdict in zip(ratios, verdicts, strict=True)]
        covered.append((name, f"{held.value:.0f} %", at_least(held, 95.0)))
        outside += [f"without elevation, {name} ({held.value:.0f} %)"] if low(held) else []
        shown = ["{:.1f} / {:.1f}".format(*_points(both, level)) for level in (0.5, 0.9)]
        rows.append(
            {"row": name, "sets": str(len(trials)), "paper without a pose": f"{1.0 - len(both) / len(trials):.0%}"}
            | {"median [px], ours / paper": shown[0], "90 % point [px], ours / paper": shown[1]}
            | {"ratio of medians": str(ratios[0]), "of 90 % points": str(ratios[1])}
            | {"aim": f"{_MEDIAN:g} / {_TENTH:g}", "verdict": " / ".join(verdicts)}
            | {"inside 95 %": held.percent, "aim inside": "95 %", "inside": covered[-1][2]}
        )
    claims = (
        tally("residual on new placements over Algorithm 1's: median at most 1, 90 % point at most 1.1", judged),
        tally("truth inside the stated 95 % in 95 %", covered),
    )
    title = "Radars without elevation: how well are new placements predicted?"
    return Section(title, _TEXT, claims, tuple(rows), tuple(outside))


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


_TEXT = """No wrong pairs, camera position not measured; tilt (10 deg) and height (1 m) are drawn. Residuals are those of 20
placements that were not used, over the sets in which `--method paper` has a pose."""
