"""The map of the radar's angle errors: found where they are, flat where they are not."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import FIELD, SimulatedPairs, simulate_pairs
from calib_core.arrays import Points3
from calib_core.calibration import calibrate_pairs
from calib_core.diagnostics.angle_map import learn_angle_map
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.radar import AngleMap, cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration

LAYOUT = replace(FIELD, separation_m=0.05)
OWN = NoiseOptions(2.0, 0.008, 0.1, 0.25)
UNSEEN = 60


def bent(points: Points3) -> Points3:
    """Distort the radar's angles smoothly by up to a degree, in a way that no rotation can."""
    polar = polar_from_cartesian(points)
    polar[:, 2] += np.deg2rad(1.0) * np.cos(9.0 * polar[:, 1])
    return cartesian_from_polar(polar)


def drawn(count: int, *, bend: bool, seed: int = 5) -> SimulatedPairs:
    simulated = simulate_pairs(count + UNSEEN, rng=np.random.default_rng(seed), noise=OWN, layout=LAYOUT)
    if not bend:
        return simulated
    pairs = tuple(
        replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=point),))
        for pair, point in zip(simulated.pairs, bent(positions(simulated)), strict=True)
    )
    return replace(simulated, pairs=pairs)


def positions(simulated: SimulatedPairs) -> Points3:
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def solved(simulated: SimulatedPairs, count: int, options: CalibrationOptions | None = None) -> Calibration:
    return calibrate_pairs(simulated.pairs[:count], simulated.camera, options or CalibrationOptions()).unwrap()


def unseen_aed_px(simulated: SimulatedPairs, count: int, calibration: Calibration, angle_map: AngleMap | None) -> float:
    points = calibration.radar_errors.corrected(positions(simulated)[count:])
    if angle_map is not None:
        points = angle_map.corrected(points)
    projected = calibration.camera.project(calibration.camera_from_radar @ points)
    clicks = np.array([pair.pixel_px for pair in simulated.pairs[count:]])
    return float(np.linalg.norm(projected - clicks, axis=1).mean())


def test_a_smooth_error_is_learnt_and_new_placements_come_out_closer():
    simulated = drawn(40, bend=True)
    calibration = solved(simulated, 40)
    angle_map = learn_angle_map(calibration)
    assert angle_map.pays
    before, after = (unseen_aed_px(simulated, 40, calibration, known) for known in (None, angle_map))
    assert after < 0.75 * before
    assert angle_map.corrected_aed_px == pytest.approx(after, rel=0.35), "the map's own figure is not too optimistic"


def test_the_map_is_almost_flat_if_errors_are_independent():
    simulated = drawn(40, bend=False)
    calibration = solved(simulated, 40)
    angle_map = learn_angle_map(calibration)
    assert angle_map is not None
    before, after = (unseen_aed_px(simulated, 40, calibration, known) for known in (None, angle_map))
    assert after < 1.05 * before


def test_sigma_grows_where_no_placement_was():
    simulated = drawn(30, bend=True)
    calibration = solved(simulated, 30)
    angle_map = learn_angle_map(calibration)
    reported = np.array([pair.point_radar_m for pair in calibration.pairs])
    directions = polar_from_cartesian(calibration.radar_errors.corrected(reported))[:, 1:]
    grid = np.stack([*np.meshgrid(angle_map.azimuth_rad, angle_map.elevation_rad)], axis=-1)
    away = np.linalg.norm(grid[:, :, None] - directions, axis=3).min(axis=2)
    for angle in (0, 1):
        sigma = angle_map.sigma_rad[:, :, angle]
        assert sigma[away > np.deg2rad(9.0)].mean() > sigma[away < np.deg2rad(2.0)].mean()


def test_a_correction_keeps_the_range_is_linear_between_lines_and_ends_at_the_edge():
    correction = np.zeros((2, 2, 2))
    correction[:, 1, 0], correction[1, :, 1] = 0.02, 0.01
    flat = np.zeros((2, 2, 2))
    angle_map = AngleMap(np.array([0.0, 0.1]), np.array([0.0, 0.1]), correction, flat, 1.0, 1.0)
    measured = np.array([[5.0, 0.0, 0.0], [6.0, 0.05, 0.025], [7.0, 0.4, -0.3]])
    polar = polar_from_cartesian(angle_map.corrected(cartesian_from_polar(measured)))
    added = polar - measured
    np.testing.assert_allclose(added, np.array([[0, 0, 0], [0, 0.01, 0.0025], [0, 0.02, 0.0]]), rtol=0, atol=1e-12)
    assert angle_map.corrected(np.zeros((0, 3))).shape == (0, 3)


def test_a_return_without_a_position_stays_without_one():
    angle_map = AngleMap(np.array([0.0, 0.1]), np.array([0.0, 0.1]), np.zeros((2, 2, 2)), np.zeros((2, 2, 2)), 1.0, 1.0)
    assert np.isnan(angle_map.corrected(np.full((1, 3), np.nan))).all()


@pytest.mark.parametrize("reason", ["few", "paper"])
def test_there_is_no_map_without_pairs_or_a_noise_model(reason):
    simulated = drawn(20, bend=True)
    if reason == "few":
        calibration = solved(simulated, 7)
    else:
        calibration = replace(solved(simulated, 20), options=CalibrationOptions(method="paper"))
    assert learn_angle_map(calibration) is None


def test_a_radar_without_elevation_gets_no_elevation_correction():
    simulated = drawn(20, bend=False)
    calibration = solved(simulated, 20)
    flat = tuple(replace(pair, point_radar_m=np.array([*pair.point_radar_m[:2], 0.0])) for pair in calibration.pairs)
    angle_map = learn_angle_map(replace(calibration, pairs=flat))
    assert angle_map is None or not angle_map.correction_rad[:, :, 1].any()


def test_many_pairs_are_thinned_out_and_the_map_is_reproducible():
    simulated = drawn(200, bend=True)
    calibration = solved(simulated, 200)
    first, second = learn_angle_map(calibration), learn_angle_map(calibration)
    np.testing.assert_array_equal(first.correction_rad, second.correction_rad)
    before, after = (unseen_aed_px(simulated, 200, calibration, known) for known in (None, first))
    assert after < 0.75 * before


def test_a_map_whose_lines_do_not_ascend_is_refused():
    with pytest.raises(ValueError, match="ascend"):
        AngleMap(np.array([0.1, 0.0]), np.array([0.0, 0.1]), np.zeros((2, 2, 2)), np.zeros((2, 2, 2)), 1.0, 1.0)
