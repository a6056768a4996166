"""Ambiguous radar positions: the pose and all pairs together determine which alternative is right."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.estimation.gnc import associate
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.measurements import Pair, TimeNs
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration
from calib_core.synthetic import RigOptions, SimulatedPairs, simulate_pairs

FREE = CalibrationOptions()
ANYWHERE = CalibrationOptions(solving=SolvingOptions(sensors_above_placements=False))
MEASURED = CalibrationOptions(
    solving=SolvingOptions(camera_position=CameraPositionPrior(RigOptions().camera_offset_m, 0.01))
)
OTHER_LOBE_RAD = np.deg2rad(25.0)


def with_alternatives(simulated: SimulatedPairs, kind: str, rng: np.random.Generator) -> list[Pair]:
    """Give every pair a second, equally plausible position, in random order."""
    pairs = []
    for pair in simulated.pairs:
        (candidate,) = pair.candidates
        polar = polar_from_cartesian(candidate.position_radar_m)
        if kind == "mirrored elevation":
            polar[2] *= -1.0
        else:
            polar[1] += rng.choice([-OTHER_LOBE_RAD, OTHER_LOBE_RAD])
        either = [
            replace(candidate, score=0.5),
            replace(candidate, score=0.5, position_radar_m=cartesian_from_polar(polar)),
        ]
        pairs.append(replace(pair, candidates=tuple(either if rng.random() < 0.5 else either[::-1])))
    return pairs


@pytest.mark.parametrize(
    ("kind", "options"),
    [("another azimuth", FREE), ("another azimuth", MEASURED), ("mirrored elevation", MEASURED)],
)
def test_the_right_one_of_two_positions_is_chosen_for_every_pair(kind: str, options: CalibrationOptions) -> None:
    for seed in range(3):
        rng = np.random.default_rng([61, seed])
        simulated = simulate_pairs(20, rng=rng, noise="imaging")
        outcome = calibrate_pairs(with_alternatives(simulated, kind, rng), simulated.camera, options)
        assert isinstance(outcome, Calibration)
        meant = [pair.candidates[0].position_radar_m for pair in simulated.pairs]
        wrong = [
            pair.id for pair, place in zip(outcome.pairs, meant, strict=True) if (pair.point_radar_m != place).any()
        ]
        named = [one.message for one in outcome.warnings if one.code == "uncertain-association"]
        assert len(wrong) <= 1
        assert all(name in text for name in wrong for text in named)
        assert len(named) >= bool(wrong)


def test_if_all_elevations_may_be_mirrored_the_ground_decides_and_without_it_a_warning_says_so() -> None:
    for seed in range(3):
        rng = np.random.default_rng([62, seed])
        simulated = simulate_pairs(20, rng=rng, noise="imaging")
        pairs = with_alternatives(simulated, "mirrored elevation", rng)
        outcome = calibrate_pairs(pairs, simulated.camera, FREE)
        assert isinstance(outcome, Calibration)
        error = simulated.camera_from_radar.error_from(outcome.camera_from_radar)
        assert np.linalg.norm(error[3:]) < np.deg2rad(1.0)
        outcome = calibrate_pairs(pairs, simulated.camera, ANYWHERE)
        assert isinstance(outcome, Calibration)
        assert {one.code for one in outcome.warnings} & {"handedness-open", "two-poses", "mirrored-axes"}


def test_two_clicks_of_one_moment_do_not_take_the_same_return() -> None:
    """Both would explain both clicks well enough; the second reflector's own return is a little worse, and right."""
    simulated = simulate_pairs(12, rng=np.random.default_rng(31), noise="imaging")
    pairs = [replace(pair, image_time=TimeNs(k * 60 * 10**9)) for k, pair in enumerate(simulated.pairs)]
    first, second = pairs[0], pairs[1]
    both = (*first.candidates, *second.candidates)
    wrong_first = replace(
        second, image_time=first.image_time, candidates=both, pixel_px=first.pixel_px + np.array([1.0, 0.0])
    )
    measurements = pair_measurements([replace(first, candidates=both), wrong_first, *pairs[2:]], simulated.camera, FREE)
    assert (measurements.returns[:4] >= 0).all()
    rows, _ = associate(measurements, simulated.camera_from_radar)
    assert sorted(rows[:2] % 2) == [0, 1]
