"""The pipeline from pairs to a pose, on pairs whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.calibration import calibrate, calibrate_pairs
from calib_core.measurements import MIN_PAIRS
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.results import Calibration
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate

MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))


def solved(simulated: SimulatedPairs, options: CalibrationOptions = MEASURED) -> Calibration:
    return calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()


def error_in_sigmas(simulated: SimulatedPairs, calibration: Calibration) -> float:
    error = simulated.camera_from_radar.error_from(calibration.camera_from_radar)
    return float(np.sqrt(error @ np.linalg.solve(calibration.covariance, error)))


def test_exact_pairs_give_the_exact_pose():
    simulated = simulate_pairs(12, rng=np.random.default_rng(1), noise="none")
    free = solved(simulated, CalibrationOptions())
    error = simulated.camera_from_radar.error_from(free.camera_from_radar)
    # the wide prior of the camera position still has a tiny effect
    assert np.linalg.norm(error[3:]) < 1e-4
    assert np.linalg.norm(error[:3]) < 2e-3
    assert free.metrics.aed_px < 0.05


@pytest.mark.parametrize("noise", ["ti", "ti_fine", "imaging"])
def test_a_third_of_wrong_pairs_is_detected_and_does_not_move_the_pose(noise):
    simulated = simulate_pairs(24, rng=np.random.default_rng(5), noise=noise, outlier_share=0.33)
    calibration = solved(simulated)
    named = np.array([pair.outlier_probability > 0.5 for pair in calibration.pairs])
    assert (named == simulated.outlier).mean() > 0.9
    assert error_in_sigmas(simulated, calibration) < np.sqrt(calibration.covariance_quantile) * 1.3


def test_decoy_candidates_are_not_chosen_instead_of_the_reflector():
    simulated = simulate_pairs(16, rng=np.random.default_rng(3), noise="ti_fine", decoys=4)
    calibration = solved(simulated)
    chosen = tuple(pair.candidate for pair in calibration.pairs)
    assert chosen == simulated.true_candidate


def test_fewer_than_four_pairs_are_unsolvable_with_the_count():
    simulated = simulate_pairs(5, rng=np.random.default_rng(2))
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, MEASURED, frozenset({"p1", "p2"}))
    assert outcome.code == "too-few-pairs"
    assert outcome.facts == {"used": 3, "needed": MIN_PAIRS, "excluded": 2, "unpaired": 0, "untouched": 0}


def test_an_excluded_pair_is_shown_but_changes_nothing():
    simulated = simulate_pairs(12, rng=np.random.default_rng(4))
    without = calibrate_pairs(simulated.pairs[:-1], simulated.camera, MEASURED)
    shown = calibrate_pairs(simulated.pairs, simulated.camera, MEASURED, frozenset({"p12"}))
    assert isinstance(without, Calibration)
    assert shown.camera_from_radar.as_matrix().tobytes() == without.camera_from_radar.as_matrix().tobytes()
    assert shown.pairs[-1].excluded
    assert not shown.pairs[-1].inlier
    assert np.isfinite(shown.pairs[-1].distance_px)
    assert shown.metrics == without.metrics


def test_the_paper_method_is_dispatched():
    simulated = simulate_pairs(12, rng=np.random.default_rng(6), noise="imaging")
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, replace(CalibrationOptions(), method="paper")).unwrap()
    assert np.isnan(outcome.covariance).all()


def test_metrics_are_over_the_inliers_and_held_out_is_larger():
    simulated = simulate_pairs(20, rng=np.random.default_rng(8), outlier_share=0.2)
    calibration = solved(simulated)
    inliers = [pair for pair in calibration.pairs if pair.inlier]
    assert calibration.metrics.n == len(inliers)
    assert calibration.metrics.aed_px == pytest.approx(np.mean([pair.distance_px for pair in inliers]))
    assert calibration.metrics.held_out_aed_px > calibration.metrics.aed_px


def test_repeated_clicks_at_one_place_are_unsolvable():
    simulated = simulate_pairs(4, rng=np.random.default_rng(9))
    repeated = [replace(simulated.pairs[0], id=f"again-{k}") for k in range(6)]
    outcome = calibrate_pairs(repeated, simulated.camera, CalibrationOptions())
    assert outcome.code == "degenerate-placements"


def test_placements_along_one_line_are_unsolvable_without_a_camera_position():
    simulated = simulate_pairs(4, rng=np.random.default_rng(9))
    line = np.array([[4.0 + k, 1.0, -0.8] for k in range(6)])
    pixels = simulated.camera.project(simulated.camera_from_radar @ line)
    example = simulated.pairs[0].candidates[0]
    pairs = [
        replace(
            simulated.pairs[0], id=f"l{k}", pixel_px=pixels[k], candidates=(replace(example, position_radar_m=line[k]),)
        )
        for k in range(6)
    ]
    outcome = calibrate_pairs(pairs, simulated.camera, CalibrationOptions())
    assert outcome.code == "degenerate-placements"


def test_clicks_unrelated_to_the_radar_are_unsolvable():
    rng = np.random.default_rng(10)
    simulated = simulate_pairs(8, rng=rng)
    random = [replace(pair, pixel_px=rng.uniform(0.0, 1000.0, 2)) for pair in simulated.pairs]
    outcome = calibrate_pairs(random, simulated.camera, MEASURED)
    assert outcome.code in ("mirrored-axes", "no-pose")
    assert outcome.facts["pairs"] == 8


@pytest.mark.slow
def test_a_whole_simulated_session_is_solved_within_its_uncertainty():
    session = simulate(SimulationOptions(placements=12, seed=4))
    options = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.015)))
    outcome = calibrate(session.clicks, session.scans, session.camera, options).unwrap()
    truth = session.stage.rig.camera_from_radar
    error = truth.error_from(outcome.camera_from_radar)
    assert error @ np.linalg.solve(outcome.covariance, error) < 1.5 * outcome.covariance_quantile
    at = {click.id: place.position_radar_m for click, place in zip(session.clicks, session.placements, strict=True)}
    for pair in outcome.pairs:
        assert not pair.inlier or np.linalg.norm(pair.point_radar_m - at[pair.id]) < 1.0
