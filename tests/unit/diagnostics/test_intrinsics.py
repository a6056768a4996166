"""Wrong intrinsics and angles that change with the range are reported with the right amount; right ones are not reported."""

import re
from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import NS_PER_S, Pair, TimeNs
from calib_core.options import CalibrationOptions, CameraPositionPrior, RadarOptions, SolvingOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import DataWarning
from calib_core.synthetic import RigOptions, SimulatedPairs, simulate_pairs

EXACT_RADAR = RadarOptions(
    azimuth_scale_sigma=0.0, elevation_scale_sigma=0.0, range_bias_sigma_m=0.0, range_scale_sigma=0.0
)
POSITION = SolvingOptions(camera_position=CameraPositionPrior(RigOptions().camera_offset_m, 0.01))
FREE = CalibrationOptions(radar=EXACT_RADAR)
MEASURED = CalibrationOptions(radar=EXACT_RADAR, solving=POSITION)


def suspected(seed: int, noise: str, options: CalibrationOptions, *, focal: float = 1.0, count: int = 20) -> str | None:
    simulated = simulate_pairs(count, rng=np.random.default_rng([7, seed]), noise=noise)
    matrix_px = simulated.camera.matrix_px * np.array([[focal, 1, 1], [1, focal, 1], [1, 1, 1]])
    return warning_with(replace(simulated.camera, matrix_px=matrix_px), simulated.pairs, options)


def warning_with(camera: Camera, pairs: object, options: CalibrationOptions) -> str | None:
    outcome = calibrate_pairs(pairs, camera, options).unwrap()
    return text_of(outcome.warnings)


def text_of(warnings: tuple[DataWarning, ...]) -> str | None:
    found = [one.message for one in warnings if one.code == "intrinsics-suspected"]
    return found[0] if found else None


@pytest.mark.parametrize(("focal", "word"), [(1.03, "too long"), (0.97, "too short")])
def test_a_focal_length_that_is_three_percent_off_is_reported_with_amount_and_sign(focal, word):
    for seed in range(3):
        text = suspected(seed, "imaging", MEASURED, focal=focal)
        assert text is not None
        assert word in text
        amount, sigma = map(float, re.findall(r"([\d.]+) ± ([\d.]+) %", text)[0])
        assert abs(amount - 3.0) < 3.5 * sigma
        assert sigma < 0.7


def test_a_distortion_that_was_forgotten_is_suspected():
    for seed in range(3):
        simulated = simulate_pairs(30, rng=np.random.default_rng([8, seed]), noise="imaging")
        straight = replace(simulated.camera, distortion=np.zeros(4))
        text = warning_with(straight, simulated.pairs, MEASURED)
        assert text is not None
        assert "grow with" in text


@pytest.mark.parametrize("options", [CalibrationOptions(), CalibrationOptions(solving=POSITION)])
@pytest.mark.parametrize("angle", ["azimuths", "elevations"])
@pytest.mark.parametrize("slope_deg", [-0.4, 0.4])
def test_angles_that_change_with_the_range_are_reported_with_amount_and_sign(slope_deg, angle, options):
    for seed in range(3):
        simulated = simulate_pairs(30, rng=np.random.default_rng([9, seed]), noise="imaging")
        axis = np.eye(3)[1 if angle == "azimuths" else 2]
        pairs = []
        for pair in simulated.pairs:
            polar = polar_from_cartesian(pair.candidates[0].position_radar_m[None])[0]
            bent_m = cartesian_from_polar((polar + axis * np.deg2rad(slope_deg * (polar[0] - 6.0)))[None])[0]
            pairs.append(replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=bent_m),)))
        warnings = calibrate_pairs(pairs, simulated.camera, options).unwrap().warnings
        (text,) = [
            one.message for one in warnings if one.code == "shared-error-suspected" and "per metre" in one.message
        ]
        assert angle in text
        amount, sigma = map(float, re.findall(r"([-+][\d.]+) ± ([\d.]+) deg", text)[0])
        assert abs(amount - slope_deg) < 4.0 * sigma + 0.3 * abs(slope_deg)
        assert not any(
            "per metre" in one.message for one in calibrate_pairs(simulated.pairs, simulated.camera).unwrap().warnings
        )


@pytest.mark.parametrize("options", [FREE, MEASURED, CalibrationOptions(), CalibrationOptions(solving=POSITION)])
@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_right_intrinsics_are_not_suspected(noise, options):
    assert [suspected(seed, noise, options) for seed in range(6)] == [None] * 6


def test_a_focal_length_that_the_radars_scale_explains_is_not_blamed_on_the_lens():
    for seed in range(3):
        assert suspected(seed, "imaging", CalibrationOptions(solving=POSITION), focal=1.03) is None


def test_a_few_pairs_are_not_tested():
    assert suspected(0, "imaging", MEASURED, focal=1.03, count=8) is None


def turned(simulated: SimulatedPairs, *, first: int, turn_deg: float = 3.0, timed: bool = True) -> list[Pair]:
    """Turn the camera upwards before pair `first`."""
    turn = RigidTransform(rotation_exp(np.deg2rad([turn_deg, 0.0, 0.0])), np.zeros(3))
    points = simulated.camera_from_radar @ simulated.points_radar_m
    moves_px = simulated.camera.project(turn @ points) - simulated.camera.project(points)
    return [
        replace(
            pair,
            pixel_px=pair.pixel_px + (moves_px[i] if i >= first else 0.0),
            image_time=TimeNs((i + 1) * 20 * NS_PER_S) if timed else None,
        )
        for i, pair in enumerate(simulated.pairs)
    ]


def said_of_a_turn(pairs: list[Pair], simulated: SimulatedPairs, code: str = "shared-error-suspected") -> list[str]:
    warnings = calibrate_pairs(pairs, simulated.camera).unwrap().warnings
    return [one.message for one in warnings if one.code == code and "to have turned" in one.message]


def test_a_turn_between_two_placements_is_reported_with_its_angle_and_its_place():
    for seed in range(3):
        simulated = simulate_pairs(30, rng=np.random.default_rng([10, seed]), noise="imaging")
        (text,) = said_of_a_turn(turned(simulated, first=15, turn_deg=1.5), simulated)
        angle, before, after = map(float, re.findall(r"about ([\d.]+) deg near p(\d+) and p(\d+)", text)[0])
        assert angle == pytest.approx(1.5, abs=0.6)
        assert abs(before - 15) <= 3
        assert after == before + 1
        assert said_of_a_turn(turned(simulated, first=15, turn_deg=0.0), simulated) == []
        assert said_of_a_turn(turned(simulated, first=15, turn_deg=1.5, timed=False), simulated) == []
        assert said_of_a_turn(turned(simulated, first=28, turn_deg=1.5), simulated) == []


def test_pairs_that_were_set_aside_after_a_turn_are_said_to_be_the_last():
    simulated = simulate_pairs(30, rng=np.random.default_rng([11, 0]), noise="imaging")
    (text,) = said_of_a_turn(turned(simulated, first=25), simulated, "agreeing-outliers")
    assert "they are the last in time" in text
    assert said_of_a_turn(turned(simulated, first=25, timed=False), simulated, "agreeing-outliers") == []
