"""Sessions of one mounting are averaged, and a remount begins another one."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.fleet.simulated_poses import NOMINAL, Accuracy, Spread, simulated_fleet
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.fleet import (
    RelevantChange,
    SessionPose,
    mounting_of,
    mountings_of,
    session_pose,
    transition,
    transitions_of,
)
from calib_core.fleet.deviation import FALSE_RATE, deviation, quantile, tail
from calib_core.fleet.random_effects import RandomEffects, random_effects
from calib_core.fleet.session_pose import CHI2_95
from calib_core.geometry import RigidTransform
from calib_core.measurements import TimeNs
from calib_core.options import CalibrationOptions, CameraPositionPrior
from calib_core.results import Calibration, DataWarning
from calib_core.synthetic import simulate_pairs

COVARIANCE = np.diag(np.repeat([1e-4, 4e-6], 3))


def session(number: int, *, pose: RigidTransform = NOMINAL, share: float = 0.0, vehicle: str = "van") -> SessionPose:
    return SessionPose(vehicle, f"s{number}", pose, COVARIANCE, share * COVARIANCE, time_ns=TimeNs(number))


def remounted(deg: float = 5.0) -> RigidTransform:
    return NOMINAL.perturbed(np.array([0.0, 0.0, 0.0, np.deg2rad(deg), 0.0, 0.0]))


def test_own_errors_average_out_and_systematic_ones_stay():
    four = mounting_of([session(k, share=0.36) for k in range(4)])
    np.testing.assert_allclose(four.covariance, (0.36 + 0.64 / 4.0) * COVARIANCE, rtol=1e-5)
    assert four.sessions == ("s0", "s1", "s2", "s3")


def test_a_tape_that_is_read_anew_averages_out_and_one_that_was_copied_does_not():
    def measured(number: int, forward_m: float) -> SessionPose:
        of_tape = np.diag([1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0])
        tape = CameraPositionPrior((forward_m, 0.0, 0.0), 0.01)
        whole = COVARIANCE + of_tape
        return SessionPose("van", f"s{number}", NOMINAL, whole, np.zeros((6, 6)), measured=tape, of_tape=of_tape)

    anew = mounting_of([measured(k, 0.1 + 0.001 * k) for k in range(4)])
    copied = mounting_of([measured(k, 0.1) for k in range(4)])
    np.testing.assert_allclose(np.diag(anew.covariance)[:3], (1e-4 + 1e-4) / 4.0, rtol=1e-4)
    np.testing.assert_allclose(np.diag(copied.covariance)[:3], 1e-4 / 4.0 + 1e-4, rtol=1e-4)
    np.testing.assert_allclose(np.diag(copied.stated), [1e-4] * 3 + [0.0] * 3, rtol=1e-4, atol=1e-12)


def test_what_nobody_stated_to_be_a_sessions_own_counts_as_systematic():
    rows = [SessionPose("van", f"s{k}", NOMINAL, COVARIANCE) for k in range(4)]
    np.testing.assert_allclose(mounting_of(rows).covariance, COVARIANCE, rtol=1e-5)


def test_one_session_is_its_own_mounting():
    alone = mounting_of([session(0, share=0.5)])
    np.testing.assert_allclose(alone.covariance, COVARIANCE, rtol=1e-9)
    np.testing.assert_allclose(alone.camera_from_radar.as_matrix(), NOMINAL.as_matrix(), atol=1e-12)


def test_the_mean_lies_where_the_covariances_put_it():
    moved = NOMINAL.perturbed(np.array([0.003, 0.0, 0.0, 0.0, 0.0, 0.0]))
    surer = replace(session(1, pose=moved), covariance=COVARIANCE / 2.0, systematic=np.zeros((6, 6)))
    mean = mounting_of([session(0), surer]).camera_from_radar
    np.testing.assert_allclose(mean.error_from(NOMINAL), [0.002, 0, 0, 0, 0, 0], atol=1e-9)


def test_a_remount_parts_the_sessions():
    rows = [session(0), session(1), session(2, pose=remounted()), session(3, pose=remounted())]
    assert [one.sessions for one in mountings_of(reversed(rows))] == [("s0", "s1"), ("s2", "s3")]


def test_another_radar_is_another_mounting_even_at_the_same_place():
    rows = [replace(session(k), radar_serial=serial) for k, serial in enumerate(("R1", "R1", "R2"))]
    found = mountings_of(rows)
    assert [(one.sessions, one.radar_serial) for one in found] == [(("s0", "s1"), "R1"), (("s2",), "R2")]


def test_vehicles_are_apart_and_in_order_of_name():
    found = mountings_of([session(0, vehicle="b"), session(0, vehicle="a"), session(1, vehicle="b")])
    assert [(one.vehicle, one.sessions) for one in found] == [("a", ("s0",)), ("b", ("s0", "s1"))]


def test_the_covariance_of_the_mean_is_that_of_simulated_sessions():
    rng, share = np.random.default_rng(3), 0.4
    root = np.linalg.cholesky(COVARIANCE)
    errors = []
    for _ in range(700):
        common = root @ rng.standard_normal(6) * np.sqrt(share)
        rows = [
            session(k, share=share, pose=NOMINAL.perturbed(common + root @ rng.standard_normal(6) * np.sqrt(1 - share)))
            for k in range(3)
        ]
        errors.append(mounting_of(rows).camera_from_radar.error_from(NOMINAL))
    stated = mounting_of([session(k, share=share) for k in range(3)]).covariance
    ratio = np.einsum("ni,ij,nj->n", errors, np.linalg.inv(stated), errors).mean() / 6.0
    assert ratio == pytest.approx(1.0, abs=0.08)


CAMERA = Camera("pinhole", 1280, 720, np.array([[900.0, 0.0, 640.0], [0.0, 900.0, 360.0], [0.0, 0.0, 1.0]]))
WIDE_TAILS = 6.0 * 8.94  # the 95 % quantile of 6 F(6, 3)


def measured(
    name: str = "spring",
    *,
    pose: RigidTransform = NOMINAL,
    cm: float = 1.0,
    deg: float = 0.1,
    quantile: float = CHI2_95,
) -> SessionPose:
    covariance = np.diag(np.repeat([(cm / 100.0) ** 2, np.deg2rad(deg) ** 2], 3))
    return SessionPose(
        "van",
        name,
        pose,
        covariance,
        quantile=quantile,
        camera=CAMERA,
        reference_radar_m=np.array([10.0, 0.0, 0.0]),
        radar_serial="R1",
        camera_serial="C1",
    )


def turned(deg: float) -> RigidTransform:
    return NOMINAL.perturbed(np.array([0.0, 0.0, 0.0, 0.0, np.deg2rad(deg), 0.0]))


def test_the_same_pose_with_narrow_error_bars_is_unchanged():
    step = transition(measured(), measured("autumn", pose=turned(0.05)))
    assert step.is_unchanged
    assert not step.is_remount
    assert step.words.startswith("unchanged: 0.05 ± 0.14 deg")
    assert "95 % error bars of 0.28 deg and 2.8 cm" in step.words


def test_a_change_beyond_both_error_bars_is_a_remount_with_its_figures():
    step = transition(measured(), measured("autumn", pose=turned(2.0)))
    assert step.is_remount
    assert step.rotation_deg == pytest.approx(2.0)
    assert step.rotation_sigma_deg == pytest.approx(0.1 * np.sqrt(2.0))
    assert step.words.startswith("this radar was remounted: 2.00 ± 0.14 deg")
    assert step.words.endswith("px between spring and autumn, beyond both error bars")


def test_the_change_in_the_picture_is_that_of_the_reference_position():
    step = transition(measured(), measured("autumn", pose=turned(2.0)))
    reference = np.array([[10.0, 0.0, 0.0]])
    one, other = (CAMERA.project(pose @ reference)[0] for pose in (NOMINAL, turned(2.0)))
    assert step.picture_px == pytest.approx(np.linalg.norm(other - one))
    draws = np.random.default_rng(1).multivariate_normal(np.zeros(6), step.covariance, 4000)
    along = (other - one) / step.picture_px
    moved = [float(along @ (CAMERA.project(NOMINAL.perturbed(draw) @ reference)[0] - one)) for draw in draws]
    assert step.picture_sigma_px == pytest.approx(np.std(moved), rel=0.05)


def test_without_a_camera_there_are_no_pixels():
    step = transition(replace(measured(), camera=None), replace(measured("autumn"), camera=None))
    assert np.isnan(step.picture_px)
    assert "px" not in step.words


def test_wide_error_bars_cannot_tell_and_say_what_they_would_hide():
    step = transition(measured(deg=1.0), measured("autumn", deg=1.0))
    assert step.outcome == "cannot-tell"
    assert "would hide a change of 0.5 deg or 5 cm" in step.words
    assert transition(measured(deg=1.0), measured("autumn", deg=1.0), relevant=RelevantChange(deg=4.0)).is_unchanged


def test_a_change_between_the_95_percent_and_the_1_in_10000_point_is_neither():
    step = transition(measured(), measured("autumn", pose=turned(0.64)))
    assert CHI2_95 < step.squared < step.limit
    assert step.outcome == "cannot-tell"
    assert "perhaps remounted, measure again" in step.words


def test_the_wide_tails_of_few_pairs_are_no_remount():
    moved = turned(1.0)
    assert transition(measured(), measured("autumn", pose=moved)).is_remount
    assert not transition(measured(), measured("autumn", pose=moved, quantile=WIDE_TAILS)).is_remount
    assert not transition(measured(quantile=WIDE_TAILS), measured("autumn", pose=moved)).is_remount


def test_another_serial_is_said_and_begins_another_mounting():
    step = transition(measured(), replace(measured("autumn", pose=turned(2.0)), radar_serial="R2"))
    assert step.other_sensors
    assert step.words.startswith("the sensors were replaced and sit elsewhere")
    assert "radar R2 instead of R1" in step.words
    assert not transition(measured(), replace(measured("autumn"), radar_serial=None)).other_sensors


def test_of_250_unchanged_transitions_none_is_named_and_every_remount_is():
    rng = np.random.default_rng(11)
    named, remounted, unchanged = 0, 0, 0
    for accuracy in (Accuracy(0.02, 0.15), Accuracy(0.07, 0.6)):
        fleet = simulated_fleet(Spread(0.005, 0.3), accuracy, rng, vehicles=65)
        steps = transitions_of(fleet.sessions)
        found = [one.before.vehicle for one in steps if one.is_remount]
        assert sorted(found) == sorted(fleet.remounted)
        named, remounted = named + len(found), remounted + len(fleet.remounted)
        unchanged += len(steps) - len(fleet.remounted)
    assert named == remounted
    assert unchanged > 250


def test_the_false_rate_of_a_remount_is_one_in_10000():
    rng = np.random.default_rng(5)
    before = measured()
    root = np.linalg.cholesky(2.0 * before.covariance)
    errors = (root @ rng.standard_normal((6, 200_000))).T
    squared = np.einsum("ni,ni->n", errors, np.linalg.solve(2.0 * before.covariance, errors.T).T)
    limit = transition(before, measured("autumn")).limit
    assert 8 <= int((squared > limit).sum()) <= 34  # 20 expected


@pytest.mark.parametrize("number", [np.nan, 0.0])
def test_a_covariance_that_cannot_weigh_anything_is_refused_with_what_to_do(number):
    covariance = np.diag([number, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4])
    with pytest.raises(InputError, match=r"vehicle 'van', session 's': .*; (solve|export) "):
        SessionPose("van", "s", NOMINAL, covariance)


def test_stated_parts_beyond_the_covariance_are_refused():
    with pytest.raises(InputError, match="rest on stated sigmas exceed it; solve the session again"):
        SessionPose("van", "s", NOMINAL, np.eye(6), 2.0 * np.eye(6))
    with pytest.raises(InputError, match="rest on stated sigmas exceed it"):
        SessionPose("van", "s", NOMINAL, np.eye(6), 0.6 * np.eye(6), of_tape=0.6 * np.eye(6))


# One test over six degrees of freedom: its false rate, and the quantiles that it rests on.


EQUAL = np.full(6, 0.005)
EXACT = 1e-7 * np.eye(6)


def estimated(count: int, sigma: np.ndarray, error: np.ndarray, rng: np.random.Generator) -> RandomEffects:
    vectors = sigma * rng.standard_normal((count, 6)) + rng.multivariate_normal(np.zeros(6), error, count)
    return random_effects(vectors, np.repeat(error[None], count, axis=0))


def squared_of_new(
    effects: RandomEffects, sigma: np.ndarray, rng: np.random.Generator, count: int = 1000
) -> np.ndarray:
    away = sigma * rng.standard_normal((count, 6)) - effects.mean
    return np.asarray(np.einsum("ni,ij,nj->n", away, np.linalg.inv(effects.covariance), away))


@pytest.mark.parametrize(("count", "fleets"), [(10, 60), (49, 20)])
def test_the_false_rate_of_one_test_is_at_most_one_in_10000(count, fleets):
    rng, beyond = np.random.default_rng(count), 0
    for _ in range(fleets):
        effects = estimated(count, EQUAL, EXACT, rng)
        limit = deviation(effects, effects.mean, EXACT, freedom=1e7).limit
        beyond += int((squared_of_new(effects, EQUAL, rng, 2000) > limit).sum())
    assert beyond <= 2.0 * FALSE_RATE * fleets * 2000


def test_the_limit_is_hotellings_where_the_scatter_is_all_and_f_where_the_calibration_is():
    effects = estimated(49, EQUAL, EXACT, np.random.default_rng(1))
    narrow = deviation(effects, effects.mean, 1e-12 * np.eye(6), freedom=20.0)
    wide = deviation(effects, effects.mean, 1e6 * np.eye(6), freedom=20.0)
    assert narrow.limit == pytest.approx(quantile(1.0 - FALSE_RATE, effects.freedom, whole=5.0), rel=1e-4)
    assert wide.limit == pytest.approx(quantile(1.0 - FALSE_RATE, 20.0), rel=1e-4)


def test_quantiles_are_chi2_f_and_hotellings():
    rng = np.random.default_rng(2)
    assert quantile(0.95, 1e9) == pytest.approx(CHI2_95, rel=1e-4)
    level = rng.chisquare(6, 200_000) / (rng.chisquare(12, 200_000) / 12)
    assert (level <= quantile(0.95, 12)).mean() == pytest.approx(0.95, abs=0.002)
    samples = rng.standard_normal((4000, 13, 6))
    scatter = np.swapaxes(samples[:, 1:], 1, 2) @ samples[:, 1:] / 12
    squared = np.einsum("ni,ni->n", samples[:, 0], np.linalg.solve(scatter, samples[:, 0, :, None])[..., 0])
    assert (squared <= quantile(0.95, 12, whole=5.0)).mean() == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize(("freedom", "whole"), [(15.0, 0.0), (15.0, 3.0), (8.0, 0.0), (30.0, 5.0), (1e6, 2.0)])
def test_the_tail_is_the_inverse_of_the_quantile(freedom, whole):
    for probability in (0.1, 0.5, 0.95, 1.0 - FALSE_RATE):
        limit = quantile(probability, freedom, whole=whole)
        assert tail(limit, freedom, whole=whole) == pytest.approx(1.0 - probability)


# What the fleet takes from a calibration.


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    simulated = simulate_pairs(20, rng=np.random.default_rng(5), noise="ti")
    return calibrate_pairs(simulated.pairs, simulated.camera).unwrap()


def test_pose_and_uncertainty_are_the_calibrations(calibration):
    pose = session_pose(calibration, vehicle="van", session="spring", radar_serial="R1")
    np.testing.assert_array_equal(pose.covariance, calibration.covariance)
    assert pose.quantile == calibration.covariance_quantile
    assert pose.freedom < 1e4  # the noise level was estimated
    assert pose.camera is calibration.camera
    assert pose.reference_radar_m is not None
    assert pose.sensors == ("R1", None)


def test_what_rests_on_stated_sigmas_is_the_calibrations_and_all_of_it_if_nobody_says(calibration):
    pose, parts = session_pose(calibration, vehicle="van", session="spring"), calibration.covariance_parts
    np.testing.assert_array_equal(pose.systematic, parts.systematic)
    np.testing.assert_array_equal(pose.of_tape, parts.camera_position)
    assert 0.0 < np.trace(pose.systematic[:3, :3]) < np.trace(pose.covariance[:3, :3])
    silent = session_pose(replace(calibration, covariance_parts=None), vehicle="van", session="spring")
    np.testing.assert_array_equal(silent.systematic, calibration.covariance)


def test_a_method_without_a_noise_model_is_refused_with_what_to_do():
    simulated = simulate_pairs(20, rng=np.random.default_rng(5), noise="ti")
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, CalibrationOptions(method="paper")).unwrap()
    with pytest.raises(InputError, match=r"states no uncertainty.*default method"):
        session_pose(outcome, vehicle="van", session="spring")


def test_a_pose_that_an_older_version_drew_to_a_fleets_prior_is_refused(calibration):
    drawn = replace(calibration, warnings=(DataWarning("rests-on-fleet-prior", "drawn", "solve it again"),))
    with pytest.raises(InputError, match=r"vehicle 'van', session 'spring': .* solve it again"):
        session_pose(drawn, vehicle="van", session="spring")
