"""The exported table says what the results say."""

import csv
import io

import pytest

from cocalib.fleet.reading import read_fleet
from cocalib.fleet.records import FleetRecord
from cocalib.fleet.table_export import csv_bytes
from tests.unit.app.fleet.made_results import make_fleet, make_result


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> FleetRecord:
    folder = tmp_path_factory.mktemp("fleet")
    make_fleet(folder, 2, 2)
    make_result(folder, "V000", "s0", run=1)
    make_result(folder, 'a "name", with;commas', "s0", status="refused", reason="too few\nplacements")
    return read_fleet(folder)


def test_every_result_is_a_row_with_its_pose_and_change(fleet):
    rows = list(csv.DictReader(io.StringIO(csv_bytes(fleet).decode())))
    assert [(row["vehicle"], row["session"], row["superseded"]) for row in rows] == [
        ("V000", "s0", "False"),
        ("V000", "s1", "False"),
        ("V001", "s0", "False"),
        ("V001", "s1", "False"),
        ('a "name", with;commas', "s0", "False"),
        ("V000", "s0", "True"),
    ]
    last, change = fleet.vehicles[0].last, fleet.vehicles[0].transitions[-1]
    assert _numbers(rows[1]["covariance"]) == last.pose.covariance.ravel().tolist()
    assert _numbers(rows[1]["change_covariance"]) == change.covariance.ravel().tolist()
    assert _numbers(rows[1]["change"]) == change.change.tolist()
    assert float(rows[1]["change_rotation_deg"]) == change.rotation_deg
    assert int(rows[1]["recorded_ns"]) == last.outcome.recorded_ns
    assert rows[0]["change_from"] == rows[4]["covariance"] == ""
    assert rows[4]["reason"] == "too few\nplacements"


def _numbers(cell: str) -> list[float]:
    return [float(one) for one in cell.split()]


def test_an_empty_fleet_is_a_table_without_rows():
    assert len(csv_bytes(FleetRecord(())).splitlines()) == 1


def test_a_text_that_a_spreadsheet_would_compute_is_escaped_and_numbers_stay(tmp_path):
    make_result(tmp_path, "=HYPERLINK(1)", "-2", radar_serial="+cmd", camera_serial="@a", reason="-1+2")
    text = csv_bytes(read_fleet(tmp_path)).decode()
    (row,) = csv.DictReader(io.StringIO(text))
    assert (row["vehicle"], row["session"], row["radar_serial"]) == ("'=HYPERLINK(1)", "-2", "'+cmd")
    assert (row["camera_serial"], row["reason"]) == ("'@a", "'-1+2")
    assert len([float(one) for one in row["covariance"].split()]) == 36
    assert all(float(row[name]) <= 10.0 for name in ("qw", "qx", "x_m", "sigma_cm"))
