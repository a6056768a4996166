"""With the errors that all pairs of a set share, drawn from their stated priors: does the stated uncertainty hold?"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.accuracy.cases import exact_instruments, tape_measured
from benchmarks.accuracy.figures import Measured, at_most, column, fewest, joined, ratio, share, summed_up, within
from benchmarks.accuracy.outcomes import outcome_figures
from benchmarks.accuracy.rows import Claim, Figures, Kept, Part, Row, Section
from benchmarks.simulated_pairs import (
    FIELD,
    NOISE_PROFILES,
    NoiseName,
    SimulatedPairs,
    SystematicErrors,
    draw_systematic_errors,
    simulate_pairs,
)
from calib_core.calibration import calibrate_pairs
from calib_core.measurements import Candidate
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar, polar_from_cartesian, sigma_polar_of
from calib_core.synthetic.scene.scenes import PairsLayout

__all__ = [
    "CLEAN_ROWS",
    "ROWS",
    "Shared",
    "clean_section",
    "draw_shared",
    "inside",
    "measure_clean",
    "measure_shared",
    "section",
]

_TRIALS, _CLEAN_TRIALS = 400, 200
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_COUNTS = (12, 20, 40)
_FREE_AISLE = PairsLayout(max_range_m=20.0, max_lateral_m=1.0)
_SHARPNESS, _ROTATION_COST = 1.15, 1.1
_POSITION_COST = {"ti": 1.4, "imaging": 1.9}
_BASELINE = Path(__file__).with_name("baseline.json")


@dataclass(frozen=True, slots=True)
class Shared:
    """What is drawn, and whether the camera position is given."""

    noise: NoiseName
    pairs: int
    tape_m: float | None
    outlier_share: float = 0.1
    aisle: bool = False
    errors: bool = True
    """Whether the errors that all pairs share are drawn; otherwise the instruments are exact."""
    smooth_share: float = 0.0
    """Share of the variance of the radar's angles that neighbouring directions have in common; the sum is as stated."""

    @property
    def key(self) -> str:
        """A file name."""
        place, known = "aisle" if self.aisle else "field", "free" if self.tape_m is None else "tape"
        smooth = f"-smooth-{self.smooth_share:.0%}" if self.smooth_share else ""
        return f"{place}-{self.noise}-{self.pairs}-{self.outlier_share:.0%}-{known}{smooth}".replace("%", "pc")


_FIELD_CASES = tuple(Shared(noise, pairs, tape_m) for tape_m, noise, pairs in product((0.01, None), _NOISES, _COUNTS))
_AISLE_CASES = (Shared("ti_aisle", 20, None, 0.3, aisle=True), Shared("ti_aisle", 40, None, 0.5, aisle=True))
_CASES = (*_FIELD_CASES, *_AISLE_CASES)
_CLEAN = tuple(Shared(one.noise, one.pairs, one.tape_m, errors=False) for one in _FIELD_CASES)


def draw_shared(case: Shared, trial: int) -> SimulatedPairs:
    """Draw one trial; with and without shared errors it has the same rig, placements and noise."""
    errors = draw_systematic_errors(np.random.default_rng([2031, trial])) if case.errors else SystematicErrors()
    rng, noise = np.random.default_rng([2030, trial]), NOISE_PROFILES[case.noise]
    left = (1.0 - case.smooth_share) ** 0.5
    independent = replace(
        noise,
        sigma_azimuth_deg=left * noise.sigma_azimuth_deg,
        sigma_elevation_deg=left * noise.sigma_elevation_deg,
    )
    simulated = simulate_pairs(
        case.pairs,
        rng=rng,
        noise=independent,
        outlier_share=case.outlier_share,
        layout=_FREE_AISLE if case.aisle else FIELD,
        systematic=errors,
    )
    return with_smooth_errors(simulated, rng, noise, case.smooth_share) if case.smooth_share else simulated


_LENGTHS_DEG = (10.0, 40.0)


def with_smooth_errors(
    simulated: SimulatedPairs, rng: np.random.Generator, noise: NoiseOptions, share: float
) -> SimulatedPairs:
    """Add to all candidates angle errors that are a Gaussian process over direction, with this share of the stated variance."""
    directions = polar_from_cartesian(simulated.points_radar_m)[:, 1:]
    length = np.deg2rad(rng.uniform(*_LENGTHS_DEG))
    apart = ((directions[:, None] - directions[None]) ** 2).sum(axis=2)
    root = np.linalg.cholesky(np.exp(-0.5 * apart / length**2) + 1e-8 * np.eye(len(directions)))
    sigma_polar = sigma_polar_of(noise)
    off = share**0.5 * sigma_polar * (root @ rng.standard_normal((len(directions), 3)))
    off[:, 0] = 0.0

    def moved(candidate: Candidate, by: np.ndarray) -> Candidate:
        position = cartesian_from_polar(polar_from_cartesian(candidate.position_radar_m[None]) + by)
        (covariance,) = covariance_from_sigma_polar(position, sigma_polar[None])
        return replace(candidate, position_radar_m=position[0], sigma_polar=sigma_polar, covariance_m2=covariance)

    pairs = tuple(
        replace(pair, candidates=tuple(moved(candidate, by) for candidate in pair.candidates))
        for pair, by in zip(simulated.pairs, off, strict=True)
    )
    return replace(simulated, pairs=pairs)


def measure_shared(case: Shared, trial: int) -> Figures:
    """Solve one trial with the default options."""
    simulated = draw_shared(case, trial)
    options = CalibrationOptions(solving=tape_measured(case.tape_m))
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, options)
    return outcome_figures(outcome, simulated.camera_from_radar)


def measure_clean(case: Shared, trial: int) -> Figures:
    """Solve one trial without shared errors twice: with the default options, and told that the instruments are exact."""
    simulated = draw_shared(case, trial)
    options = CalibrationOptions(solving=tape_measured(case.tape_m))
    truth = simulated.camera_from_radar
    exact = outcome_figures(calibrate_pairs(simulated.pairs, simulated.camera, exact_instruments(options)), truth)
    return outcome_figures(calibrate_pairs(simulated.pairs, simulated.camera, options), truth) | {
        f"exact {name}": value for name, value in exact.items()
    }


def _key(case: Shared) -> str:
    return f"shared-{case.key}"


def _clean_key(case: Shared) -> str:
    return f"clean-{case.key}"


ROWS = tuple(Row(_key(case), _TRIALS, partial(measure_shared, case)) for case in _CASES)
CLEAN_ROWS = tuple(Row(_clean_key(case), _CLEAN_TRIALS, partial(measure_clean, case)) for case in _CLEAN)


def _position_aim(case: Shared) -> float | None:
    """Return the largest RMSE of the position over that of the version before shared errors were estimated."""
    if case.aisle or (case.tape_m is not None and (case.noise == "ti" or case.pairs < 20)):
        return None
    if case.noise == "imaging":
        return 0.55 if case.tape_m is None else 0.7
    return 0.85 if case.pairs >= 20 else None


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, verdicts = [], _Verdicts([], [], [])
    before = _baseline()
    for case in _CASES:
        trials = kept.get(_key(case), ())
        if len(trials) > 1:
            cells.append(_cells(case, trials, before, verdicts))
    head = (
        *("scene", "noise", "pairs", "wrong", "camera position", "trials", "c", ""),
        *("rotation", "position", "stated over RMSE", "", "position over c35a642", "aim", ""),
    )
    return Section(
        "With the errors that all pairs share: does the stated uncertainty hold?",
        _TEXT,
        (Part("", head, tuple(cells)),),
        verdicts.claims(fewest(kept, [row.key for row in ROWS])),
    )


@dataclass(frozen=True, slots=True)
class _Verdicts:
    """Verdicts gathered row by row."""

    covered: list[str]
    sharp: list[str]
    better: list[str]

    def claims(self, trials: str) -> tuple[Claim, ...]:
        """Return the three aims."""
        return (
            summed_up("shared errors drawn: the 95 % ellipsoid contains the truth in 93 to 97 %", self.covered, trials),
            summed_up("shared errors drawn: mean stated sigma at most 1.15 times the RMSE", self.sharp, trials),
            summed_up("shared errors drawn: RMSE of the position over that of c35a642", self.better, trials),
        )


def _cells(
    case: Shared, trials: Sequence[Figures], before: Mapping[str, float], verdicts: _Verdicts
) -> tuple[str, ...]:
    covered = share(inside(trials))
    verdict = within(covered, 93.0, 97.0)
    verdicts.covered.append(verdict)
    sharpness = [_stated_over_rmse(trials, f"stated_{unit}", name) for unit, name in _ERRORS]
    sharp = [at_most(one, _SHARPNESS) for one in sharpness]
    verdicts.sharp.extend(sharp)
    rotation_deg, position_cm = np.rad2deg(_rmse(trials, "rotation_rad")), 100.0 * _rmse(trials, "position_m")
    aim, better, gain = _position_aim(case), "", "-"
    if _key(case) in before:
        limit_m = before[_key(case)]
        compared = ratio(column(trials, "position_m"), np.full(len(trials), limit_m))
        gain, better = str(compared), "" if aim is None else at_most(compared, aim)
        verdicts.better.extend([better] if better else [])
    known = "free" if case.tape_m is None else "1 cm"
    return (
        *("aisle" if case.aisle else "field", case.noise, str(case.pairs), f"{case.outlier_share:.0%}", known),
        *(str(len(trials)), covered.percent, verdict, f"{rotation_deg:.2f} deg", f"{position_cm:.1f} cm"),
        *(" / ".join(map(str, sharpness)), joined(sharp), gain, "" if aim is None else f"{aim:g}", better),
    )


_ERRORS = (("rad", "rotation_rad"), ("m", "position_m"))


def inside(trials: Sequence[Figures]) -> np.ndarray:
    """Flag the trials whose truth lies inside the stated 95 % ellipsoid; NaN without a pose."""
    squared, quantile = column(trials, "squared"), column(trials, "quantile")
    return np.where(np.isfinite(squared), squared <= quantile, np.nan)


def _rmse(trials: Sequence[Figures], name: str) -> float:
    return float(np.sqrt(np.nanmean(column(trials, name) ** 2)))


def _stated_over_rmse(trials: Sequence[Figures], stated: str, name: str) -> Measured:
    """Return the mean stated sigma over the RMSE; two standard errors from those of the mean of the squares."""
    sigmas, errors = column(trials, stated), column(trials, name)
    used = np.isfinite(sigmas) & np.isfinite(errors)
    if used.sum() < 2:
        return Measured(float("nan"), float("nan"))
    squares = errors[used] ** 2
    value = float(sigmas[used].mean() / np.sqrt(squares.mean()))
    return Measured(value, float(value * np.std(squares, ddof=1) / np.sqrt(used.sum()) / squares.mean()))


def _baseline() -> dict[str, float]:
    """Return the RMSE of the position [m] of c35a642 on fixed draws, by row."""
    if not _BASELINE.is_file():
        return {}
    return dict(json.loads(_BASELINE.read_text(encoding="utf-8"))["position_rmse_m"])


_TEXT = """Scale errors of azimuth and elevation, bias and scale of the range, focal length, principal point and distortion,
an offset of all clicks and of the reflector's clicked point are drawn for every set from the standard deviations that the
options state (`cocalib solve --help`), and the estimator is given the default options. `c` is the share of trials whose true
pose lies inside the stated 95 % ellipsoid. "Stated over RMSE" is the mean stated sigma over the RMSE, for rotation and
position: well below 1 is overconfident, above 1.15 is too cautious. The last ratio compares the RMSE of the position with that
of an earlier version (c35a642), which took radar and lens to be exact, on the fixed draws (`baseline.json`). The aisle is 2 m
wide and 2 to 20 m long; a single draw without a usable pose can decide its RMSE."""


def clean_section(kept: Kept) -> Section:
    """Write the table of what the default options cost where nothing is wrong."""
    cells, verdicts = [], []
    for case in _CLEAN:
        trials = kept.get(_clean_key(case), ())
        if len(trials) < 2:
            continue
        aims = (_ROTATION_COST, _POSITION_COST[case.noise])
        costs = [ratio(column(trials, name), column(trials, f"exact {name}")) for _, name in _ERRORS]
        judged = [at_most(cost, aim) for cost, aim in zip(costs, aims, strict=True)]
        verdicts += judged
        known = "free" if case.tape_m is None else "1 cm"
        covered = share(inside(trials)).percent
        what = (case.noise, str(case.pairs), known, str(len(trials)))
        cells.append((*what, *map(str, costs), " / ".join(f"{aim:g}" for aim in aims), joined(judged), covered))
    head = ("noise", "pairs", "camera position", "trials", "rotation", "position", "aim", "", "c")
    aim = "nothing wrong: default options cost at most 1.1 times in rotation, 1.4 (ti) or 1.9 (imaging) in position"
    claim = summed_up(aim, verdicts, fewest(kept, [row.key for row in CLEAN_ROWS]))
    title = "What do the default options cost where nothing is wrong?"
    return Section(title, _CLEAN_TEXT, (Part("", head, tuple(cells)),), (claim,))


_CLEAN_TEXT = """The same draws without shared errors: RMSE with the default options over the RMSE of an estimator that is told
that radar, lens and clicks have none. Field scene, one pair in ten wrong."""
