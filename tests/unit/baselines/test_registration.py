"""Registration: the transform that was put in comes out, and a badly conditioned problem is called so."""

import numpy as np
import pytest

from calib_core.baselines.registration import register, register_linearly
from calib_core.geometry import RigidTransform, rotation_exp

TRUTH = RigidTransform(rotation_exp(np.array([0.3, -1.1, 0.8])), np.array([0.2, -0.5, 1.0]))


def test_exact_points_give_the_exact_transform() -> None:
    points = np.random.default_rng(3).uniform(-2.0, 2.0, (6, 3))
    found = register(points, TRUTH @ points)
    assert found is not None
    assert found.camera_from_radar.as_matrix() == pytest.approx(TRUTH.as_matrix(), abs=1e-12)
    assert found.rms_m < 1e-12


def test_points_in_one_plane_are_never_mirrored() -> None:
    points = np.random.default_rng(4).uniform(-1.0, 1.0, (5, 3)) * [1.0, 1.0, 0.0]
    noisy = TRUTH @ points + 0.05 * np.random.default_rng(5).standard_normal((5, 3))
    found = register(points, noisy)
    assert found is not None
    assert np.linalg.det(found.camera_from_radar.rotation) == pytest.approx(1.0)
    assert found.rms_m == pytest.approx(0.05, rel=0.9)


def test_no_other_transform_near_it_leaves_less() -> None:
    rng = np.random.default_rng(6)
    points = rng.uniform(-1.0, 1.0, (8, 3))
    target = TRUTH @ points + 0.1 * rng.standard_normal((8, 3))
    found = register(points, target)
    assert found is not None

    def rms_m(pose: RigidTransform) -> float:
        return float(np.sqrt(np.square(pose @ points - target).sum(axis=1).mean()))

    moved = [rms_m(found.camera_from_radar.perturbed(0.01 * rng.standard_normal(6))) for _ in range(50)]
    assert found.rms_m < min(moved)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_points_give_nothing(count: int) -> None:
    assert register(np.ones((count, 3)), np.ones((count, 3))) is None


def test_points_on_one_line_give_nothing_in_either_frame() -> None:
    line = np.outer(np.arange(5.0), [1.0, 2.0, 3.0])
    spread = np.random.default_rng(7).uniform(size=(5, 3))
    assert register(line, line) is None
    assert register(line, spread) is None
    assert register(spread, line) is None


def test_a_small_board_far_away_is_worse_conditioned_with_the_fourth_power() -> None:
    board = np.stack(np.meshgrid(np.arange(5.0), np.arange(4.0), [0.0]), axis=-1).reshape(-1, 3)
    board -= board.mean(axis=0)
    conditions = []
    for distance_m in (20.0, 40.0):
        found = register(board + np.array([0.0, 0.0, distance_m]), board)
        assert found is not None
        conditions.append(found.condition)
    assert conditions[1] / conditions[0] == pytest.approx(16.0, rel=0.05)


def test_twelve_free_numbers_give_the_exact_transform_of_exact_points_in_space() -> None:
    points = np.random.default_rng(8).uniform(-2.0, 2.0, (6, 3))
    found = register_linearly(points, TRUTH @ points)
    assert found is not None
    assert found.camera_from_radar.as_matrix() == pytest.approx(TRUTH.as_matrix(), abs=1e-9)
    assert register_linearly(points[:3], points[:3]) is None


def test_noise_on_a_flat_board_upsets_twelve_free_numbers_but_not_a_rotation() -> None:
    board = np.array([[5.0, y, z] for y in (-0.9, 0.9) for z in (-0.4, 0.4)])
    noisy = board + 0.02 * np.random.default_rng(9).standard_normal((4, 3))
    rigid, linear = register(noisy, TRUTH @ board), register_linearly(noisy, TRUTH @ board)
    assert rigid is not None
    assert linear is not None
    off = [np.linalg.norm(one.camera_from_radar.error_from(TRUTH)[3:]) for one in (rigid, linear)]
    assert off[0] < np.deg2rad(2.0)
    assert off[1] > np.deg2rad(20.0)
    assert linear.condition > 100.0
