"""Sessions of one mounting are averaged, and a remount begins another one."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.fleet.simulated_poses import NOMINAL
from calib_core.fleet import SessionPose, mounting_of, mountings_of
from calib_core.geometry import RigidTransform
from calib_core.measurements import TimeNs
from calib_core.options import CameraPositionPrior

COVARIANCE = np.diag(np.repeat([1e-4, 4e-6], 3))


def session(number: int, *, pose: RigidTransform = NOMINAL, share: float = 0.0, vehicle: str = "van") -> SessionPose:
    return SessionPose(vehicle, f"s{number}", pose, COVARIANCE, share * COVARIANCE, time_ns=TimeNs(number))


def remounted(deg: float = 5.0) -> RigidTransform:
    return NOMINAL.perturbed(np.array([0.0, 0.0, 0.0, np.deg2rad(deg), 0.0, 0.0]))


def test_own_errors_average_out_and_systematic_ones_stay() -> None:
    four = mounting_of([session(k, share=0.36) for k in range(4)])
    np.testing.assert_allclose(four.covariance, (0.36 + 0.64 / 4.0) * COVARIANCE, rtol=1e-5)
    assert four.sessions == ("s0", "s1", "s2", "s3")


def test_a_tape_that_is_read_anew_averages_out_and_one_that_was_copied_does_not() -> None:
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


def test_what_nobody_stated_to_be_a_sessions_own_counts_as_systematic() -> None:
    rows = [SessionPose("van", f"s{k}", NOMINAL, COVARIANCE) for k in range(4)]
    np.testing.assert_allclose(mounting_of(rows).covariance, COVARIANCE, rtol=1e-5)


def test_one_session_is_its_own_mounting() -> None:
    alone = mounting_of([session(0, share=0.5)])
    np.testing.assert_allclose(alone.covariance, COVARIANCE, rtol=1e-9)
    np.testing.assert_allclose(alone.camera_from_radar.as_matrix(), NOMINAL.as_matrix(), atol=1e-12)


def test_the_mean_lies_where_the_covariances_put_it() -> None:
    moved = NOMINAL.perturbed(np.array([0.003, 0.0, 0.0, 0.0, 0.0, 0.0]))
    surer = replace(session(1, pose=moved), covariance=COVARIANCE / 2.0, systematic=np.zeros((6, 6)))
    mean = mounting_of([session(0), surer]).camera_from_radar
    np.testing.assert_allclose(mean.error_from(NOMINAL), [0.002, 0, 0, 0, 0, 0], atol=1e-9)


def test_a_remount_parts_the_sessions() -> None:
    rows = [session(0), session(1), session(2, pose=remounted()), session(3, pose=remounted())]
    assert [one.sessions for one in mountings_of(reversed(rows))] == [("s0", "s1"), ("s2", "s3")]


def test_another_radar_is_another_mounting_even_at_the_same_place() -> None:
    rows = [replace(session(k), radar_serial=serial) for k, serial in enumerate(("R1", "R1", "R2"))]
    found = mountings_of(rows)
    assert [(one.sessions, one.radar_serial) for one in found] == [(("s0", "s1"), "R1"), (("s2",), "R2")]


def test_vehicles_are_apart_and_in_order_of_name() -> None:
    found = mountings_of([session(0, vehicle="b"), session(0, vehicle="a"), session(1, vehicle="b")])
    assert [(one.vehicle, one.sessions) for one in found] == [("a", ("s0",)), ("b", ("s0", "s1"))]


def test_the_covariance_of_the_mean_is_that_of_simulated_sessions() -> None:
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
