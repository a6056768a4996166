"""A pair that alone determines part of the pose is reported; well-spread placements report none."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.synthetic import FIELD, SimulatedPairs, simulate_pairs

FAR = replace(FIELD, min_range_m=8.0, max_range_m=10.0, max_azimuth_deg=12.0, separation_m=0.1)
NEAR = replace(FIELD, min_range_m=2.0, max_range_m=2.5)


def decisive(simulated: SimulatedPairs, *more: SimulatedPairs) -> list[str]:
    pairs = [*simulated.pairs, *(replace(pair, id="near") for other in more for pair in other.pairs)]
    outcome = calibrate_pairs(pairs, simulated.camera, CalibrationOptions())
    assert isinstance(outcome, Calibration)
    return [one.message for one in outcome.warnings if one.code == "one-pair-decides"]


@pytest.mark.parametrize("noise", ["ti", "imaging"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_near_placement_among_far_ones_decides(noise: str, seed: int) -> None:
    rng = np.random.default_rng([31, seed])
    far = simulate_pairs(19, rng=rng, noise=noise, layout=FAR)  # type: ignore[arg-type]
    near = simulate_pairs(1, rng=rng, noise=noise, layout=NEAR, rig=far.rig)  # type: ignore[arg-type]
    (text,) = decisive(far, near)
    assert "depends on near alone" in text


@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_a_second_near_placement_takes_the_decision_from_the_first(noise: str) -> None:
    rng = np.random.default_rng([31, 1])
    far = simulate_pairs(18, rng=rng, noise=noise, layout=FAR)  # type: ignore[arg-type]
    near = simulate_pairs(4, rng=rng, noise=noise, layout=NEAR, rig=far.rig)  # type: ignore[arg-type]
    pairs = [replace(pair, id=f"near-{i}") for i, pair in enumerate(near.pairs)]
    outcome = calibrate_pairs([*far.pairs, *pairs], far.camera, CalibrationOptions())
    assert isinstance(outcome, Calibration)
    assert "one-pair-decides" not in {one.code for one in outcome.warnings}


@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_no_pair_of_a_good_set_decides(noise: str) -> None:
    for seed in range(8):
        assert decisive(simulate_pairs(20, rng=np.random.default_rng([32, seed]), noise=noise)) == []  # type: ignore[arg-type]
