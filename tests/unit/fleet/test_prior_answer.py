"""A calibration with a fleet's prior: what the data say is never hidden, and a vehicle off its kind is named."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from calib_core.association.clustering import candidate_at
from calib_core.calibration import calibrate_pairs, solve_again
from calib_core.errors import InputError
from calib_core.fleet.prior_answer import fleet_warnings
from calib_core.fleet_prior import FleetPrior
from calib_core.geometry import RigidTransform
from calib_core.measurements import Pair, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration, DataWarning
from calib_core.synthetic.simulated_pairs import NoiseName, SimulatedPairs, simulate_pairs
from calib_core.verdict import verdict_on

NARROW = np.diag([5e-3] * 3 + [np.deg2rad(0.3)] * 3) ** 2


@cache
def simulated(count: int, noise: NoiseName = "ti") -> SimulatedPairs:
    return simulate_pairs(count, rng=np.random.default_rng(count), noise=noise)


def prior(count: int, *, covariance: np.ndarray = NARROW, turned_deg: float = 0.0) -> FleetPrior:
    true = simulated(count).camera_from_radar
    mean = true.perturbed(np.array([0.004, -0.003, 0.005, 0.003, np.deg2rad(turned_deg) - 0.004, 0.002]))
    return FleetPrior("van", mean, covariance, ("V1", "V2", "V3", "V4", "V5"))


@cache
def alone(count: int) -> Calibration:
    return calibrate_pairs(simulated(count).pairs, simulated(count).camera).unwrap()


def solved(count: int, given: FleetPrior) -> Calibration:
    return calibrate_pairs(simulated(count).pairs, simulated(count).camera, fleet_prior=given).unwrap()


def same_pose(one: RigidTransform, other: RigidTransform) -> bool:
    return np.array_equal(one.rotation, other.rotation) and np.array_equal(one.translation_m, other.translation_m)


def codes(calibration: Calibration) -> set[str]:
    return {warning.code for warning in calibration.warnings}


def test_few_placements_of_a_vehicle_of_its_kind_give_a_pose_to_use_and_the_data_alone_beside_it() -> None:
    found, data = solved(6, prior(6)), alone(6)
    assert found.fleet is not None
    assert found.fleet.used
    assert found.fleet.squared < found.fleet.limit
    assert found.fleet.data_alone is not None
    assert same_pose(found.fleet.data_alone.camera_from_radar, data.camera_from_radar)
    assert np.array_equal(found.fleet.data_alone.covariance, data.covariance)
    assert found.fleet.data_alone.verdict == "weak"
    assert np.diag(found.covariance).max() < 0.1 * np.diag(data.covariance).max()
    assert "fleet-prior-decides" in codes(found)
    assert (verdict_on(data).level, verdict_on(found).level) == ("weak", "usable")
    assert verdict_on(found).reason.endswith(", if it is mounted like the others of its type")
    helps = "Add placements, or measure this vehicle's camera position: the more the data know, the more they decide"
    assert verdict_on(found).action == helps
    assert verdict_on(found, left=3).action == "Click the 3 placements that are left"


def test_that_it_must_be_mounted_like_the_others_is_said_whatever_else_is_warned_of() -> None:
    found = solved(6, prior(6))
    more = DataWarning("angle-scale", "the radar's angles are off", "state its scale")
    for warnings in ((more, *found.warnings), (*found.warnings, more)):
        said = verdict_on(replace(found, warnings=warnings))
        assert (said.level, said.reason) == (verdict_on(found).level, verdict_on(found).reason)


def test_the_answer_lies_where_prior_and_data_balance() -> None:
    found, data, given = solved(20, prior(20)), alone(20), prior(20)
    to_prior, to_data = np.linalg.inv(given.covariance), np.linalg.inv(data.covariance)
    expected = np.linalg.solve(to_prior + to_data, to_data @ data.camera_from_radar.error_from(given.camera_from_radar))
    away = found.camera_from_radar.error_from(given.camera_from_radar) - expected
    assert away @ (to_prior + to_data) @ away < 1.0  # within one standard deviation of the answer, all axes together


def test_a_wide_prior_leaves_the_answer_of_the_data() -> None:
    found, data = solved(20, prior(20, covariance=1e6 * NARROW)), alone(20)
    away = found.camera_from_radar.error_from(data.camera_from_radar)
    assert away @ np.linalg.solve(data.covariance, away) < 1e-3
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(np.sqrt(np.diag(data.covariance)), rel=0.01)
    assert "fleet-prior-decides" not in codes(found)


def test_a_vehicle_that_is_far_from_its_kind_and_not_refused_is_weak() -> None:
    sound, far = solved(6, prior(6)), solved(6, prior(6, turned_deg=3.0))
    assert far.fleet is not None
    assert far.fleet.used
    assert "far-from-its-kind" in codes(far)
    assert " deg " in far.warnings[0].message
    assert verdict_on(far).level == "weak"
    assert "far-from-its-kind" not in codes(sound)


def test_a_vehicle_off_its_kind_keeps_the_answer_of_its_data_and_is_named_first() -> None:
    found, data = solved(20, prior(20, turned_deg=20.0)), alone(20)
    assert found.fleet is not None
    assert not found.fleet.used
    assert found.fleet_prior is None
    assert same_pose(found.camera_from_radar, data.camera_from_radar)
    assert np.array_equal(found.covariance, data.covariance)
    assert found.warnings[0].code == "off-its-kind"
    assert verdict_on(found).level == "weak"
    assert "contradict the fleet's prior" in verdict_on(found).reason


def test_placements_on_a_line_get_a_pose_that_nothing_tests() -> None:
    made = simulated(20)
    pose, camera = made.camera_from_radar, made.camera
    points = np.array([[x, 0.0, -0.5] for x in np.linspace(3.0, 12.0, 8)])
    pixels = camera.project(pose @ points)
    noise = CalibrationOptions().noise
    pairs = [
        Pair(f"p{k}", pixel, (candidate_at(point, noise),))
        for k, (pixel, point) in enumerate(zip(pixels, points, strict=True))
    ]
    plain = calibrate_pairs(pairs, camera)
    found = calibrate_pairs(pairs, camera, fleet_prior=prior(20)).unwrap()
    assert isinstance(plain, Unsolvable)
    assert found.fleet is not None
    assert found.fleet.data_alone is None
    assert "fleet-prior-untested" in codes(found)
    assert verdict_on(found).level == "weak"


def test_pairs_that_agree_on_no_pose_are_refused_with_a_prior_as_without() -> None:
    made = simulated(6)
    rng = np.random.default_rng(0)
    size = np.array([made.camera.width_px, made.camera.height_px])
    pairs = [replace(pair, pixel_px=rng.uniform(0, size)) for pair in made.pairs]
    plain = calibrate_pairs(pairs, made.camera)
    assert isinstance(plain, Unsolvable)
    found = calibrate_pairs(pairs, made.camera, fleet_prior=prior(6))
    assert isinstance(found, Unsolvable)
    assert (found.code, found.reason) == (plain.code, plain.reason)


def test_the_order_of_the_pairs_changes_no_bit_and_solving_again_neither() -> None:
    made = simulated(6)
    found = solved(6, prior(6))
    turned = calibrate_pairs(made.pairs[::-1], made.camera, fleet_prior=prior(6)).unwrap()
    again = solve_again(found).unwrap()
    for other in (turned, again):
        assert same_pose(other.camera_from_radar, found.camera_from_radar)
        assert np.array_equal(other.covariance, found.covariance)
        assert codes(other) == codes(found)


def test_a_further_placement_gains_less_with_a_prior() -> None:
    with_prior, without = solved(6, prior(6)).next_placement, alone(6).next_placement
    assert with_prior is not None
    assert without is not None
    assert with_prior.gain < without.gain


@pytest.mark.parametrize("method", ["paper"])
def test_other_methods_take_no_prior(method: str) -> None:
    options = CalibrationOptions(method=method)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=f"the method is {method}"):
        calibrate_pairs(simulated(6).pairs, simulated(6).camera, options, fleet_prior=prior(6))


def test_data_that_are_open_by_more_than_9_deg_do_not_test_a_prior() -> None:
    found = solved(6, prior(6))
    assert found.fleet is not None
    assert found.fleet.data_alone is not None
    open_data = replace(found.fleet.data_alone, covariance=9.0 * found.fleet.data_alone.covariance)
    fleet = replace(found.fleet, data_alone=open_data)
    assert [warning.code for warning in fleet_warnings(fleet, found)] == ["fleet-prior-untested"]


def test_the_verdict_on_the_data_alone_is_theirs_and_clocks_that_disagree_make_it_weak() -> None:
    found = solved(20, prior(20))
    assert found.fleet is not None
    assert found.fleet.data_alone is not None
    assert found.fleet.data_alone.verdict == verdict_on(alone(20)).level == "usable"
    late = DataWarning("clock-bias-suspected", "the radar's stamps are late", "correct them")
    again = solve_again(replace(found, warnings=(*found.warnings, late)))
    assert isinstance(again, Calibration)
    assert again.fleet is not None
    assert again.fleet.data_alone is not None
    assert again.fleet.data_alone.verdict == "weak"
