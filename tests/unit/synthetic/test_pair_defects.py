"""What goes wrong with pairs beyond noise: each defect is where its description puts it, and nowhere else."""

import numpy as np
import pytest

from benchmarks.accuracy.defects.pair_defects import (
    clicked_again,
    from_moved_camera,
    in_other_units,
    mirrored,
    with_companion,
    with_rounded_elevations,
    with_zero_pair,
)
from calib_core.radar import polar_from_cartesian
from calib_core.synthetic import SimulatedPairs, SystematicErrors, simulate_pairs


@pytest.fixture
def simulated() -> SimulatedPairs:
    return simulate_pairs(20, rng=np.random.default_rng(3), noise="imaging", outlier_share=0.2)


def first_positions(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])


def clicks(simulated: SimulatedPairs) -> np.ndarray:
    return np.array([pair.pixel_px for pair in simulated.pairs])


def test_clicks_of_one_placement_share_the_radar_position_and_not_the_click_noise(simulated: SimulatedPairs) -> None:
    thrice = clicked_again(simulated, 3, rng=np.random.default_rng(1))
    assert [pair.id for pair in thrice.pairs[:4]] == ["p1", "p1-2", "p1-3", "p2"]
    assert np.array_equal(first_positions(thrice)[::3], first_positions(simulated))
    assert np.array_equal(first_positions(thrice)[::3], first_positions(thrice)[2::3])
    away_px = (clicks(thrice) - thrice.pixels_px)[~thrice.outlier].reshape(-1, 3, 2)
    assert away_px.std() == pytest.approx(2.0, rel=0.2)
    assert np.abs(np.corrcoef(away_px[:, 1].ravel(), away_px[:, 2].ravel())[0, 1]) < 0.5


def test_repeated_clicks_share_the_offset_of_all_clicks() -> None:
    errors = SystematicErrors(click_offset_px=(0.0, 50.0))
    once = simulate_pairs(20, rng=np.random.default_rng(3), systematic=errors)
    twice = clicked_again(once, 2, rng=np.random.default_rng(1))
    assert (clicks(twice) - twice.pixels_px).mean(axis=0) == pytest.approx([0.0, 50.0], abs=2.0)


def test_a_companion_stands_behind_the_reflector_and_comes_first(simulated: SimulatedPairs) -> None:
    joined = with_companion(simulated, rng=np.random.default_rng(1), wander_m=0.0)
    right = ~simulated.outlier
    before, after = (polar_from_cartesian(first_positions(one)) for one in (simulated, joined))
    assert after[right] - before[right] == pytest.approx(np.tile([1.0, 0.0, 0.0], (right.sum(), 1)), abs=1e-9)
    assert np.array_equal(after[~right], before[~right])
    assert {place for place, wrong in zip(joined.true_candidate, joined.outlier, strict=True) if not wrong} == {1}
    assert sum(one.score for one in joined.pairs[int(np.flatnonzero(right)[0])].candidates) <= 1.0
    hidden = with_companion(simulated, rng=np.random.default_rng(1), share=0.5, reflector_seen=False)
    assert simulated.outlier.sum() < hidden.outlier.sum() < 20
    assert all(len(pair.candidates) == 1 for pair in hidden.pairs)


def test_pairs_from_a_moved_camera_agree_on_another_pose(simulated: SimulatedPairs) -> None:
    moved = from_moved_camera(simulated, rng=np.random.default_rng(1), share=0.4, turn_deg=5.0)
    changed = (clicks(moved) != clicks(simulated)).any(axis=1)
    assert np.array_equal(changed, moved.outlier & ~simulated.outlier)
    assert 0 < changed.sum() <= 8
    assert np.linalg.norm(clicks(moved) - clicks(simulated), axis=1)[changed].min() > 10.0


def test_mirrored_and_scaled_positions_are_the_reported_ones_changed(simulated: SimulatedPairs) -> None:
    assert first_positions(mirrored(simulated)) == pytest.approx(first_positions(simulated) * [1, -1, 1])
    assert first_positions(mirrored(simulated, "up")) == pytest.approx(first_positions(simulated) * [1, 1, -1])
    assert first_positions(in_other_units(simulated, 1000.0)) == pytest.approx(1000.0 * first_positions(simulated))


def test_rounding_changes_elevations_by_less_than_a_microradian() -> None:
    flat = simulate_pairs(9, rng=np.random.default_rng(3), systematic=SystematicErrors(measures_elevation=False))
    rounded = polar_from_cartesian(first_positions(with_rounded_elevations(flat, rng=np.random.default_rng(1))))
    assert 0.0 < np.abs(rounded[:, 2]).max() <= 1e-6
    assert rounded[:, :2] == pytest.approx(polar_from_cartesian(first_positions(flat))[:, :2])


def test_a_zero_pair_is_next_to_the_radar_and_an_outlier(simulated: SimulatedPairs) -> None:
    zeroed = with_zero_pair(simulated, np.random.default_rng(1))
    assert np.linalg.norm(first_positions(zeroed)[0]) < 0.01
    assert zeroed.outlier[0]
    assert zeroed.true_candidate[0] == -1
    assert np.array_equal(first_positions(zeroed)[1:], first_positions(simulated)[1:])
