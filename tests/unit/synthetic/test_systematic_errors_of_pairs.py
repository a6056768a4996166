"""Errors that all pairs share: each does to the pairs what its description says, and nothing else changes."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.accuracy.defects.pair_defects import draw_flat_radar_rig, random_rig_apart
from calib_core.options import LensOptions, RadarOptions, ReflectorOptions
from calib_core.radar import polar_from_cartesian
from calib_core.synthetic import (
    SimulatedPairs,
    SystematicErrors,
    draw_systematic_errors,
    simulate_pairs,
    typical_camera,
)

small = st.floats(-0.1, 0.1)
pixels = st.floats(-20.0, 20.0)


def exact_pairs(errors: SystematicErrors, *, seed: int = 3) -> SimulatedPairs:
    return simulate_pairs(8, rng=np.random.default_rng(seed), noise="none", systematic=errors)


def reported(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def clicks(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.pixel_px for pair in simulated.pairs])


@settings(max_examples=20, deadline=None)
@given(small, small, small, st.floats(-0.5, 0.5))
def test_the_radar_reports_true_values_times_a_scale_plus_a_bias(
    azimuth: float, elevation: float, range_scale: float, bias_m: float
) -> None:
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
def test_clicks_are_off_by_the_same_pixels_and_by_a_place_next_to_the_phase_centre(
    offset_px: tuple[float, float], offset_m: tuple[float, float, float]
) -> None:
    simulated = exact_pairs(SystematicErrors(click_offset_px=offset_px, reflector_offset_m=offset_m))
    points = simulated.camera_from_radar @ simulated.points_radar_m
    assert clicks(simulated) - offset_px == pytest.approx(simulated.rig.camera.project(points + np.array(offset_m)))
    assert simulated.pixels_px == pytest.approx(simulated.rig.camera.project(points))


@settings(max_examples=20, deadline=None)
@given(small, st.tuples(pixels, pixels), small)
def test_the_given_intrinsics_are_wrong_and_the_pictures_are_not(
    focal_length: float, principal_point_px: tuple[float, float], distortion: float
) -> None:
    errors = SystematicErrors(focal_length=focal_length, principal_point_px=principal_point_px, distortion=distortion)
    simulated = exact_pairs(errors)
    true = simulated.rig.camera
    assert simulated.camera.matrix_px[0, 0] == pytest.approx(true.matrix_px[0, 0] * (1.0 + focal_length))
    assert simulated.camera.matrix_px[:2, 2] - true.matrix_px[:2, 2] == pytest.approx(principal_point_px)
    assert simulated.camera.distortion - true.distortion == pytest.approx([distortion, 0.0, 0.0, 0.0])
    assert np.array_equal(clicks(simulated), clicks(exact_pairs(SystematicErrors())))


@settings(max_examples=20, deadline=None)
@given(st.floats(-5.0, 5.0))
def test_an_azimuth_bias_is_a_rotation_that_the_true_pose_contains(bias_deg: float) -> None:
    simulated = exact_pairs(SystematicErrors(azimuth_bias_deg=bias_deg))
    projected = simulated.camera.project(simulated.camera_from_radar @ reported(simulated))
    assert projected == pytest.approx(clicks(simulated), abs=1e-6)
    assert reported(simulated) == pytest.approx(simulated.points_radar_m, abs=1e-9)


def test_an_elevation_bias_is_nearly_a_rotation() -> None:
    simulated = exact_pairs(SystematicErrors(elevation_bias_deg=1.0))
    off_rad = polar_from_cartesian(reported(simulated))[:, 1:] - polar_from_cartesian(simulated.points_radar_m)[:, 1:]
    unbiased = polar_from_cartesian(reported(exact_pairs(SystematicErrors())))
    assert polar_from_cartesian(reported(simulated)) - unbiased == pytest.approx(
        np.tile([0.0, 0.0, np.deg2rad(1.0)], (8, 1)), abs=1e-9
    )
    assert np.abs(off_rad).max() < np.deg2rad(0.4)  # 1 - cos(35 deg) of a degree, and more in azimuth below the radar


@pytest.mark.parametrize("z_m", [0.0, 0.5])
def test_a_radar_without_elevation_reports_range_and_azimuth_in_a_plane(z_m: float) -> None:
    flat = exact_pairs(SystematicErrors(measures_elevation=False, constant_z_m=z_m))
    true = polar_from_cartesian(flat.points_radar_m)
    across = reported(flat)[:, :2]
    assert np.hypot(*across.T) == pytest.approx(true[:, 0])
    assert np.arctan2(across[:, 1], across[:, 0]) == pytest.approx(true[:, 1])
    assert (reported(flat)[:, 2] == z_m).all()
    decoyed = simulate_pairs(6, rng=np.random.default_rng(1), decoys=2, outlier_share=0.5, systematic=flat.systematic)
    assert {float(one.position_radar_m[2]) for pair in decoyed.pairs for one in pair.candidates} == {z_m}


def test_errors_are_as_large_as_the_options_state() -> None:
    rng = np.random.default_rng(5)
    drawn = [draw_systematic_errors(rng) for _ in range(2000)]
    radar, lens, reflector = RadarOptions(), LensOptions(), ReflectorOptions()
    stated = {
        "azimuth_scale": radar.azimuth_scale_sigma,
        "elevation_scale": radar.elevation_scale_sigma,
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


def test_exact_instruments_draw_no_errors() -> None:
    radar, lens = RadarOptions(0.0, 0.0, 0.0, 0.0), LensOptions(0.0, 0.0, 0.0)
    drawn = draw_systematic_errors(
        np.random.default_rng(5), radar=radar, lens=lens, reflector=ReflectorOptions(0.0, 0.0)
    )
    assert drawn == SystematicErrors()
    biased = draw_systematic_errors(np.random.default_rng(5), angle_biases=True)
    assert biased.azimuth_bias_deg != 0.0
    assert replace(biased, azimuth_bias_deg=0.0, elevation_bias_deg=0.0) == draw_systematic_errors(
        np.random.default_rng(5)
    )


def test_a_camera_apart_is_as_far_away_as_requested_and_sees_placements() -> None:
    for seed in range(12):
        rig = random_rig_apart(np.random.default_rng(seed), camera=typical_camera(), distance_m=8.0)
        assert np.linalg.norm(rig.camera_position_world_m[:2]) == pytest.approx(8.0)
        simulated = simulate_pairs(10, rng=np.random.default_rng(seed), noise="none", rig=rig)
        assert simulated.camera.project(simulated.camera_from_radar @ reported(simulated)) == pytest.approx(
            clicks(simulated), abs=1e-6
        )


def test_a_flat_radars_tilt_and_height_are_as_stated() -> None:
    rng = np.random.default_rng(2)
    drawn = [draw_flat_radar_rig(rng) for _ in range(1000)]
    assert np.std([one.radar_tilt_deg for one in drawn]) == pytest.approx(10.0, rel=0.1)
    assert np.sqrt(np.mean([one.radar_height_m**2 for one in drawn])) == pytest.approx(1.0, rel=0.1)
