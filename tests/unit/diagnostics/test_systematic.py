"""A scale of the radar's azimuths and clicks beside the target are named with their amounts; sound sets give neither warning."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from calib_core.arrays import Points3
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions, CameraPositionPrior, RadarOptions, SolvingOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.synthetic import RigOptions, SimulatedPairs, simulate_pairs

FREE = CalibrationOptions()
MEASURED = CalibrationOptions(
    solving=SolvingOptions(camera_position=CameraPositionPrior(RigOptions().camera_offset_m, 0.01))
)

KNOWN_ELEVATION = replace(MEASURED, radar=RadarOptions(elevation_scale_sigma=0.0))


def drawn(seed: int, noise: str = "imaging", count: int = 20) -> SimulatedPairs:
    return simulate_pairs(count, rng=np.random.default_rng([9, seed]), noise=noise)  # type: ignore[arg-type]


def positions(simulated: SimulatedPairs) -> Points3:
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def with_positions(simulated: SimulatedPairs, points: Points3) -> tuple[Pair, ...]:
    return tuple(
        replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=point),))
        for pair, point in zip(simulated.pairs, points, strict=True)
    )


def scaled(simulated: SimulatedPairs, scale: float) -> tuple[Pair, ...]:
    polar = polar_from_cartesian(positions(simulated)) * np.array([1.0, scale, 1.0])
    return with_positions(simulated, cartesian_from_polar(polar))


def warning(pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions, code: str) -> str | None:
    outcome = calibrate_pairs(pairs, camera, options).unwrap()
    return next((one.message for one in outcome.warnings if one.code == code), None)


@pytest.mark.parametrize("options", [FREE, MEASURED])
@pytest.mark.parametrize(("scale", "words"), [(1.04, ("large", "long")), (0.96, ("small", "short"))])
def test_a_scale_is_named_with_its_amount_and_its_sign(
    scale: float, words: tuple[str, str], options: CalibrationOptions
) -> None:
    for seed in range(3):
        simulated = drawn(seed, count=30)
        text = warning(scaled(simulated, scale), simulated.camera, options, "angle-scale")
        assert text is not None
        assert all(f"too {word}" in text for word in words)
        amount, sigma = map(float, re.findall(r"([\d.]+) ± ([\d.]+) %", text)[0])
        assert abs(amount - 4.0) < 3.5 * sigma + 0.1


def test_a_wrong_focal_length_gives_the_warning_that_names_both() -> None:
    for seed in range(3):
        simulated = drawn(seed, count=30)
        matrix_px = simulated.camera.matrix_px * np.array([[1.03, 1, 1], [1, 1.03, 1], [1, 1, 1]])
        text = warning(simulated.pairs, replace(simulated.camera, matrix_px=matrix_px), MEASURED, "angle-scale")
        assert text is not None
        assert "too large; a given focal length that is too long by the same amount" in text


@pytest.mark.parametrize(
    ("offset_m", "words"),
    [((0.0, 0.15, 0.0), "below"), ((0.0, -0.15, 0.0), "above"), ((0.12, 0.0, 0.0), "to the right of")],
)
def test_clicks_beside_the_phase_centre_are_named_if_the_camera_is_measured(
    offset_m: tuple[float, float, float], words: str
) -> None:
    named, alike = [], []
    for seed in range(4):
        simulated = drawn(seed, count=40)
        pose, camera = simulated.camera_from_radar, simulated.camera
        centres = pose @ simulated.points_radar_m
        moved_px = camera.project(centres + np.array(offset_m)) - camera.project(centres)
        pairs = [
            replace(pair, pixel_px=pair.pixel_px + moved) for pair, moved in zip(simulated.pairs, moved_px, strict=True)
        ]
        named.append(warning(pairs, camera, KNOWN_ELEVATION, "clicks-off-centre") or "")
        alike.append(warning(pairs, camera, MEASURED, "angle-scale") or "")
        assert warning(pairs, camera, FREE, "clicks-off-centre") is None
    assert sum(f"cm {words} the radar's phase centre" in text for text in named) >= 3
    if words in ("above", "below"):  # on flat ground a scale of the elevations looks the same
        assert sum(f"on flat ground, clicks {words} the radar's phase centre" in text for text in alike) >= 3


@pytest.mark.parametrize("options", [FREE, MEASURED])
@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_sound_sets_give_neither_warning(noise: str, options: CalibrationOptions) -> None:
    for seed in range(6):
        simulated = drawn(seed, noise)
        outcome = calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()
        assert not {"angle-scale", "clicks-off-centre"} & {one.code for one in outcome.warnings}
