"""Sessions that were solved with a fleet's prior: their data count, their drawn poses do not, and everybody is told."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.fleet_prior import DataAlone, FleetAnswer, FleetPrior
from cocalib.cli.fleet.text_tables import history_lines, status_lines
from cocalib.fleet.choosing import compare_sessions
from cocalib.fleet.index import read_fleet, rebuild_index
from cocalib.fleet.json_documents import comparison_document, history_document
from cocalib.fleet.kinds import kinds_of
from cocalib.fleet.records import FleetRecord
from cocalib.fleet.standing import standings_of
from cocalib.fleet.summary_page import write_summary
from cocalib.fleet.table_export import csv_bytes
from tests.unit.app.fleet.made_results import DAY_NS, FIRST_NS, calibration, make_fleet, make_result

TURNED = np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0])


def prior() -> FleetPrior:
    return FleetPrior("van", calibration().camera_from_radar, np.diag([0.01] * 6) ** 2, ("V000", "V001"))


def answer(
    *, widened: float = 1.0, error: np.ndarray = TURNED, verdict: str = "usable", used: bool = True
) -> FleetAnswer:
    base = calibration()
    pose = base.camera_from_radar.perturbed(error)
    data = DataAlone(pose, widened * base.covariance, base.covariance_quantile, verdict)
    return FleetAnswer(prior(), used, data, 9.0, 30.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("prior")
    make_fleet(made, 6, 1)
    common = {"vehicle_type": "van", "recorded_ns": FIRST_NS + DAY_NS}
    make_result(made, "V000", "s1", fleet=answer(), fleet_prior="used", **common)
    uncertain = answer(widened=400.0, error=0.1 * TURNED, verdict="weak")
    make_result(made, "few", "s0", fleet=uncertain, fleet_prior="used", **common)
    doubted = answer(error=0.1 * TURNED, verdict="weak")
    make_result(made, "doubted", "s0", fleet=doubted, fleet_prior="used", **common)
    make_result(made, "V001", "s1", fleet=answer(verdict="contradictory"), fleet_prior="used", **common)
    unusual = {"verdict": "weak", "warnings": ("far-from-its-kind",)}
    make_result(made, "far", "s0", fleet=answer(error=0.2 * TURNED), fleet_prior="used", **common, **unusual)
    make_result(made, "open", "s0", fleet=FleetAnswer(prior(), True, None), fleet_prior="untested", **common)
    odd = {"verdict": "weak", "reason": "the data contradict it", "hint": "check the radar"}
    refused = answer(used=False)
    make_result(made, "odd", "s0", error=TURNED, fleet=refused, fleet_prior="contradicted", **common, **odd)
    make_result(made, "sound", "s0", fleet=answer(used=False), fleet_prior="contradicted", **common, **odd)
    return made


@pytest.fixture(scope="module")
def fleet(folder: Path) -> FleetRecord:
    return read_fleet(folder)


def test_a_remount_is_seen_although_the_stated_pose_is_drawn_to_the_fleet(fleet: FleetRecord) -> None:
    (vehicle,) = (one for one in fleet.vehicles if one.name == "V000")
    (change,) = vehicle.transitions
    assert change.is_remount
    assert change.rotation_deg == pytest.approx(np.degrees(0.1), abs=1.5)


def reasons(fleet: FleetRecord) -> dict[str, str]:
    (kind,) = kinds_of(fleet)
    return {one.vehicle: one.reason for one in kind.not_counted}


def test_data_count_in_the_scatter_if_they_would_be_usable_without_the_prior(fleet: FleetRecord) -> None:
    found = reasons(fleet)
    for name in ("few", "doubted"):  # however small the error that the data state
        assert found[name].startswith("solved with a fleet's prior; the verdict on its data alone is weak (sigma ")
    assert "only the fleet's prior closes what its placements leave open" in found["open"]
    assert "V000" not in found or "off its kind" in found["V000"]


def test_a_mounting_far_from_the_prior_is_judged_by_the_scatter_and_not_left_out_for_it(fleet: FleetRecord) -> None:
    found = reasons(fleet)
    assert "far" not in found
    assert "sound" not in found
    assert found["odd"].startswith("off its kind: ")


def test_data_that_contradict_themselves_are_not_compared(fleet: FleetRecord) -> None:
    (vehicle,) = (one for one in fleet.vehicles if one.name == "V001")
    assert [one.name for one in vehicle.sessions] == ["s0", "s1"]
    assert vehicle.transitions == ()
    assert "the verdict on its data alone is contradictory" in reasons(fleet)["V001"]


def test_an_index_brings_the_same_back(folder: Path, fleet: FleetRecord) -> None:
    rebuild_index(folder)
    again = read_fleet(folder)
    for one, other in zip(fleet.vehicles, again.vehicles, strict=True):
        assert [a.pose is None or a.pose.of_data_alone for a in one.sessions] == [
            a.pose is None or a.pose.of_data_alone for a in other.sessions
        ]
        assert [a.outcome for a in one.sessions] == [a.outcome for a in other.sessions]
        assert [a.words for a in one.transitions] == [b.words for b in other.transitions]


def test_every_place_says_it(folder: Path, fleet: FleetRecord) -> None:
    standings = standings_of(fleet, kinds_of(fleet))
    told = "\n".join(status_lines(standings, now_ns=FIRST_NS + 2 * DAY_NS))
    for name, words in (("V000", "(with prior)"), ("open", "(by prior)"), ("odd", "(off prior)")):
        (line,) = (one for one in told.splitlines() if one.startswith(f"{name} "))
        assert words in line
        assert (" (alone " in line) == (name != "odd")
    assert "odd: s0 contradicts the fleet's prior, which was not used: the data contradict it; check the radar" in told
    vehicle = next(one for one in fleet.vehicles if one.name == "V000")
    history = "\n".join(history_lines(vehicle, ()))
    assert "(with prior)" in history
    assert "  s1: solved with a fleet's prior; changes are measured with the answer of its data alone" in history
    before, after = history_document(vehicle, ())["sessions"]
    assert (before["fleet_prior"], before["alone_sigma_deg"], before["pose_of_data_alone"]) == (None, None, False)
    assert (after["fleet_prior"], after["alone_verdict"], after["pose_of_data_alone"]) == ("used", "usable", True)
    assert after["alone_sigma_deg"] == pytest.approx(after["sigma_deg"])
    rows = {row["vehicle"]: row for row in csv.DictReader(io.StringIO(csv_bytes(fleet).decode()))}
    assert (rows["odd"]["fleet_prior"], rows["odd"]["pose_of_data_alone"]) == ("contradicted", "False")
    assert (rows["few"]["alone_verdict"], rows["few"]["pose_of_data_alone"]) == ("weak", "True")
    assert float(rows["few"]["alone_sigma_cm"]) == pytest.approx(20.0 * float(rows["few"]["sigma_cm"]))
    page = write_summary(folder, fleet).read_text()
    assert "(with prior)" in page
    assert " (alone " in page


def test_a_comparison_names_the_data_that_it_rests_on(fleet: FleetRecord) -> None:
    compared = compare_sessions(fleet, "V000/s0", "V000/s1")
    assert compared.notes == ("V000/s1 was solved with a fleet's prior; the answer of its data alone is compared",)
    document = comparison_document(compared)
    assert (document["a"]["of_data_alone"], document["b"]["of_data_alone"]) == (False, True)
    with pytest.raises(InputError, match="only the fleet's prior closes what its placements leave open"):
        compare_sessions(fleet, "V000", "open")
    with pytest.raises(InputError, match=r"V001/s1: the data of s1 contradict its pose"):
        compare_sessions(fleet, "V000", "V001/s1")
    assert compare_sessions(fleet, "V000", "V001").b.session == "s0"
