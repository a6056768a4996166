"""Following the advice reduces the uncertainty more than random placements."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import NOISE_PROFILES, SimulatedPairs, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.diagnostics.next_placement import (
    ENOUGH_PLACEMENTS,
    Place,
    PlacementLimits,
    next_placement,
    placement_coverage,
)
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar, polar_from_cartesian, sigma_polar_of
from calib_core.results import Calibration

OPTIONS = CalibrationOptions(noise=NoiseOptions(2.0, 0.015, 0.55, 1.0))


def solved(pairs: list[Pair], simulated: SimulatedPairs) -> Calibration:
    return calibrate_pairs(pairs, simulated.camera, OPTIONS).unwrap()


def positions(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def measured_at(position: np.ndarray, name: str, simulated: SimulatedPairs, rng: np.random.Generator) -> Pair:
    """Put the reflector at the advised place and measure it as the simulation does."""
    sigma = sigma_polar_of(NOISE_PROFILES["ti"])
    point = cartesian_from_polar(polar_from_cartesian(position) + sigma * rng.standard_normal(3))
    pixel = simulated.camera.project(simulated.camera_from_radar @ position[None])[0] + 2.0 * rng.standard_normal(2)
    example = simulated.pairs[0].candidates[0]
    covariance = covariance_from_sigma_polar(point, sigma)
    return Pair(name, pixel, (type(example)(point, sigma, covariance),), sigma_px=2.0)


def test_the_promised_gain_is_what_a_pair_there_brings():
    options = replace(OPTIONS, noise=replace(OPTIONS.noise, estimate_scale=False))
    for seed in (3, 5):
        rng = np.random.default_rng(seed)
        simulated = simulate_pairs(10, rng=rng)
        before = calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()
        advice = next_placement(before)
        added = measured_at(advice.position_radar_m, "added", simulated, rng)
        after = calibrate_pairs([*simulated.pairs, added], simulated.camera, options).unwrap()
        points = np.array([pair.point_radar_m for pair in before.pairs])
        scale = np.repeat([1.0 / float(np.median(np.linalg.norm(points, axis=1))), 1.0], 3)
        spreads = [np.sqrt(np.trace(one.covariance * np.outer(scale, scale))) for one in (before, after)]
        assert spreads[0] / spreads[1] == pytest.approx(advice.gain, rel=0.15)


def test_more_clicks_of_the_same_placements_leave_the_gain_unchanged():
    simulated = simulate_pairs(10, rng=np.random.default_rng(3))
    before = solved(list(simulated.pairs), simulated)
    repeated = [replace(pair, id=f"{pair.id}-{copy}") for pair in before.pairs for copy in range(3)]
    measured = [
        replace(result, measured=replace(result.measured, id=result.id)) for result in repeated if result.measured
    ]
    once, thrice = next_placement(before), next_placement(replace(before, pairs=tuple(measured)))
    assert len(measured) == 3 * len(before.pairs)
    assert thrice.gain == pytest.approx(once.gain, rel=0.05)


def test_no_placement_is_said_to_level_a_radar_without_elevation():
    simulated = simulate_pairs(20, rng=np.random.default_rng(4))
    flat = [np.array([np.hypot(*one[[0, 2]]), one[1], 0.0]) for one in positions(simulated)]
    pairs = [
        replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=point),))
        for pair, point in zip(simulated.pairs, flat, strict=True)
    ]
    advice = next_placement(solved(pairs, simulated))
    assert advice.gain < 1.5


def test_the_advised_place_is_in_view_and_new():
    simulated = simulate_pairs(10, rng=np.random.default_rng(3))
    calibration = solved(list(simulated.pairs), simulated)
    advice = next_placement(calibration, limits=PlacementLimits(separation_m=1.0))
    assert calibration.camera.in_image(advice.pixel_px[None]).all()
    used = np.array([pair.point_radar_m for pair in calibration.pairs])
    assert np.linalg.norm(used - advice.position_radar_m, axis=1).min() >= 1.0
    assert advice.gain > 1.0


def test_the_advice_is_to_stop_after_many_placements_and_not_after_few():
    simulated = simulate_pairs(60, rng=np.random.default_rng(4))
    few, many = (next_placement(solved(list(simulated.pairs[:n]), simulated)) for n in (6, 60))
    assert not few.may_stop
    assert many.may_stop
    assert few.gain > many.gain


def test_there_is_no_advice_without_a_covariance():
    simulated = simulate_pairs(12, rng=np.random.default_rng(5), noise="imaging")
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, CalibrationOptions(method="paper")).unwrap()
    assert next_placement(outcome) is None


HALF_VIEW_RAD = np.deg2rad(30.0)
RANGES_M = (3.5, 7.0, 12.0)
BEARINGS_RAD = np.deg2rad([20.0, 0.0, -20.0])


def placed_at(polar: list[tuple[float, float]], z_m: float = 0.0) -> np.ndarray:
    found = cartesian_from_polar(
        np.array([(range_m, azimuth_rad, 0.0) for range_m, azimuth_rad in polar]).reshape(-1, 3)
    )
    found[:, 2] = z_m
    return found


def everywhere(repeats: int) -> np.ndarray:
    shift = 0.7 * np.arange(repeats)
    return placed_at([(r + s, a) for s in shift for r in RANGES_M for a in BEARINGS_RAD])


def test_without_placements_the_whole_field_is_missing():
    coverage = placement_coverage(np.zeros((0, 3)), half_view_rad=HALF_VIEW_RAD)
    assert coverage.placements == 0
    assert coverage.next is not None


@pytest.mark.parametrize("missing", [(r, a) for r in range(3) for a in range(3)])
def test_the_part_of_the_field_without_a_placement_is_next(missing):
    there = [(r, a) for i, r in enumerate(RANGES_M) for j, a in enumerate(BEARINGS_RAD) if (i, j) != missing]
    coverage = placement_coverage(placed_at(there), half_view_rad=HALF_VIEW_RAD)
    side = ("left", "ahead", "right")[missing[1]]
    limits = ((2.0, 5.0), (5.0, 10.0), (10.0, 15.0))[missing[0]]
    assert coverage.next == Place(side, *limits)


def test_enough_placements_everywhere_are_enough():
    coverage = placement_coverage(everywhere(3), half_view_rad=HALF_VIEW_RAD)
    assert coverage.placements == 27 >= ENOUGH_PLACEMENTS
    assert coverage.next is None


def test_many_placements_on_one_side_are_not():
    one_side = placed_at([(2.5 + 0.6 * i, BEARINGS_RAD[0]) for i in range(20)])
    coverage = placement_coverage(one_side, half_view_rad=HALF_VIEW_RAD)
    assert coverage.placements == 20
    assert coverage.next.side != "left"


def test_two_placements_at_one_place_count_once():
    coverage = placement_coverage(placed_at([(5.0, 0.0), (5.1, 0.01)]), half_view_rad=HALF_VIEW_RAD)
    assert coverage.placements == 1


def test_one_height_is_told_only_where_the_radar_measures_heights():
    flat = everywhere(2)
    assert not placement_coverage(flat, half_view_rad=HALF_VIEW_RAD).one_height
    flat[:, 2] += np.linspace(0.0, 0.1, len(flat))
    assert placement_coverage(flat, half_view_rad=HALF_VIEW_RAD).one_height
    flat[0, 2] = 1.0
    assert not placement_coverage(flat, half_view_rad=HALF_VIEW_RAD).one_height
