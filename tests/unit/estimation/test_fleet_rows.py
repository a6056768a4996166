"""The fleet's prior as rows: their derivative, their sums, and many poses at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.estimation.fleet_rows import FleetRows
from calib_core.fleet_prior import FleetPrior
from calib_core.geometry import RigidTransform, rotation_exp

SEEDS = st.integers(0, 2**32 - 1)


def drawn(seed: int, *, angle_rad: float = 1.0) -> tuple[FleetPrior, RigidTransform]:
    rng = np.random.default_rng(seed)
    spread = 0.1 * rng.normal(size=(6, 12))
    mean = RigidTransform(rotation_exp(rng.normal(size=3)), rng.normal(size=3))
    axis = rng.normal(size=3)
    error = np.concatenate([rng.normal(size=3), angle_rad * axis / np.linalg.norm(axis)])
    return FleetPrior("van", mean, spread @ spread.T, ("van 1",)), mean.perturbed(error)


@given(SEEDS, st.sampled_from([0.0, 1e-5, 0.01, 0.3, 1.5, 3.0]))
def test_the_jacobian_is_minus_the_derivative_of_the_residual(seed: int, angle_rad: float) -> None:
    prior, pose = drawn(seed, angle_rad=angle_rad)
    rows = FleetRows.of(prior)
    jacobian = rows.rows(pose.rotation, pose.translation_m)[1]
    for k, step in enumerate(1e-6 * np.eye(6)):
        ahead, behind = pose.perturbed(step), pose.perturbed(-step)
        slope = rows.rows(ahead.rotation, ahead.translation_m)[0] - rows.rows(behind.rotation, behind.translation_m)[0]
        assert -slope / 2e-6 == pytest.approx(jacobian[:, k], abs=1e-6 * np.abs(rows.whitening).max() + 1e-9)


@given(SEEDS)
def test_the_cost_is_the_squared_distance_under_the_covariance(seed: int) -> None:
    prior, pose = drawn(seed)
    rows = FleetRows.of(prior)
    error = pose.error_from(prior.camera_from_radar)
    expected = float(error @ np.linalg.solve(prior.covariance, error))
    assert float(rows.costs(pose.rotation, pose.translation_m)) == pytest.approx(expected, rel=1e-9)
    residual = rows.rows(pose.rotation, pose.translation_m)[0]
    assert float(residual @ residual) == pytest.approx(expected, rel=1e-9)


def test_many_poses_at_once_are_each_as_alone() -> None:
    prior, _ = drawn(1)
    rows = FleetRows.of(prior)
    poses = [drawn(1, angle_rad=angle)[1] for angle in (0.0, 1e-10, 0.2, 3.0, np.pi - 1e-5, np.pi - 1e-9)]
    rotations = np.array([one.rotation for one in poses])
    translations_m = np.array([one.translation_m for one in poses])
    hessians, gradients = rows.information(rotations, translations_m)
    costs = rows.costs(rotations, translations_m)
    for i, pose in enumerate(poses):
        residual, jacobian = rows.rows(pose.rotation, pose.translation_m)
        assert -residual == pytest.approx(rows.whitening @ pose.error_from(rows.mean), rel=1e-6, abs=1e-6)
        assert hessians[i] == pytest.approx(jacobian.T @ jacobian, rel=1e-9)
        assert gradients[i] == pytest.approx(jacobian.T @ residual, rel=1e-9, abs=1e-9)
        assert costs[i] == pytest.approx(float(residual @ residual), rel=1e-9, abs=1e-12)


def test_one_step_from_afar_in_position_reaches_the_mean() -> None:
    prior, _ = drawn(2)
    rows = FleetRows.of(prior)
    pose = prior.camera_from_radar.perturbed(np.array([0.3, -0.2, 0.1, 0.2, 0.1, -0.3]))
    for _ in range(4):
        hessian, gradient = rows.information(pose.rotation, pose.translation_m)
        pose = pose.perturbed(np.linalg.solve(hessian, gradient))
    assert np.abs(pose.error_from(prior.camera_from_radar)).max() < 1e-9
