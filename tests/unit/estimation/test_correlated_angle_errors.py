"""Angle errors that neighbouring placements share are detected and included in the stated uncertainty."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration
from calib_core.synthetic import FIELD, SimulatedPairs, simulate_pairs

MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))
CROWDED = replace(FIELD, separation_m=0.05)


def smooth(rng: np.random.Generator, directions: np.ndarray, rms_rad: float) -> np.ndarray:
    """Draw a smooth function of azimuth and elevation (n, 2), about 14 deg from hill to valley."""
    waves, phases = rng.standard_normal((200, 2)) / 0.25, rng.uniform(0.0, 2.0 * np.pi, 200)
    return rms_rad * np.sqrt(2.0 / 200.0) * np.cos(directions @ waves.T + phases) @ rng.standard_normal(200)


def with_smooth_errors(seed: int, count: int) -> SimulatedPairs:
    """Replace independent noise by 0.3 and 0.8 deg of smooth errors and a quarter as much of independent ones."""
    rng = np.random.default_rng(seed)
    simulated = simulate_pairs(count, rng=rng, layout=CROWDED)
    polar = polar_from_cartesian(simulated.points_radar_m)
    off = np.deg2rad([0.08, 0.22]) * rng.standard_normal((count, 2))
    off += np.stack([smooth(rng, polar[:, 1:], np.deg2rad(rms_deg)) for rms_deg in (0.3, 0.8)], axis=1)
    polar[:, 0] += 0.005 * rng.standard_normal(count)
    polar[:, 1:] += off
    pairs = tuple(
        replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=point),))
        for pair, point in zip(simulated.pairs, cartesian_from_polar(polar), strict=True)
    )
    return replace(simulated, pairs=pairs)


def solved(simulated: SimulatedPairs) -> Calibration:
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, MEASURED)
    assert isinstance(outcome, Calibration)
    return outcome


@pytest.mark.slow
def test_the_ellipsoid_contains_the_truth_despite_smooth_errors() -> None:
    """If the errors were taken as independent, it would contain the truth in fewer than 3 of 24 sets."""
    inside = 0
    for seed in range(24):
        simulated = with_smooth_errors(seed, 80)
        calibration = solved(simulated)
        error = simulated.camera_from_radar.error_from(calibration.camera_from_radar)
        inside += bool(error @ np.linalg.solve(calibration.covariance, error) < calibration.covariance_quantile)
    assert inside >= 20


def test_smooth_errors_raise_a_warning_and_independent_ones_do_not() -> None:
    smooth_one = solved(with_smooth_errors(1, 60))
    plain = solved(simulate_pairs(60, rng=np.random.default_rng(1), layout=CROWDED))
    assert "smooth-angle-errors" in {warning.code for warning in smooth_one.warnings}
    assert "smooth-angle-errors" not in {warning.code for warning in plain.warnings}


def test_more_pairs_do_not_average_smooth_errors_out() -> None:
    few, many = (np.trace(solved(with_smooth_errors(2, count)).covariance[3:, 3:]) for count in (40, 160))
    assert many > 0.4 * few
