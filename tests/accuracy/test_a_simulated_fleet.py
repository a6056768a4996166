"""A simulated fleet from recordings to what is named: the acceptance test of a fleet, with few vehicles and small recordings."""

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.fleet.judging import judge
from benchmarks.fleet.plan import REMOUNTS, FleetPlan, PlannedSession, Remount, plan_fleet
from benchmarks.fleet.simulated_fleet import write_fleet
from benchmarks.fleet.simulated_session import RECORDING
from benchmarks.fleet.truth import read_truth
from cocalib.batch.driving import drive
from cocalib.batch.engine import InProcess
from cocalib.batch.job import jobs_of
from cocalib.batch.manifest import read_manifest
from cocalib.batch.results_folder import ResultsFolder
from cocalib.fleet.reading import read_fleet
from tests.picture_recording import grey_frames

_SMALL = replace(RECORDING, width_px=240, height_px=150, placements=10, radar_rate_hz=2.0)
_TURNED = Remount(12.0, 0.05)  # what 10 placements in pictures of 240 px show for certain


def _few(plan: FleetPlan) -> FleetPlan:
    """Keep the remounted vehicle, a healthy one, and one session of each fault."""
    remounted = next(one.vehicle for one in plan.sessions if one.remounted)
    faulty = {one.vehicle for one in plan.sessions if one.fault}
    healthy = next(one.vehicle for one in plan.sessions if one.vehicle not in {remounted, *faulty})
    kept: dict[str, PlannedSession] = {str(one.fault): one for one in plan.sessions if one.fault}
    kept.pop("radar of another type")
    sessions = [one for one in plan.sessions if one.vehicle in (remounted, healthy) or one in kept.values()]
    return replace(plan, sessions=tuple(sessions))


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fleet")
    plan = _few(plan_fleet(7, 2, 3, recording=_SMALL, remounts=(_TURNED,)))
    with grey_frames():
        manifest = write_fleet(folder, plan, InProcess())
    drive(jobs_of(read_manifest(manifest).rows, folder), InProcess(), ResultsFolder(folder / "out"))
    return folder


def test_what_was_planned_is_named_and_nothing_else(fleet):
    *judged, verdicts = judge(read_truth(fleet), read_fleet(fleet / "out"))
    assert {one.question: one.wrong for one in judged if one.wrong} == {}
    assert [one.of for one in judged] == [7, 1, 1, 2, 1, 3]
    assert all(
        words.endswith("verdict coarse") for words in verdicts.wrong
    )  # 10 placements in such pictures may be too few


def test_the_reasons_of_what_was_not_calibrated_are_told(fleet):
    outcomes = [one.outcome for vehicle in read_fleet(fleet / "out").vehicles for one in vehicle.sessions]
    reasons = {one.status: one.reason for one in outcomes if one.status in ("failed", "refused")}
    assert "not a recording" in reasons["failed"]
    assert "nothing was clicked" in reasons["refused"]


def test_errors_of_calibrations_are_within_what_they_state(fleet):
    truth = json.loads((fleet / "truth.json").read_text())["sessions"]
    poses = {(one["vehicle"], one["session"]): one["camera_from_radar"] for one in truth if one["fault"] is None}
    squared = []
    for vehicle in read_fleet(fleet / "out").vehicles:
        for record in vehicle.sessions:
            if (vehicle.name, record.name) in poses and record.pose is not None:
                found = record.pose.camera_from_radar
                true = poses[vehicle.name, record.name]
                true_pose = type(found)(np.array(true["rotation"]), np.array(true["translation_m"]))
                error = true_pose.error_from(found)
                squared.append(error @ np.linalg.solve(record.pose.covariance, error))
    assert len(squared) == 4
    assert max(squared) < 22.5  # 1 in 1,000 of chi2 with 6 degrees of freedom


def test_a_plan_has_every_fault_on_a_vehicle_of_its_own():
    plan = plan_fleet(50, 3, 2)
    assert len(plan.sessions) == 150
    assert Counter(one.fault for one in plan.sessions) == {
        None: 142,
        "mirrored radar": 3,
        "radar of another type": 3,
        "broken recording": 1,
        "no clicks": 1,
    }
    odd = [one.vehicle for one in plan.sessions if one.remounted]
    assert len(odd) == len(REMOUNTS)
    assert not set(odd) & {one.vehicle for one in plan.sessions if one.fault}


def test_a_remount_changes_a_mounting_by_its_size():
    plan = plan_fleet(7, 3, 2)
    sizes = []
    for before, after in zip(plan.sessions, plan.sessions[1:], strict=False):
        if after.remounted:
            sizes.append(
                (
                    float(np.linalg.norm(after.mounting.position_m - before.mounting.position_m)),
                    float(np.linalg.norm(after.mounting.angles_deg - before.mounting.angles_deg)),
                )
            )
        elif after.vehicle == before.vehicle:
            assert after.mounting is before.mounting
    assert sorted(round(moved_m, 6) for moved_m, _ in sizes) == [0.0, 0.05, 0.1]
    assert sorted(round(turned_deg) for _, turned_deg in sizes) == [0, 4, 5]  # of small rotations
