"""Errors that all pairs share are named with the right amount, of lens, angles, ranges or a turn; sound sets name none."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import FIELD, SimulatedPairs, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import NS_PER_S, Facts, Pair, TimeNs
from calib_core.options import CalibrationOptions, CameraPositionPrior, RadarOptions, SolvingOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration, DataWarning
from calib_core.synthetic.rig import RigOptions

EXACT_RADAR = RadarOptions(
    azimuth_scale_sigma=0.0, elevation_scale_sigma=0.0, range_bias_sigma_m=0.0, range_scale_sigma=0.0
)
POSITION = SolvingOptions(camera_position=CameraPositionPrior(RigOptions().camera_offset_m, 0.01))
FREE = CalibrationOptions(radar=EXACT_RADAR)
MEASURED = CalibrationOptions(radar=EXACT_RADAR, solving=POSITION)


def suspected(
    seed: int, noise: str, options: CalibrationOptions, *, focal: float = 1.0, count: int = 20
) -> DataWarning | None:
    simulated = simulate_pairs(count, rng=np.random.default_rng([7, seed]), noise=noise)
    matrix_px = simulated.camera.matrix_px * np.array([[focal, 1, 1], [1, focal, 1], [1, 1, 1]])
    return warning_with(replace(simulated.camera, matrix_px=matrix_px), simulated.pairs, options)


def warning_with(camera: Camera, pairs: object, options: CalibrationOptions) -> DataWarning | None:
    outcome = calibrate_pairs(pairs, camera, options).unwrap()
    return next((one for one in outcome.warnings if one.code == "intrinsics-suspected"), None)


@pytest.mark.parametrize("focal", [1.03, 0.97])
def test_a_focal_length_that_is_three_percent_off_is_reported_with_amount_and_sign(focal):
    for seed in range(3):
        warning = suspected(seed, "imaging", MEASURED, focal=focal)
        assert warning is not None
        assert warning.facts["focal_length"] == pytest.approx(1.0 - focal, abs=3.5 * warning.facts["sigma"])
        assert warning.facts["sigma"] < 0.009


def test_a_distortion_that_was_forgotten_is_suspected():
    for seed in range(3):
        simulated = simulate_pairs(30, rng=np.random.default_rng([8, seed]), noise="imaging")
        straight = replace(simulated.camera, distortion=np.zeros(4))
        assert warning_with(straight, simulated.pairs, MEASURED) is not None


def slopes(calibration: Calibration) -> list[Facts]:
    """Return what is said of angles that change with something."""
    return [one.facts for one in calibration.warnings if "quantity" in one.facts]


@pytest.mark.slow
@pytest.mark.parametrize("options", [CalibrationOptions(), CalibrationOptions(solving=POSITION)])
@pytest.mark.parametrize("angle", ["azimuth", "elevation"])
@pytest.mark.parametrize("slope_deg", [-0.4, 0.4])
def test_angles_that_change_with_the_range_are_reported_with_amount_and_sign(slope_deg, angle, options):
    for seed in range(3):
        simulated = simulate_pairs(30, rng=np.random.default_rng([9, seed]), noise="imaging")
        axis = np.eye(3)[1 if angle == "azimuth" else 2]
        pairs = []
        for pair in simulated.pairs:
            polar = polar_from_cartesian(pair.candidates[0].position_radar_m[None])[0]
            bent_m = cartesian_from_polar((polar + axis * np.deg2rad(slope_deg * (polar[0] - 6.0)))[None])[0]
            pairs.append(replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=bent_m),)))
        (facts,) = slopes(calibrate_pairs(pairs, simulated.camera, options).unwrap())
        assert (angle, "range") in [(facts["quantity"], facts["shape"]), *facts["beside"]]
        if facts["quantity"] != angle:
            continue
        ranges_m = np.linalg.norm(simulated.points_radar_m, axis=1)
        from_mean_m = ranges_m - ranges_m.mean()
        largest_deg = slope_deg * from_mean_m[np.abs(from_mean_m).argmax()]
        allowed = 4.0 * np.rad2deg(facts["largest_sigma"]) + 0.3 * abs(largest_deg)
        assert np.rad2deg(facts["largest"]) == pytest.approx(largest_deg, abs=allowed)
        assert slopes(calibrate_pairs(simulated.pairs, simulated.camera).unwrap()) == []


@pytest.mark.slow
@pytest.mark.parametrize("options", [FREE, MEASURED, CalibrationOptions(), CalibrationOptions(solving=POSITION)])
@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_right_intrinsics_are_not_suspected(noise, options):
    assert [suspected(seed, noise, options) for seed in range(6)] == [None] * 6


def test_a_focal_length_that_the_radars_scale_explains_is_not_blamed_on_the_lens():
    for seed in range(3):
        assert suspected(seed, "imaging", CalibrationOptions(solving=POSITION), focal=1.03) is None


def test_a_few_pairs_are_not_tested():
    assert suspected(0, "imaging", MEASURED, focal=1.03, count=8) is None


def bent(simulated: SimulatedPairs, change: Callable[[np.ndarray], np.ndarray]) -> list[Pair]:
    """Return the pairs of a radar that reports other ranges [m], azimuths and elevations [rad] (n, 3)."""
    positions = np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])
    moved_m = cartesian_from_polar(change(polar_from_cartesian(positions)))
    return [
        replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=position),))
        for pair, position in zip(simulated.pairs, moved_m, strict=True)
    ]


def causes(pairs: Sequence[Pair], simulated: SimulatedPairs) -> list[tuple[str, ...]]:
    """Return what is named: an error with a prior, or a quantity and the shape of its error."""
    facts = [one.facts for one in calibrate_pairs(pairs, simulated.camera).unwrap().warnings]
    return [(one["error"],) for one in facts if "prior_sigma" in one] + [
        (one["quantity"], one["shape"]) for one in facts if "quantity" in one
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (lambda polar: polar * [1.0, 1.0, 0.5], ("elevation_scale",)),
        (lambda polar: polar + np.outer(polar[:, 1] ** 2, [0.0, 0.2, 0.0]), ("azimuth", "azimuth^2")),
        (
            lambda polar: np.column_stack([polar[:, 0], np.arcsin(np.tan(polar[:, 1])), polar[:, 2]]),
            ("azimuth", "azimuth^3"),
        ),
    ],
)
def test_another_way_of_reporting_angles_is_named_by_its_shape(change, cause):
    tripods = replace(FIELD, max_height_m=2.0)
    named = []
    for seed in range(5):
        simulated = simulate_pairs(40, rng=np.random.default_rng([12, seed]), noise="imaging", layout=tripods)
        named += causes(bent(simulated, change), simulated)
        assert causes(simulated.pairs, simulated) == []
    assert named.count(cause) >= 3


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


def turns(pairs: list[Pair], simulated: SimulatedPairs) -> list[Facts]:
    """Return what is said of a turn between two placements."""
    warnings = calibrate_pairs(pairs, simulated.camera).unwrap().warnings
    return [one.facts for one in warnings if one.facts.get("step") == "turn"]


@pytest.mark.slow
def test_a_turn_between_two_placements_is_reported_with_its_angle_and_its_place():
    for seed in range(3):
        simulated = simulate_pairs(30, rng=np.random.default_rng([10, seed]), noise="imaging")
        (facts,) = turns(turned(simulated, first=15, turn_deg=1.5), simulated)
        names = [pair.id for pair in simulated.pairs]
        before, after = names.index(facts["before"]), names.index(facts["after"])
        assert np.rad2deg(facts["size"]) == pytest.approx(1.5, abs=0.6)
        assert abs(before - 14) <= 3
        assert after == before + 1
        assert turns(turned(simulated, first=15, turn_deg=0.0), simulated) == []
        assert not facts["by_number"]
        assert turns(turned(simulated, first=28, turn_deg=1.5), simulated) == []


def numbered(pairs: list[Pair]) -> list[Pair]:
    return [replace(pair, id=f"pair-{number}", image_time=None) for number, pair in enumerate(pairs, start=1)]


@pytest.mark.slow
def test_pairs_without_times_may_be_numbered_in_order_of_time_but_sorted_ones_are_not():
    for seed in range(3):
        simulated = simulate_pairs(30, rng=np.random.default_rng([10, seed]), noise="imaging")
        pairs = turned(simulated, first=15, turn_deg=1.5)
        (facts,) = turns(numbered(pairs), simulated)
        assert facts["by_number"]
        assert (
            turns([replace(pair, id=name) for pair, name in zip(numbered(pairs), names(30), strict=True)], simulated)
            == []
        )
        by_range = sorted(pairs, key=lambda pair: float(np.linalg.norm(pair.candidates[0].position_radar_m)))
        assert turns(numbered(by_range), simulated) == []


def names(count: int) -> list[str]:
    """Return ids without numbers."""
    return [f"{chr(97 + k // 26)}{chr(97 + k % 26)}" for k in range(count)]


def test_pairs_that_were_set_aside_after_a_turn_are_said_to_be_the_last():
    simulated = simulate_pairs(30, rng=np.random.default_rng([11, 0]), noise="imaging")
    for timed in (True, False):
        warnings = calibrate_pairs(turned(simulated, first=25, timed=timed), simulated.camera).unwrap().warnings
        in_time = [one.facts["in_time"] for one in warnings if one.code == "agreeing-outliers"]
        assert in_time == (["last"] if timed else [""])
