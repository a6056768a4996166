"""Simulated pairs: the stated truth is right, and the noise is as large as stated."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.accuracy.defects.pair_defects import (
    clicked_again,
    draw_flat_radar_rig,
    from_moved_camera,
    in_other_units,
    mirrored,
    random_rig_apart,
    with_companion,
    with_rounded_elevations,
    with_zero_pair,
)
from benchmarks.simulated_pairs import (
    AISLE,
    NOISE_PROFILES,
    SimulatedPairs,
    SystematicErrors,
    draw_systematic_errors,
    simulate_pairs,
)
from calib_core.errors import OptionError
from calib_core.options import LensOptions, RadarOptions, ReflectorOptions
from calib_core.radar import polar_from_cartesian, sigma_polar_of
from calib_core.synthetic.rig import RigOptions, nominal_rotation, random_rig, typical_camera
from calib_core.synthetic.scene.scenes import PairsLayout


def _radar_points(simulated: SimulatedPairs) -> np.ndarray:
    """Return the position of the most plausible candidate of each pair."""
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def _clicks(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.pixel_px for pair in simulated.pairs])


def test_without_noise_the_radar_positions_project_onto_the_clicks():
    simulated = simulate_pairs(12, rng=np.random.default_rng(3), noise="none")
    projected = simulated.camera.project(simulated.camera_from_radar @ _radar_points(simulated))
    assert np.abs(projected - _clicks(simulated)).max() < 1e-8


@pytest.mark.slow
def test_clicks_and_radar_errors_have_the_profiles_standard_deviations():
    rng = np.random.default_rng(8)
    profile = NOISE_PROFILES["ti"]
    sets = [simulate_pairs(40, rng=rng, noise="ti") for _ in range(30)]
    click_errors = np.concatenate([_clicks(s) - s.pixels_px for s in sets])
    polar_errors = np.concatenate(
        [polar_from_cartesian(_radar_points(s)) - polar_from_cartesian(s.points_radar_m) for s in sets]
    )
    assert click_errors.std(axis=0) == pytest.approx([2.0, 2.0], rel=0.1)
    assert polar_errors.std(axis=0) == pytest.approx(sigma_polar_of(profile), rel=0.1)


def test_as_many_pairs_are_wrong_as_requested_and_they_are_far_off():
    simulated = simulate_pairs(20, rng=np.random.default_rng(2), noise="imaging", outlier_share=0.3)
    projected = simulated.camera.project(simulated.camera_from_radar @ _radar_points(simulated))
    distance = np.linalg.norm(projected - _clicks(simulated), axis=1)
    assert simulated.outlier.sum() == 6
    assert np.nanmax(distance[~simulated.outlier]) < 30.0
    assert np.nanmedian(distance[simulated.outlier]) > 60.0


def test_the_true_candidate_is_named_and_is_the_most_plausible_in_most_pairs():
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


def test_an_outlier_has_no_true_candidate():
    simulated = simulate_pairs(10, rng=np.random.default_rng(4), outlier_share=0.5)
    assert {place for place, wrong in zip(simulated.true_candidate, simulated.outlier, strict=True) if wrong} == {-1}


def test_every_reflector_is_in_the_image_and_apart_from_the_others():
    simulated = simulate_pairs(40, rng=np.random.default_rng(1), layout=AISLE)
    assert simulated.camera.sees(simulated.camera_from_radar @ simulated.points_radar_m).all()
    gaps = np.linalg.norm(simulated.points_radar_m[:, None] - simulated.points_radar_m[None], axis=2)
    assert gaps[~np.eye(40, dtype=bool)].min() >= AISLE.separation_m


@pytest.mark.slow
def test_more_placements_than_fit_are_refused_with_the_number_that_fits():
    crowded = PairsLayout(min_range_m=3.0, max_range_m=4.0, max_azimuth_deg=5.0, separation_m=0.5)
    with pytest.raises(OptionError, match=r"only \d+ of 40 placements fit"):
        simulate_pairs(40, rng=np.random.default_rng(1), layout=crowded)


def test_the_camera_sits_where_the_options_put_it_and_looks_where_the_radar_looks():
    options = RigOptions(radar_height_m=2.0, camera_offset_m=(0.1, -0.2, 0.3), camera_angle_sigma_deg=0.0)
    rig = random_rig(np.random.default_rng(1), camera=typical_camera(), options=options)
    assert rig.camera_position_radar_m == pytest.approx([0.1, -0.2, 0.3], abs=0.04)
    assert np.array_equal(rig.camera_from_radar.rotation, nominal_rotation())
    ahead = rig.radar_from_world.inverse() @ np.array([[5.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert ahead[1] == pytest.approx([0.0, 0.0, 2.0])
    assert ahead[0, 2] == pytest.approx(2.0 - 5.0 * np.sin(np.deg2rad(10.0)))


# What goes wrong with pairs beyond noise: each defect is where its description puts it, and nowhere else.


@pytest.fixture
def simulated() -> SimulatedPairs:
    return simulate_pairs(20, rng=np.random.default_rng(3), noise="imaging", outlier_share=0.2)


def first_positions(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def clicks(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.pixel_px for pair in simulated.pairs])


def test_clicks_of_one_placement_share_the_radar_position_and_not_the_click_noise(simulated):
    thrice = clicked_again(simulated, 3, rng=np.random.default_rng(1))
    assert [pair.id for pair in thrice.pairs[:4]] == ["p1", "p1-2", "p1-3", "p2"]
    assert np.array_equal(first_positions(thrice)[::3], first_positions(simulated))
    assert np.array_equal(first_positions(thrice)[::3], first_positions(thrice)[2::3])
    away_px = (clicks(thrice) - thrice.pixels_px)[~thrice.outlier].reshape(-1, 3, 2)
    assert away_px.std() == pytest.approx(2.0, rel=0.2)
    assert np.abs(np.corrcoef(away_px[:, 1].ravel(), away_px[:, 2].ravel())[0, 1]) < 0.5


def test_repeated_clicks_share_the_offset_of_all_clicks():
    errors = SystematicErrors(click_offset_px=(0.0, 50.0))
    once = simulate_pairs(20, rng=np.random.default_rng(3), systematic=errors)
    twice = clicked_again(once, 2, rng=np.random.default_rng(1))
    assert (clicks(twice) - twice.pixels_px).mean(axis=0) == pytest.approx([0.0, 50.0], abs=2.0)


def test_a_companion_stands_behind_the_reflector_and_comes_first(simulated):
    joined = with_companion(simulated, rng=np.random.default_rng(1), wander_m=0.0)
    right = ~simulated.outlier
    before, after = (polar_from_cartesian(first_positions(one)) for one in (simulated, joined))
    assert after[right] - before[right] == pytest.approx(np.tile([1.0, 0.0, 0.0], (right.sum(), 1)), abs=1e-9)
    assert np.array_equal(after[~right], before[~right])
    assert {place for place, wrong in zip(joined.true_candidate, joined.outlier, strict=True) if not wrong} == {1}
    assert sum(one.score for one in joined.pairs[int(np.flatnonzero(right)[0])].candidates) <= 1.0
    hidden = with_companion(simulated, rng=np.random.default_rng(1), share=0.5, reflector_seen=False)
    assert simulated.outlier.sum() < hidden.outlier.sum() < 20
    assert all(len(pair.candidates) == 1 for pair in hidden.pairs)


def test_pairs_from_a_moved_camera_agree_on_another_pose(simulated):
    moved = from_moved_camera(simulated, rng=np.random.default_rng(1), share=0.4, turn_deg=5.0)
    changed = (clicks(moved) != clicks(simulated)).any(axis=1)
    assert np.array_equal(changed, moved.outlier & ~simulated.outlier)
    assert 0 < changed.sum() <= 8
    assert np.linalg.norm(clicks(moved) - clicks(simulated), axis=1)[changed].min() > 10.0


def test_mirrored_and_scaled_positions_are_the_reported_ones_changed(simulated):
    assert first_positions(mirrored(simulated)) == pytest.approx(first_positions(simulated) * [1, -1, 1])
    assert first_positions(mirrored(simulated, "up")) == pytest.approx(first_positions(simulated) * [1, 1, -1])
    assert first_positions(in_other_units(simulated, 1000.0)) == pytest.approx(1000.0 * first_positions(simulated))


def test_rounding_changes_elevations_by_less_than_a_microradian():
    flat = simulate_pairs(9, rng=np.random.default_rng(3), systematic=SystematicErrors(measures_elevation=False))
    rounded = polar_from_cartesian(first_positions(with_rounded_elevations(flat, rng=np.random.default_rng(1))))
    assert 0.0 < np.abs(rounded[:, 2]).max() <= 1e-6
    assert rounded[:, :2] == pytest.approx(polar_from_cartesian(first_positions(flat))[:, :2])


def test_a_zero_pair_is_next_to_the_radar_and_an_outlier(simulated):
    zeroed = with_zero_pair(simulated, np.random.default_rng(1))
    assert np.linalg.norm(first_positions(zeroed)[0]) < 0.01
    assert zeroed.outlier[0]
    assert zeroed.true_candidate[0] == -1
    assert np.array_equal(first_positions(zeroed)[1:], first_positions(simulated)[1:])


# Errors that all pairs share: each does to the pairs what its description says, and nothing else changes.


small = st.floats(-0.1, 0.1)
pixels = st.floats(-20.0, 20.0)


def exact_pairs(errors: SystematicErrors, *, seed: int = 3) -> SimulatedPairs:
    return simulate_pairs(8, rng=np.random.default_rng(seed), noise="none", systematic=errors)


def reported(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


@settings(max_examples=20, deadline=None)
@given(small, small, small, st.floats(-0.5, 0.5))
def test_the_radar_reports_true_values_times_a_scale_plus_a_bias(azimuth, elevation, range_scale, bias_m):
    errors = SystematicErrors(
        azimuth_scale=azimuth, elevation_scale=elevation, range_scale=range_scale, range_bias_m=bias_m
    )
    simulated = exact_pairs(errors)
    true = polar_from_cartesian(simulated.points_radar_m)
    expected = true * [1.0 + range_scale, 1.0 + azimuth, 1.0 + elevation] + [bias_m, 0.0, 0.0]
    assert polar_from_cartesian(reported(simulated)) == pytest.approx(expected, abs=1e-9)
    assert clicks(simulated) == pytest.approx(clicks(exact_pairs(SystematicErrors())))


@settings(max_examples=20, deadline=None)
@given(st.tuples(pixels, pixels), st.tuples(small, small, small))
def test_clicks_are_off_by_the_same_pixels_and_by_a_place_next_to_the_phase_centre(offset_px, offset_m):
    simulated = exact_pairs(SystematicErrors(click_offset_px=offset_px, reflector_offset_m=offset_m))
    points = simulated.camera_from_radar @ simulated.points_radar_m
    assert clicks(simulated) - offset_px == pytest.approx(simulated.rig.camera.project(points + np.array(offset_m)))
    assert simulated.pixels_px == pytest.approx(simulated.rig.camera.project(points))


@settings(max_examples=20, deadline=None)
@given(small, st.tuples(pixels, pixels), small)
def test_the_given_intrinsics_are_wrong_and_the_images_are_not(focal_length, principal_point_px, distortion):
    errors = SystematicErrors(focal_length=focal_length, principal_point_px=principal_point_px, distortion=distortion)
    simulated = exact_pairs(errors)
    true = simulated.rig.camera
    assert simulated.camera.matrix_px[0, 0] == pytest.approx(true.matrix_px[0, 0] * (1.0 + focal_length))
    assert simulated.camera.matrix_px[:2, 2] - true.matrix_px[:2, 2] == pytest.approx(principal_point_px)
    assert simulated.camera.distortion - true.distortion == pytest.approx([distortion, 0.0, 0.0, 0.0])
    assert np.array_equal(clicks(simulated), clicks(exact_pairs(SystematicErrors())))


@settings(max_examples=20, deadline=None)
@given(st.floats(-5.0, 5.0))
def test_an_azimuth_bias_is_a_rotation_that_the_true_pose_contains(bias_deg):
    simulated = exact_pairs(SystematicErrors(azimuth_bias_deg=bias_deg))
    projected = simulated.camera.project(simulated.camera_from_radar @ reported(simulated))
    assert projected == pytest.approx(clicks(simulated), abs=1e-6)
    assert reported(simulated) == pytest.approx(simulated.points_radar_m, abs=1e-9)


def test_an_elevation_bias_is_nearly_a_rotation():
    simulated = exact_pairs(SystematicErrors(elevation_bias_deg=1.0))
    off_rad = polar_from_cartesian(reported(simulated))[:, 1:] - polar_from_cartesian(simulated.points_radar_m)[:, 1:]
    unbiased = polar_from_cartesian(reported(exact_pairs(SystematicErrors())))
    assert polar_from_cartesian(reported(simulated)) - unbiased == pytest.approx(
        np.tile([0.0, 0.0, np.deg2rad(1.0)], (8, 1)), abs=1e-9
    )
    assert np.abs(off_rad).max() < np.deg2rad(0.4)  # 1 - cos(35 deg) of a degree, and more in azimuth below the radar


@pytest.mark.parametrize("z_m", [0.0, 0.5])
def test_a_radar_without_elevation_reports_range_and_azimuth_in_a_plane(z_m):
    flat = exact_pairs(SystematicErrors(measures_elevation=False, constant_z_m=z_m))
    true = polar_from_cartesian(flat.points_radar_m)
    across = reported(flat)[:, :2]
    assert np.hypot(*across.T) == pytest.approx(true[:, 0])
    assert np.arctan2(across[:, 1], across[:, 0]) == pytest.approx(true[:, 1])
    assert (reported(flat)[:, 2] == z_m).all()
    decoyed = simulate_pairs(6, rng=np.random.default_rng(1), decoys=2, outlier_share=0.5, systematic=flat.systematic)
    assert {float(one.position_radar_m[2]) for pair in decoyed.pairs for one in pair.candidates} == {z_m}


def test_errors_are_as_large_as_the_options_state():
    rng = np.random.default_rng(5)
    drawn = [draw_systematic_errors(rng) for _ in range(2000)]
    radar, lens, reflector = RadarOptions(), LensOptions(), ReflectorOptions()
    stated = {
        "azimuth_scale": radar.azimuth_scale_sigma,
        "elevation_scale": radar.elevation_scale_sigma,
        "elevation_lean": radar.elevation_lean_sigma,
        "range_bias_m": radar.range_bias_sigma_m,
        "range_scale": radar.range_scale_sigma,
        "click_offset_px": reflector.click_offset_sigma_px,
        "reflector_offset_m": reflector.offset_sigma_m,
        "principal_point_px": lens.principal_point_sigma_px,
        "focal_length": lens.focal_length_sigma,
        "distortion": lens.distortion_sigma,
    }
    for name, sigma in stated.items():
        values = np.array([getattr(one, name) for one in drawn])
        assert values.std(axis=0) == pytest.approx(np.full(values.shape[1:], sigma), rel=0.1), name
    kept = {"azimuth_bias_deg", "elevation_bias_deg", "measures_elevation", "constant_z_m"}
    assert {field.name for field in fields(SystematicErrors)} == {*stated, *kept}
    assert all(one.azimuth_bias_deg == 0.0 and one.measures_elevation for one in drawn)


def test_exact_instruments_draw_no_errors():
    radar, lens = RadarOptions(0.0, 0.0, 0.0, 0.0, 0.0), LensOptions(0.0, 0.0, 0.0)
    drawn = draw_systematic_errors(
        np.random.default_rng(5), radar=radar, lens=lens, reflector=ReflectorOptions(0.0, 0.0)
    )
    assert drawn == SystematicErrors()
    biased = draw_systematic_errors(np.random.default_rng(5), angle_biases=True)
    assert biased.azimuth_bias_deg != 0.0
    assert replace(biased, azimuth_bias_deg=0.0, elevation_bias_deg=0.0) == draw_systematic_errors(
        np.random.default_rng(5)
    )


def test_a_camera_apart_is_as_far_away_as_requested_and_sees_placements():
    for seed in range(12):
        rig = random_rig_apart(np.random.default_rng(seed), camera=typical_camera(), distance_m=8.0)
        assert np.linalg.norm(rig.camera_position_world_m[:2]) == pytest.approx(8.0)
        simulated = simulate_pairs(10, rng=np.random.default_rng(seed), noise="none", rig=rig)
        assert simulated.camera.project(simulated.camera_from_radar @ reported(simulated)) == pytest.approx(
            clicks(simulated), abs=1e-6
        )


def test_a_flat_radars_tilt_and_height_are_as_stated():
    rng = np.random.default_rng(2)
    drawn = [draw_flat_radar_rig(rng) for _ in range(1000)]
    assert np.std([one.radar_tilt_deg for one in drawn]) == pytest.approx(10.0, rel=0.1)
    assert np.sqrt(np.mean([one.radar_height_m**2 for one in drawn])) == pytest.approx(1.0, rel=0.1)
