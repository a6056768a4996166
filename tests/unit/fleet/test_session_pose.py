"""What the fleet takes from a calibration."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.errors import InputError
from calib_core.fleet import session_pose
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration, DataWarning
from calib_core.synthetic import simulate_pairs


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    simulated = simulate_pairs(20, rng=np.random.default_rng(5), noise="ti")
    outcome = calibrate_pairs(simulated.pairs, simulated.camera)
    assert isinstance(outcome, Calibration)
    return outcome


def test_pose_and_uncertainty_are_the_calibrations(calibration: Calibration) -> None:
    pose = session_pose(calibration, vehicle="van", session="spring", radar_serial="R1")
    np.testing.assert_array_equal(pose.covariance, calibration.covariance)
    assert pose.quantile == calibration.covariance_quantile
    assert pose.freedom < 1e4  # the noise level was estimated
    assert pose.camera is calibration.camera
    assert pose.reference_radar_m is not None
    assert pose.sensors == ("R1", None)


def test_what_rests_on_stated_sigmas_is_the_calibrations_and_all_of_it_if_nobody_says(calibration: Calibration) -> None:
    pose, parts = session_pose(calibration, vehicle="van", session="spring"), calibration.covariance_parts
    assert parts is not None
    np.testing.assert_array_equal(pose.systematic, parts.systematic)
    np.testing.assert_array_equal(pose.of_tape, parts.camera_position)
    assert 0.0 < np.trace(pose.systematic[:3, :3]) < np.trace(pose.covariance[:3, :3])
    silent = session_pose(replace(calibration, covariance_parts=None), vehicle="van", session="spring")
    np.testing.assert_array_equal(silent.systematic, calibration.covariance)


def test_a_method_without_a_noise_model_is_refused_with_what_to_do() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(5), noise="ti")
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, CalibrationOptions(method="paper"))
    assert isinstance(outcome, Calibration)
    with pytest.raises(InputError, match=r"states no uncertainty.*default method"):
        session_pose(outcome, vehicle="van", session="spring")


def test_a_pose_that_an_older_version_drew_to_a_fleets_prior_is_refused(calibration: Calibration) -> None:
    drawn = replace(calibration, warnings=(DataWarning("rests-on-fleet-prior", "drawn", "solve it again"),))
    with pytest.raises(InputError, match=r"vehicle 'van', session 'spring': .* solve it again"):
        session_pose(drawn, vehicle="van", session="spring")
