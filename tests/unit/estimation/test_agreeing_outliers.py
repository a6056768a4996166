"""Outliers that agree among themselves are found with their pose; outliers that are just wrong are not."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.estimation.beyond_the_fit import find_agreeing_outliers
from calib_core.measurements import Pair
from calib_core.synthetic import SimulatedPairs, simulate_pairs
from tests.solved_draws import solve_draw

COMPANION_M = np.array([0.7, 0.7, 0.4])  # behind the reflector, to its left and higher, in the world


def with_companion(simulated: SimulatedPairs, which: range) -> list[Pair]:
    """Give pairs the radar position of something that always stands in the same place relative to the reflector."""
    moved_m = simulated.rig.radar_from_world.rotation @ COMPANION_M
    pairs = list(simulated.pairs)
    for i in which:
        candidate = pairs[i].candidates[0]
        pairs[i] = replace(
            pairs[i], candidates=(replace(candidate, position_radar_m=candidate.position_radar_m + moved_m),)
        )
    return pairs


@pytest.mark.parametrize("tape", [False, True])
def test_pairs_of_a_companion_are_found_with_the_place_where_it_stands(tape: bool) -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(2), noise="imaging")
    solved = solve_draw(simulated, pairs=with_companion(simulated, range(6)), tape=tape)
    found = find_agreeing_outliers(solved.measurements, solved.refined, rng=np.random.default_rng(1))
    assert found is not None
    assert found.pairs.tolist() == list(range(6))
    assert found.camera_move_m == pytest.approx(np.linalg.norm(COMPANION_M), abs=0.3)
    assert np.linalg.norm(found.difference[3:]) < np.deg2rad(5.0)


@pytest.mark.parametrize("share", [0.3, 0.5])
def test_outliers_that_are_just_wrong_do_not_agree(share: float) -> None:
    for seed in range(6):
        simulated = simulate_pairs(20, rng=np.random.default_rng([5, seed]), outlier_share=share)
        solved = solve_draw(simulated)
        assert find_agreeing_outliers(solved.measurements, solved.refined, rng=np.random.default_rng(1)) is None


def test_three_outliers_are_too_few_to_agree() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(2), noise="imaging")
    solved = solve_draw(simulated, pairs=with_companion(simulated, range(3)))
    assert find_agreeing_outliers(solved.measurements, solved.refined, rng=np.random.default_rng(1)) is None
