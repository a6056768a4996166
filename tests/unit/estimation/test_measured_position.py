"""A measured camera position: believed as far as it was measured, and left out where the pairs contradict it."""

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.options import HOW_MEASURED, CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.results import Calibration
from calib_core.results.verdict import stated_error
from calib_core.synthetic import SimulatedPairs, simulate_pairs
from calib_core.synthetic.simulated_pairs import draw_systematic_errors

CONTRADICTED = "camera-position-contradicted"


def drawn(seed: int) -> SimulatedPairs:
    rng = np.random.default_rng([290, seed])
    return simulate_pairs(30, rng=rng, noise="imaging", outlier_share=0.1, systematic=draw_systematic_errors(rng))


def solved(simulated: SimulatedPairs, off_m: tuple[float, float, float], **how: float) -> Calibration:
    forward, left, up = (simulated.rig.camera_position_radar_m + np.array(off_m)).tolist()
    prior = CameraPositionPrior((forward, left, up), **how)
    options = CalibrationOptions(solving=SolvingOptions(camera_position=prior))
    return calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()


def off_m(answer: Calibration, simulated: SimulatedPairs) -> float:
    centre_m = answer.camera_from_radar.inverse().translation_m
    return float(np.linalg.norm(centre_m - simulated.rig.camera_position_radar_m))


def codes(answer: Calibration) -> set[str]:
    return {warning.code for warning in answer.warnings}


@pytest.mark.parametrize("slip_m", [(0.0, 0.0, 0.05), (0.05, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_a_position_a_few_centimetres_off_is_within_the_stated_error_or_contradicted(
    slip_m: tuple[float, float, float],
) -> None:
    for seed in range(4):
        simulated = drawn(seed)
        answer = solved(simulated, slip_m)
        inside = 100.0 * off_m(answer, simulated) <= stated_error(answer).position_cm
        assert inside or (any(slip_m) and CONTRADICTED in codes(answer))


@pytest.mark.parametrize("slip_m", [(0.3, 0.0, 0.0), (0.0, -0.3, 0.0), (0.0, 0.0, -0.3)])
def test_a_contradicted_position_is_left_out_and_named(slip_m: tuple[float, float, float]) -> None:
    for seed in range(4):
        simulated = drawn(seed)
        for sigma_m in (0.005, 0.03):
            answer = solved(simulated, slip_m, sigma_m=sigma_m)
            assert CONTRADICTED in codes(answer)
            assert off_m(answer, simulated) < 0.12
            assert answer.covariance_parts is not None
            assert not answer.covariance_parts.camera_position.any()


def test_a_scale_of_the_angles_is_not_blamed_without_the_measured_position() -> None:
    blamed = [
        next(
            (
                warning.message
                for warning in solved(drawn(seed), (0.0, 0.0, 0.0)).warnings
                if warning.code == "angle-scale"
            ),
            "",
        )
        for seed in range(6)
    ]
    assert any(blamed)
    assert all("not where it was measured" in text for text in blamed if text)


def test_the_ways_to_measure_have_their_standard_deviations() -> None:
    assert CameraPositionPrior((0.1, 0.2, 0.3)).sigma_m == 0.03
    sigmas_m = [CameraPositionPrior.measured((0.1, 0.2, 0.3), how).sigma_m for how in HOW_MEASURED]
    assert sigmas_m == [0.05, 0.02, 0.005]
