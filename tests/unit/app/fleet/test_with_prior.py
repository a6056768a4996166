"""Sessions that were solved with a fleet's prior: their data count, their drawn poses do not, and everybody is told."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from app.cli.fleet.text_tables import history_lines, status_lines
from app.fleet.index import read_fleet, rebuild_index
from app.fleet.json_documents import history_document
from app.fleet.kinds import kinds_of
from app.fleet.records import FleetRecord
from app.fleet.standing import standings_of
from app.fleet.summary_page import write_summary
from app.fleet.table_export import csv_bytes
from calib_core.fleet_prior import DataAlone, FleetAnswer, FleetPrior
from tests.unit.app.fleet.made_results import DAY_NS, FIRST_NS, calibration, make_fleet, make_result

TURNED = np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0])


def prior() -> FleetPrior:
    return FleetPrior("van", calibration().camera_from_radar, np.diag([0.01] * 6) ** 2, ("V000", "V001"))


def answer(*, widened: float = 1.0, error: np.ndarray = TURNED) -> FleetAnswer:
    base = calibration()
    pose = base.camera_from_radar.perturbed(error)
    return FleetAnswer(prior(), True, DataAlone(pose, widened * base.covariance, base.covariance_quantile), 9.0, 30.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("prior")
    make_fleet(made, 6, 1)
    common = {"vehicle_type": "van", "recorded_ns": FIRST_NS + DAY_NS}
    make_result(made, "V000", "s1", fleet=answer(), fleet_prior="used", **common)
    make_result(made, "few", "s0", fleet=answer(widened=400.0, error=0.1 * TURNED), fleet_prior="used", **common)
    make_result(made, "open", "s0", fleet=FleetAnswer(prior(), True, None), fleet_prior="untested", **common)
    odd = {"verdict": "weak", "reason": "the data contradict it", "hint": "check the radar"}
    refused = FleetAnswer(prior(), False, answer().data_alone, 90.0, 30.0)
    make_result(made, "odd", "s0", fleet=refused, fleet_prior="contradicted", **common, **odd)
    return made


@pytest.fixture(scope="module")
def fleet(folder: Path) -> FleetRecord:
    return read_fleet(folder)


def test_a_remount_is_seen_although_the_stated_pose_is_drawn_to_the_fleet(fleet: FleetRecord) -> None:
    (vehicle,) = (one for one in fleet.vehicles if one.name == "V000")
    (change,) = vehicle.transitions
    assert change.is_remount
    assert change.rotation_deg == pytest.approx(np.degrees(0.1), abs=1.5)


def test_data_that_say_little_alone_do_not_count_and_those_without_a_pose_have_none(fleet: FleetRecord) -> None:
    (kind,) = kinds_of(fleet)
    reasons = {one.vehicle: one.reason for one in kind.not_counted}
    assert reasons["few"].startswith("solved with a fleet's prior; its data alone are uncertain to ")
    assert "only the fleet's prior closes what its placements leave open" in reasons["open"]
    assert reasons["odd"] == "the verdict is weak"
    assert "V000" not in reasons or "off its kind" in reasons["V000"]


def test_an_index_brings_the_same_back(folder: Path, fleet: FleetRecord) -> None:
    rebuild_index(folder)
    again = read_fleet(folder)
    for one, other in zip(fleet.vehicles, again.vehicles, strict=True):
        assert [a.pose is None or a.pose.of_data_alone for a in one.sessions] == [
            a.pose is None or a.pose.of_data_alone for a in other.sessions
        ]
        assert [a.outcome for a in one.sessions] == [a.outcome for a in other.sessions]


def test_every_place_says_it(folder: Path, fleet: FleetRecord) -> None:
    standings = standings_of(fleet, kinds_of(fleet))
    told = "\n".join(status_lines(standings, now_ns=FIRST_NS + 2 * DAY_NS))
    for name, words in (("V000", "(with prior)"), ("open", "(by prior)"), ("odd", "(off prior)")):
        (line,) = (one for one in told.splitlines() if one.startswith(f"{name} "))
        assert words in line
    assert "odd: s0 contradicts the fleet's prior, which was not used: the data contradict it; check the radar" in told
    vehicle = next(one for one in fleet.vehicles if one.name == "V000")
    assert "(with prior)" in "\n".join(history_lines(vehicle, ()))
    assert [one["fleet_prior"] for one in history_document(vehicle, ())["sessions"]] == [None, "used"]
    rows = list(csv.DictReader(io.StringIO(csv_bytes(fleet).decode())))
    assert {row["vehicle"]: row["fleet_prior"] for row in rows if row["session"] == "s0"}["odd"] == "contradicted"
    assert "(with prior)" in write_summary(folder, fleet).read_text()
