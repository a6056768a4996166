"""Fresh pairs fit a calibration as well as it states, and do not once the camera has moved."""

import dataclasses

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.evaluation.residual_test import residual_test
from calib_core.measurements import Pair
from calib_core.results import Calibration
from calib_core.synthetic import simulate_pairs


def solved_and_fresh(seed: int) -> tuple[Calibration, tuple[Pair, ...]]:
    """Return a calibration and pairs of the same sensors that took no part in it."""
    rng = np.random.default_rng(seed)
    simulated = simulate_pairs(20, rng=rng, noise="imaging")
    calibration = calibrate_pairs(simulated.pairs, simulated.camera)
    assert isinstance(calibration, Calibration)
    return calibration, simulate_pairs(15, rng=rng, noise="imaging", rig=simulated.rig, camera=simulated.camera).pairs


@pytest.fixture(scope="module")
def case() -> tuple[Calibration, tuple[Pair, ...]]:
    return solved_and_fresh(1)


def test_fresh_pairs_of_the_same_sensors_fit(case):
    calibration, pairs = case
    test = residual_test(pairs, calibration)

    assert test.p_value > 0.01
    assert test.degrees_of_freedom == 2 * len(pairs)
    assert not test.misfits.any()


def test_pairs_do_not_fit_after_the_camera_moved(case):
    calibration, pairs = case
    turned = calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0, np.radians(3.0), 0]))
    test = residual_test(pairs, dataclasses.replace(calibration, camera_from_radar=turned))

    assert test.misfits.mean() > 0.5


def test_one_wrong_pair_is_named_and_does_not_decide(case):
    calibration, pairs = case
    wrong = dataclasses.replace(pairs[0], pixel_px=pairs[0].pixel_px + np.array([80.0, 0.0]))
    test = residual_test((wrong, *pairs[1:]), calibration)

    assert test.misfits.tolist() == [True] + [False] * (len(pairs) - 1)
    assert test.p_value > 0.01


def test_without_a_covariance_only_the_distances_are_known(case):
    calibration, pairs = case
    unknown = dataclasses.replace(calibration, covariance=np.full((6, 6), np.nan))
    test = residual_test(pairs, unknown)

    assert np.isnan(test.chi2)
    assert np.isfinite(test.distances_px).all()
    assert not test.outside.any()


def test_pairs_behind_the_camera_are_misfits(case):
    calibration, pairs = case
    behind = calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0, np.pi, 0]))
    test = residual_test(pairs, dataclasses.replace(calibration, camera_from_radar=behind))

    assert test.misfits.all()
    assert np.isinf(test.distances_px).all()
