"""Simulated pairs: the stated truth is right, and the noise is as large as stated."""

import numpy as np
import pytest

from calib_core.radar import polar_from_cartesian, sigma_polar_of
from calib_core.synthetic import (
    AISLE,
    NOISE_PROFILES,
    PairsLayout,
    RigOptions,
    SimulatedPairs,
    random_rig,
    simulate_pairs,
)
from calib_core.synthetic.rig import nominal_rotation, typical_camera


def _radar_points(simulated: SimulatedPairs) -> np.ndarray:
    """Return the position of the most plausible candidate of each pair."""
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def _clicks(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.pixel_px for pair in simulated.pairs])


def test_without_noise_the_radar_positions_project_onto_the_clicks() -> None:
    simulated = simulate_pairs(12, rng=np.random.default_rng(3), noise="none")
    projected = simulated.camera.project(simulated.camera_from_radar @ _radar_points(simulated))
    assert np.abs(projected - _clicks(simulated)).max() < 1e-8


def test_the_same_seed_draws_the_same_pairs_and_another_seed_others() -> None:
    first, again, other = (simulate_pairs(rng=np.random.default_rng(seed), outlier_share=0.3) for seed in (5, 5, 6))
    assert np.array_equal(_clicks(first), _clicks(again))
    assert np.array_equal(_radar_points(first), _radar_points(again))
    assert np.array_equal(first.outlier, again.outlier)
    assert not np.array_equal(_clicks(first), _clicks(other))


def test_clicks_and_radar_errors_have_the_profiles_standard_deviations() -> None:
    rng = np.random.default_rng(8)
    profile = NOISE_PROFILES["ti"]
    sets = [simulate_pairs(40, rng=rng, noise="ti") for _ in range(30)]
    click_errors = np.concatenate([_clicks(s) - s.pixels_px for s in sets])
    polar_errors = np.concatenate(
        [polar_from_cartesian(_radar_points(s)) - polar_from_cartesian(s.points_radar_m) for s in sets]
    )
    assert click_errors.std(axis=0) == pytest.approx([2.0, 2.0], rel=0.1)
    assert polar_errors.std(axis=0) == pytest.approx(sigma_polar_of(profile), rel=0.1)


def test_as_many_pairs_are_wrong_as_requested_and_they_are_far_off() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(2), noise="imaging", outlier_share=0.3)
    projected = simulated.camera.project(simulated.camera_from_radar @ _radar_points(simulated))
    distance = np.linalg.norm(projected - _clicks(simulated), axis=1)
    assert simulated.outlier.sum() == 6
    assert np.nanmax(distance[~simulated.outlier]) < 30.0
    assert np.nanmedian(distance[simulated.outlier]) > 60.0


def test_the_true_candidate_is_named_and_is_the_most_plausible_in_most_pairs() -> None:
    simulated = simulate_pairs(
        60, rng=np.random.default_rng(4), noise="none", decoys=3, layout=PairsLayout(separation_m=0.1)
    )
    for pair, place, point in zip(simulated.pairs, simulated.true_candidate, simulated.points_radar_m, strict=True):
        scores = [candidate.score for candidate in pair.candidates]
        assert len(pair.candidates) == 4
        assert np.linalg.norm(pair.candidates[place].position_radar_m - point) < 1e-9
        assert scores == sorted(scores, reverse=True)
        assert sum(scores) == pytest.approx(1.0)
    assert 0.5 < np.mean(np.array(simulated.true_candidate) == 0) < 0.85


def test_an_outlier_has_no_true_candidate() -> None:
    simulated = simulate_pairs(10, rng=np.random.default_rng(4), outlier_share=0.5)
    assert {place for place, wrong in zip(simulated.true_candidate, simulated.outlier, strict=True) if wrong} == {-1}


def test_every_reflector_is_in_the_picture_and_apart_from_the_others() -> None:
    simulated = simulate_pairs(40, rng=np.random.default_rng(1), layout=AISLE)
    assert simulated.camera.sees(simulated.camera_from_radar @ simulated.points_radar_m).all()
    gaps = np.linalg.norm(simulated.points_radar_m[:, None] - simulated.points_radar_m[None], axis=2)
    assert gaps[~np.eye(40, dtype=bool)].min() >= AISLE.separation_m


def test_more_placements_than_fit_are_refused_with_the_number_that_fits() -> None:
    crowded = PairsLayout(min_range_m=3.0, max_range_m=4.0, max_azimuth_deg=5.0, separation_m=0.5)
    with pytest.raises(ValueError, match=r"only \d+ of 40 placements fit"):
        simulate_pairs(40, rng=np.random.default_rng(1), layout=crowded)


def test_the_camera_sits_where_the_options_put_it_and_looks_where_the_radar_looks() -> None:
    options = RigOptions(
        radar_height_m=2.0, camera_offset_m=(0.1, -0.2, 0.3), camera_offset_sigma_m=0.0, camera_angle_sigma_deg=0.0
    )
    rig = random_rig(np.random.default_rng(1), camera=typical_camera(), options=options)
    assert rig.camera_position_radar_m == pytest.approx([0.1, -0.2, 0.3])
    assert np.array_equal(rig.camera_from_radar.rotation, nominal_rotation())
    ahead = rig.radar_from_world.inverse() @ np.array([[5.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert ahead[1] == pytest.approx([0.0, 0.0, 2.0])
    assert ahead[0, 2] == pytest.approx(2.0 - 5.0 * np.sin(np.deg2rad(10.0)))
