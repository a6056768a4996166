"""A radar without elevation: the uncertainty covers the unknown elevation, and the warning says what determines what."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs, preview_pairs
from calib_core.geometry import RigidTransform
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.results import Calibration
from calib_core.synthetic import FIELD, RigOptions, simulate_pairs

LEVEL = RigOptions(radar_tilt_deg=0.0)
FREE = CalibrationOptions()
MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior(LEVEL.camera_offset_m, 0.01)))


def flattened(pair: Pair) -> Pair:
    """Reduce a pair to range and azimuth, as reported by a radar without elevation."""
    (candidate,) = pair.candidates
    x, y, _ = candidate.position_radar_m
    range_m, azimuth_rad = np.linalg.norm(candidate.position_radar_m), np.arctan2(y, x)
    flat = range_m * np.array([np.cos(azimuth_rad), np.sin(azimuth_rad), 0.0])
    return replace(pair, candidates=(replace(candidate, position_radar_m=flat),))


def solved(seed: int, height_m: float, options: CalibrationOptions) -> tuple[Calibration, RigidTransform]:
    layout = replace(FIELD, height_m=height_m)
    simulated = simulate_pairs(20, rng=np.random.default_rng([9, seed]), layout=layout, rig_options=LEVEL)
    outcome = calibrate_pairs([flattened(pair) for pair in simulated.pairs], simulated.camera, options)
    assert isinstance(outcome, Calibration)
    return outcome, simulated.camera_from_radar


@pytest.mark.parametrize("options", [FREE, MEASURED])
@pytest.mark.parametrize("height_m", [0.025, 1.2])
def test_the_truth_lies_inside_whether_the_reflector_stood_on_the_ground_or_at_the_radars_height(
    height_m: float, options: CalibrationOptions
) -> None:
    inside = 0
    for seed in range(10):
        calibration, truth = solved(seed, height_m, options)
        error = truth.error_from(calibration.camera_from_radar)
        inside += bool(error @ np.linalg.solve(calibration.covariance, error) < calibration.covariance_quantile)
    assert inside >= 8


@pytest.mark.parametrize("reported_z_m", [0.5, 1e-5])
def test_a_radar_that_reports_one_height_or_rounded_zeros_is_flat_too(reported_z_m: float) -> None:
    """Drivers add the mounting height, or convert zeros back and forth: judged as elevations, both are wrong by metres."""
    rng, inside = np.random.default_rng(4), 0
    for seed in range(6):
        simulated = simulate_pairs(15, rng=np.random.default_rng([11, seed]), rig_options=LEVEL)
        pairs = []
        for pair in map(flattened, simulated.pairs):
            (candidate,) = pair.candidates
            z_m = reported_z_m if reported_z_m > 0.1 else reported_z_m * rng.standard_normal()
            raised = candidate.position_radar_m + np.array([0.0, 0.0, z_m])
            pairs.append(replace(pair, candidates=(replace(candidate, position_radar_m=raised),)))
        outcome = calibrate_pairs(pairs, simulated.camera, FREE)
        assert isinstance(outcome, Calibration)
        error = simulated.camera_from_radar.error_from(outcome.camera_from_radar)
        inside += bool(error @ np.linalg.solve(outcome.covariance, error) < outcome.covariance_quantile)
        assert "flat-radar" in {one.code for one in outcome.warnings}
    assert inside == 6


def test_the_warning_says_what_the_pairs_determine_and_what_is_assumed() -> None:
    calibration, _ = solved(1, 1.2, FREE)
    (warning,) = (one for one in calibration.warnings if one.code == "flat-radar")
    determined, assumed = warning.message.split("; up ")
    assert "yaw ± 0." in determined
    assert "pitch ± 1" in assumed
    assert "tilt and height" in warning.hint


def test_the_covariance_of_a_radar_with_elevation_is_not_widened() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(2))
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, MEASURED)
    assert isinstance(outcome, Calibration)
    assert np.sqrt(outcome.covariance[3:, 3:].trace()) < np.deg2rad(1.5)


def test_the_first_preview_of_a_radar_without_elevation_says_so() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), rig_options=LEVEL)
    preview = preview_pairs([flattened(pair) for pair in simulated.pairs], simulated.camera)
    assert isinstance(preview, Calibration)
    assert preview.checking
    assert not preview.sees_elevation
    assert np.trace(preview.firm_covariance) < np.trace(preview.covariance)
