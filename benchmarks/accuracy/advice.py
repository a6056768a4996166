"""Placements where the program advises them, compared with placements anywhere: how much smaller is the uncertainty?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from benchmarks.accuracy.cases import Case, bound_of, draw, options_of
from benchmarks.accuracy.figures import Measured, at_least, column, fewest, summed_up
from benchmarks.accuracy.methods import solve_ours
from benchmarks.accuracy.rows import Figures, Kept, Part, Row, Section
from benchmarks.simulated_pairs import FIELD, NOISE_PROFILES, NoiseName, SimulatedPairs
from calib_core.calibration import calibrate_pairs
from calib_core.diagnostics.next_placement import PlacementLimits, next_placement
from calib_core.measurements import Candidate, Pair
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar, polar_from_cartesian, sigma_polar_of
from calib_core.results import Calibration

__all__ = ["ROWS", "Advised", "measure_advice", "section"]

_TRIALS = 60
_FIRST = 4  # the fewest that can be solved
_AIM = 1.35
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_SAME_FIELD = PlacementLimits(FIELD.min_range_m, FIELD.max_range_m, FIELD.max_azimuth_deg, FIELD.separation_m)


@dataclass(frozen=True, slots=True)
class Advised:
    """What is drawn."""

    noise: NoiseName
    pairs: int
    tape_m: float | None

    @property
    def key(self) -> str:
        """A file name."""
        return f"advice-{self.noise}-{self.pairs}-{'free' if self.tape_m is None else 'tape'}"


_CASES = tuple(Advised(noise, pairs, tape_m) for tape_m, noise, pairs in product((None, 0.01), _NOISES, (10, 20)))


def measure_advice(case: Advised, trial: int) -> Figures:
    """Follow the advice after the first placements, and compare with the placements as drawn."""
    as_drawn = Case(case.noise, case.pairs, tape_m=case.tape_m)
    simulated = draw(as_drawn, trial)
    rng = np.random.default_rng([2026, trial])
    pairs, places = list(simulated.pairs[:_FIRST]), list(simulated.points_radar_m[:_FIRST])
    while len(pairs) < case.pairs:
        place = _advised(pairs, simulated, as_drawn)
        if place is None:
            place = simulated.points_radar_m[len(places)]
        places.append(place)
        pairs.append(_measured_at(place, f"a{len(pairs)}", simulated, case.noise, rng))
    advised_bound = bound_of(simulated, case.noise, case.tape_m, points_radar_m=np.array(places))
    drawn_bound = bound_of(simulated, case.noise, case.tape_m)
    outcome = calibrate_pairs(pairs, simulated.camera, options_of(as_drawn))
    advised = outcome if isinstance(outcome, Calibration) else None
    return {
        "sigma_rad": drawn_bound.rotation_rad,
        "advised_sigma_rad": advised_bound.rotation_rad,
        "error_rad": _rotation_rad(simulated, solve_ours(simulated, as_drawn)),
        "advised_error_rad": _rotation_rad(simulated, advised),
    }


def _advised(pairs: Sequence[Pair], simulated: SimulatedPairs, case: Case) -> np.ndarray | None:
    outcome = calibrate_pairs(pairs, simulated.camera, options_of(case))
    if not isinstance(outcome, Calibration):
        return None
    advice = next_placement(outcome, limits=_SAME_FIELD)
    if advice is None or not simulated.camera.sees(simulated.camera_from_radar @ advice.position_radar_m[None])[0]:
        return None
    return np.array(advice.position_radar_m)


def _measured_at(
    place: np.ndarray, name: str, simulated: SimulatedPairs, noise: NoiseName, rng: np.random.Generator
) -> Pair:
    """Simulate a measurement of the reflector at a place."""
    profile = NOISE_PROFILES[noise]
    point = cartesian_from_polar(polar_from_cartesian(place) + sigma_polar_of(profile) * rng.standard_normal(3))
    pixel = simulated.camera.project(simulated.camera_from_radar @ place[None])[0]
    pixel = pixel + profile.sigma_px * rng.standard_normal(2)
    candidate = Candidate(point, sigma_polar_of(profile), covariance_from_sigma_polar(point, sigma_polar_of(profile)))
    return Pair(name, pixel, (candidate,), sigma_px=profile.sigma_px)


def _rotation_rad(simulated: SimulatedPairs, calibration: Calibration | None) -> float | None:
    if calibration is None:
        return None
    return float(np.linalg.norm(simulated.camera_from_radar.error_from(calibration.camera_from_radar)[3:]))


ROWS = tuple(Row(case.key, _TRIALS, partial(measure_advice, case)) for case in _CASES)


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, verdicts = [], []
    for case in _CASES:
        trials = kept.get(case.key, ())
        if len(trials) < 2:
            continue
        gain = _gain(column(trials, "sigma_rad"), column(trials, "advised_sigma_rad"))
        seen = _gain(column(trials, "error_rad"), column(trials, "advised_error_rad"))
        verdicts.append(at_least(gain, _AIM))
        sigmas = [
            np.rad2deg(np.sqrt((column(trials, name) ** 2).mean())) for name in ("sigma_rad", "advised_sigma_rad")
        ]
        known = "free" if case.tape_m is None else "measured to 1 cm"
        what = (case.noise, str(case.pairs), known, str(len(trials)), *(f"{sigma:.2f} deg" for sigma in sigmas))
        cells.append((*what, str(gain), str(seen), f"{_AIM:g}", verdicts[-1]))
    head = (
        "noise",
        "pairs",
        "camera position",
        "trials",
        "sigma, anywhere",
        "sigma, as advised",
        "sigma ratio",
        "RMSE ratio",
        "aim",
        "",
    )
    trial_counts = fewest(kept, [row.key for row in ROWS])
    claim = summed_up("next-placement advice cuts the rotation's sigma at least 1.35 times", verdicts, trial_counts)
    return Section("Does the next-placement advice help?", _TEXT, (Part("", head, tuple(cells)),), (claim,))


_TEXT = """The first four placements are drawn anywhere in the field, 2 to 20 m away and within 35 deg to either side. The
others are drawn the same way, or placed in the same field where the program advises, given the pairs so far. Sigma is the
bound of the rotation at the true placements; the last ratio is that of the actual errors."""


def _gain(before: np.ndarray, after: np.ndarray) -> Measured:
    """Return the ratio of root mean squares of independent draws."""
    used = np.isfinite(before) & np.isfinite(after)
    first, second = before[used] ** 2, after[used] ** 2
    value = float(np.sqrt(first.mean() / second.mean()))
    return Measured(
        value, float(np.std(first - value**2 * second, ddof=1) / np.sqrt(used.sum()) / second.mean()) / value
    )
