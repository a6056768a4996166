"""The outcome of a session that was solved with a fleet's prior says what the data alone say."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.fleet_prior import FleetPrior
from calib_core.interchange import calibration_text, imported, read_calibration
from calib_core.results import Calibration
from calib_core.synthetic.simulated_pairs import simulate_pairs
from calib_core.verdict import verdict_on
from cocalib.batch.job import Job
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import Outcome
from cocalib.batch.running.outcome_of import outcome_of
from cocalib.batch.running.solving import SolvedSession
from cocalib.batch.running.steps import SessionResult

SCATTER = np.diag([5e-3] * 3 + [np.deg2rad(0.3)] * 3) ** 2


def solved(count: int, *, turned_deg: float | None = 0.0) -> Calibration:
    made = simulate_pairs(count, rng=np.random.default_rng(count), noise="ti")
    if turned_deg is None:
        return calibrate_pairs(made.pairs, made.camera).unwrap()
    mean = made.camera_from_radar.perturbed(np.deg2rad([0.0, 0.0, 0.0, 0.0, turned_deg, 0.0]))
    return calibrate_pairs(made.pairs, made.camera, fleet_prior=FleetPrior("van", mean, SCATTER, ("V1",))).unwrap()


def outcome(calibration: Calibration) -> Outcome:
    found = imported(read_calibration(calibration_text(calibration), "calibration.json"))
    session = SolvedSession(calibration, False, found, (), {}, ())
    return outcome_of(Job(ManifestRow("van", "1", ()), "0"), SessionResult(solved=session))


def test_few_placements_are_usable_with_it_and_weak_alone() -> None:
    told, alone = outcome(solved(6)), outcome(solved(6, turned_deg=None))
    assert (told.fleet_prior, told.verdict, told.alone_verdict) == ("used", "usable", "weak")
    assert (told.alone_sigma_deg, told.alone_sigma_cm) == (alone.sigma_deg, alone.sigma_cm)
    assert (alone.fleet_prior, alone.alone_verdict, alone.alone_sigma_deg) == (None, None, None)


def test_a_vehicle_off_its_kind_is_weak_and_its_data_are_what_they_are_without_the_prior() -> None:
    told, alone = outcome(solved(20, turned_deg=20.0)), outcome(solved(20, turned_deg=None))
    assert (told.fleet_prior, told.verdict) == ("contradicted", "weak")
    assert told.alone_verdict == alone.verdict == "usable"
    assert (told.sigma_deg, told.alone_sigma_deg) == (alone.sigma_deg, alone.sigma_deg)


@pytest.mark.parametrize("has_pose", [True, False])
def test_data_that_hardly_test_the_prior_are_told_like_data_without_a_pose(has_pose: bool) -> None:
    calibration = solved(6)
    fleet = calibration.fleet
    assert fleet is not None
    untested = replace(calibration.warnings[0], code="fleet-prior-untested")
    warned = replace(calibration, warnings=(untested,), fleet=fleet if has_pose else replace(fleet, data_alone=None))
    told = outcome(warned)
    assert verdict_on(warned).level == "weak"
    assert told.fleet_prior == "untested"
    assert told.alone_verdict == ("weak" if has_pose else None)
