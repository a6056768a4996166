"""Where vehicles stand: what is planted is named, and nothing else; names on the command line mean one session."""

import math

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.fleet import MountingScatter
from cocalib.cli.fleet_tables import plan_lines
from cocalib.fleet.choosing import compare_sessions, vehicle_named
from cocalib.fleet.json_documents import status_document
from cocalib.fleet.kinds import kinds_of
from cocalib.fleet.reading import read_fleet
from cocalib.fleet.records import FleetRecord
from cocalib.fleet.standing import age_days, standings_of
from cocalib.fleet.summary_page import summary_html
from tests.unit.app.fleet.made_results import DAY_NS, FIRST_NS, make_fleet, make_result, session_error

_TURNED = np.array([0.0, 0.0, 0.0, 0.0, 0.12, 0.0])


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> FleetRecord:
    folder = tmp_path_factory.mktemp("fleet")
    rng = np.random.default_rng(2)
    make_fleet(folder, 7, 2, moved={"V002": _TURNED})
    for day in range(2):
        error = np.array([0.0, 0.0, 0.0, 0.2, 0.0, 0.0]) + session_error(rng)
        make_result(folder, "odd", f"s{day}", error=error, vehicle_type="van", recorded_ns=FIRST_NS + day * DAY_NS)
    make_result(folder, "V003", "s2", status="failed", reason="no such file", hint="check the path", vehicle_type="van")
    make_result(folder, "V004", "s2", verdict="contradictory", error=_TURNED, recorded_ns=FIRST_NS + 2 * DAY_NS)
    make_result(folder, "truck/1", "s/0", vehicle_type="truck")
    return read_fleet(folder)


def test_what_is_wrong_is_named_and_nothing_else(fleet):
    standings = {one.vehicle.name: one for one in standings_of(fleet, kinds_of(fleet))}
    assert [name for name, one in standings.items() if one.remounted] == ["V002"]
    assert [name for name, one in standings.items() if one.off_kind] == ["V002", "odd"]
    assert [name for name, one in standings.items() if one.needs] == ["V002", "V003", "V004", "odd"]
    assert standings["V002"].needs[0].startswith("this radar was remounted: ")
    assert standings["odd"].needs[0].startswith("is unlike its type: pitch -11 deg")
    assert standings["V003"].needs == ("s2 failed: no such file; check the path",)
    assert standings["V004"].needs == ("s2 is contradictory: see its report",)


def test_a_pose_that_its_own_data_contradict_is_not_compared(fleet):
    vehicle = vehicle_named(fleet, "V004")
    assert vehicle.calibrated.name == "s2"
    assert [one.after.session for one in vehicle.transitions] == ["s1"]


def test_ages_count_from_the_recording(fleet):
    assert age_days(vehicle_named(fleet, "V000").last, FIRST_NS + 3 * DAY_NS) == 2.0
    assert age_days(vehicle_named(fleet, "V003").last, FIRST_NS) is None


def test_the_scatter_names_whom_it_does_not_rest_on_and_why(fleet):
    truck, van = kinds_of(fleet)
    assert truck.sigma is None
    assert "too few" in truck.reason
    assert van.sigma is not None
    assert all(math.isfinite(one) for one in van.sigma)
    reasons = {(one.vehicle, one.session): one.reason for one in van.not_counted}
    assert reasons[("V003", "s2")] == "failed: no such file"
    assert reasons[("V004", "s2")] == "the verdict is contradictory"
    assert reasons[("odd", "s0, s1")].startswith("unlike its type: pitch ")
    assert reasons[("V002", "s1")].startswith("unlike its type: yaw ")
    assert isinstance(van.scatter, MountingScatter)
    assert {one.vehicle for one in van.scatter.mountings} == {f"V{index:03}" for index in range(7)}
    assert "odd" in {one.mounting.vehicle for one in van.scatter.left_out}


def test_two_sessions_of_a_vehicle_are_compared(fleet):
    compared = compare_sessions(fleet, "V002/s0", "V002/s1")
    assert compared.outcome == "differs"
    assert compared.words.startswith("this radar was remounted")
    for a, b in (("V001", "V001/s1"), ("truck/1", "truck/1/s/0")):
        with pytest.raises(InputError, match=f"{a} and {b} are the same session; name two"):
            compare_sessions(fleet, a, b)
    assert compare_sessions(fleet, "V000", "V004").b.session == "s1", "the last that can be compared"


def test_two_vehicles_differ_without_a_remount(fleet):
    compared = compare_sessions(fleet, "V000", "odd")
    assert compared.outcome == "differs"
    assert compared.words.startswith("V000 and odd are mounted differently: ")
    assert "between V000/s1 and odd/s1" in compared.words
    assert "remounted" not in compared.words
    assert "instead of" not in compared.words


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        ("V000", "truck/1", "is of type van and truck/1 of type truck"),
        ("V000/s7", "V001", "no session 'V000/s7'; V000 has s0, s1"),
        ("V0O0", "V001", "did you mean V00"),
        ("V004/s2", "V001", "V004/s2: the data of s2 contradict its pose"),
        ("V003/s2", "V001", r"V003/s2: s2 has no pose to compare \(failed: no such file\)"),
    ],
)
def test_a_wrong_name_is_refused_with_what_there_is(fleet, a, b, words):
    with pytest.raises(InputError, match=words):
        compare_sessions(fleet, a, b)


@pytest.mark.parametrize("count", [1, 2])
def test_a_fleet_of_one_or_two_has_no_kind_to_be_off(tmp_path, count):
    make_fleet(tmp_path, count, 2)
    fleet = read_fleet(tmp_path)
    (kind,) = kinds_of(fleet)
    assert kind.judged == {}
    assert all(one.needs == () for one in standings_of(fleet, [kind]))


def test_a_serial_in_the_last_sessions_of_two_vehicles_is_named(tmp_path):
    make_fleet(tmp_path, 3, 2)
    assert read_fleet(tmp_path).shared_serials == ()
    make_result(
        tmp_path, "V000", "s9", radar_serial="R-V002", camera_serial="C-V000", recorded_ns=FIRST_NS + 90 * DAY_NS
    )
    fleet = read_fleet(tmp_path)
    (said,) = fleet.shared_serials
    assert said.startswith("radar R-V002 is in the last sessions of 2 vehicles: V000, V002; correct the serial")
    assert said in [*plan_lines(fleet)]
    assert status_document(fleet, (), (), now_ns=0)["shared_serials"] == [said]
    assert said.removeprefix("radar ") in summary_html(fleet)
