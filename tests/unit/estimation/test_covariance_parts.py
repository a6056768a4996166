"""What of a covariance rests on stated sigmas is what the pose moves by if these errors are there."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.fleet import session_pose
from calib_core.measurements import Pair
from calib_core.options import (
    CalibrationOptions,
    CameraPositionPrior,
    LensOptions,
    RadarOptions,
    ReflectorOptions,
    SolvingOptions,
)
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration
from calib_core.results.calibration import CovarianceParts
from calib_core.synthetic import simulate_pairs

_SIGMA_M = 0.02
_STEP = 0.02
"""Share of a sigma by which each error is changed: the pose follows in proportion."""
_RADAR = RadarOptions(range_scale_sigma=0.0)


def moved_by(pairs: Sequence[Pair], change: Callable[[np.ndarray], np.ndarray]) -> tuple[Pair, ...]:
    """Change what the radar reports: range, azimuth and elevation of every position."""

    def changed(pair: Pair) -> Pair:
        candidates = tuple(
            replace(one, position_radar_m=cartesian_from_polar(change(polar_from_cartesian(one.position_radar_m))))
            for one in pair.candidates
        )
        return replace(pair, candidates=candidates)

    return tuple(changed(pair) for pair in pairs)


@dataclass(frozen=True)
class Drawn:
    """Pairs with a tape that is right, and their answer."""

    pairs: tuple[Pair, ...]
    camera: Camera
    tape_m: np.ndarray
    answer: Calibration

    @classmethod
    def of(cls, seed: int) -> "Drawn":
        simulated = simulate_pairs(20, rng=np.random.default_rng(seed), noise="ti")
        tape_m = simulated.camera_from_radar.inverse().translation_m
        answer = calibrate_pairs(simulated.pairs, simulated.camera, with_tape(tape_m)).unwrap()
        return cls(simulated.pairs, simulated.camera, tape_m, answer)

    def moves(self, pairs: Sequence[Pair], tape_m: np.ndarray) -> np.ndarray:
        """Return what the pose moves by (6,), for a whole sigma."""
        other = calibrate_pairs(pairs, self.camera, with_tape(tape_m)).unwrap()
        return other.camera_from_radar.error_from(self.answer.camera_from_radar) / _STEP


def with_tape(position_m: np.ndarray) -> CalibrationOptions:
    """Return options with a measured camera position, and no error that is not estimated."""
    forward, left, up = position_m.tolist()
    solving = SolvingOptions(camera_position=CameraPositionPrior((forward, left, up), _SIGMA_M))
    return CalibrationOptions(
        radar=_RADAR, lens=LensOptions(0.0, 0.0, 0.0), reflector=ReflectorOptions(0.0, 0.0), solving=solving
    )


@pytest.fixture(scope="module")
def drawn() -> tuple[Drawn, ...]:
    return tuple(Drawn.of(seed) for seed in range(4))


def test_the_systematic_part_is_what_errors_of_the_radar_move_the_pose_by(drawn: tuple[Drawn, ...]) -> None:
    bias_m, *scales = (
        _STEP * sigma for sigma in (_RADAR.range_bias_sigma_m, _RADAR.azimuth_scale_sigma, _RADAR.elevation_scale_sigma)
    )
    changes = (
        lambda polar: polar + np.array([bias_m, 0.0, 0.0]),
        lambda polar: polar * np.array([1.0, 1.0 + scales[0], 1.0]),
        lambda polar: polar * np.array([1.0, 1.0, 1.0 + scales[1]]),
    )
    expected = sum(one.moves(moved_by(one.pairs, change), one.tape_m) ** 2 for one in drawn for change in changes)
    np.testing.assert_allclose(sum(diagonal(one, "systematic") for one in drawn), expected, rtol=0.2)


def test_the_part_of_the_tape_is_what_another_reading_moves_the_pose_by(drawn: tuple[Drawn, ...]) -> None:
    readings = _STEP * _SIGMA_M * np.eye(3)
    expected = sum(one.moves(one.pairs, one.tape_m + reading) ** 2 for one in drawn for reading in readings)
    np.testing.assert_allclose(sum(diagonal(one, "camera_position") for one in drawn), expected, rtol=0.1)


def diagonal(drawn: Drawn, part: str) -> np.ndarray:
    """Return the variances (6,) of a part."""
    return np.diag(getattr(drawn.answer.covariance_parts, part))


def test_errors_that_only_widen_count_as_systematic_and_the_parts_never_exceed_the_whole() -> None:
    for seed in range(4):
        simulated = simulate_pairs(12, rng=np.random.default_rng(seed), noise="ti")
        prior = CameraPositionPrior((0.05, -0.1, 0.12), 0.05)
        options = CalibrationOptions(solving=SolvingOptions(camera_position=prior))
        whole = calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()
        narrow = calibrate_pairs(simulated.pairs, simulated.camera, replace(options, lens=LensOptions(0.0, 0.0, 0.0)))
        parts, fewer = whole.covariance_parts, narrow.unwrap().covariance_parts
        assert parts is not None
        assert fewer is not None
        assert np.trace(parts.systematic) > np.trace(fewer.systematic)
        scale = np.sqrt(np.diag(whole.covariance))
        rest = (whole.covariance - parts.systematic - parts.camera_position) / np.outer(scale, scale)
        assert np.linalg.eigvalsh(rest)[0] > -1e-9
        for part in (parts.systematic, parts.camera_position):
            assert np.linalg.eigvalsh(part / np.outer(scale, scale))[0] > -1e-9


def test_without_a_tape_its_part_is_nothing() -> None:
    simulated = simulate_pairs(12, rng=np.random.default_rng(1), noise="ti")
    parts = calibrate_pairs(simulated.pairs, simulated.camera).unwrap().covariance_parts
    assert parts is not None
    assert not parts.camera_position.any()
    assert parts.systematic.any()


def test_of_few_pairs_with_a_posterior_that_is_not_normal_they_are_made_to_fit() -> None:
    rng = np.random.default_rng(1926)
    noise, count = str(rng.choice(["ti", "imaging", "ti_aisle"])), int(rng.integers(4, 16))
    made = simulate_pairs(count, rng=rng, noise=noise, outlier_share=float(rng.choice([0, 0, 0.2, 0.4])))  # type: ignore[arg-type]
    found = calibrate_pairs(made.pairs, made.camera).unwrap()
    pose = session_pose(found, vehicle="van", session="spring")  # refuses parts that exceed the covariance
    assert np.trace(pose.systematic) > 0.0


def test_parts_that_fit_stay_and_others_shrink_by_one_factor() -> None:
    whole = np.diag([1e-4] * 3 + [1e-6] * 3)
    parts = CovarianceParts(0.5 * whole, 0.25 * whole)
    assert parts.within(whole) is parts
    smaller = parts.within(0.5 * whole)
    np.testing.assert_allclose(smaller.systematic, whole / 3.0, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(smaller.camera_position, whole / 6.0, rtol=1e-12, atol=1e-20)
