"""Placements where the program advises them, compared with placements anywhere: how much smaller is the uncertainty?"""

from collections.abc import Sequence

import numpy as np

from benchmarks.accuracy.cases import Case, bound_of, draw, options_of
from benchmarks.accuracy.rows import Figures
from benchmarks.simulated_pairs import FIELD, NOISE_PROFILES, NoiseName, SimulatedPairs
from calib_core.calibration import calibrate_pairs
from calib_core.diagnostics.next_placement import PlacementLimits, next_placement
from calib_core.measurements import Candidate, Pair
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar, polar_from_cartesian, sigma_polar_of
from calib_core.results import Calibration

_FIRST = 4  # the fewest that can be solved
_SAME_FIELD = PlacementLimits(FIELD.min_range_m, FIELD.max_range_m, FIELD.max_azimuth_deg, FIELD.separation_m)


def measure_advice(as_drawn: Case, trial: int) -> Figures:
    """Follow the advice after the first placements, and compare the bound of the rotation with that as drawn."""
    simulated = draw(as_drawn, trial)
    rng = np.random.default_rng([2026, trial])
    pairs, places = list(simulated.pairs[:_FIRST]), list(simulated.points_radar_m[:_FIRST])
    while len(pairs) < as_drawn.pairs:
        place = _advised(pairs, simulated, as_drawn)
        if place is None:
            place = simulated.points_radar_m[len(places)]
        places.append(place)
        pairs.append(_measured_at(place, f"a{len(pairs)}", simulated, as_drawn.noise, rng))
    advised = bound_of(simulated, as_drawn.noise, as_drawn.tape_m, points_radar_m=np.array(places))
    drawn = bound_of(simulated, as_drawn.noise, as_drawn.tape_m)
    return {"sigma_rad": drawn.rotation_rad, "advised_sigma_rad": advised.rotation_rad}


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
