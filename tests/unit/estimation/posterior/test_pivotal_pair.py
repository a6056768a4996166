"""The pair on which a pose rests is found, and right pairs are left alone."""

import numpy as np
import pytest

from calib_core.estimation.posterior.pivotal_pair import find_pivotal_pair
from calib_core.synthetic import simulate_pairs
from tests.solved_draws import solve_draw


@pytest.mark.parametrize("seed", [1, 43])
def test_without_the_pivotal_pair_a_wrong_pose_moves_to_the_truth(seed: int) -> None:
    simulated = simulate_pairs(12, rng=np.random.default_rng(seed), outlier_share=0.3)
    solved = solve_draw(simulated)
    found = find_pivotal_pair(solved.measurements, solved.refined)
    assert found is not None
    pose = solved.refined.camera_from_radar
    before, after = (
        np.linalg.norm(simulated.camera_from_radar.error_from(one)) for one in (pose, pose.perturbed(found.move))
    )
    assert after < 0.5 * before
    assert found.standard_deviations > 2.6
    assert simulated.outlier[found.pair]


def test_right_pairs_have_none() -> None:
    for seed in range(12):
        solved = solve_draw(simulate_pairs(12, rng=np.random.default_rng([3, seed])))
        assert find_pivotal_pair(solved.measurements, solved.refined) is None
