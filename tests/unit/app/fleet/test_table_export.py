"""The exported table says what the index says."""

import csv
import importlib
import io
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from calib_core.errors import InputError
from cocalib.fleet.index import read_fleet
from cocalib.fleet.records import FleetRecord
from cocalib.fleet.table_export import csv_bytes, parquet_bytes
from tests.unit.app.fleet.made_results import make_fleet, make_result


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> FleetRecord:
    folder = tmp_path_factory.mktemp("fleet")
    make_fleet(folder, 2, 2)
    make_result(folder, "V000", "s0", run=1)
    make_result(folder, 'a "name", with;commas', "s0", status="refused", reason="too few\nplacements")
    return read_fleet(folder)


def test_parquet_reads_back(fleet: FleetRecord) -> None:
    rows = pyarrow.parquet.read_table(io.BytesIO(parquet_bytes(fleet))).to_pylist()
    assert [(row["vehicle"], row["session"], row["superseded"]) for row in rows] == [
        ("V000", "s0", False),
        ("V000", "s1", False),
        ("V001", "s0", False),
        ("V001", "s1", False),
        ('a "name", with;commas', "s0", False),
        ("V000", "s0", True),
    ]
    last = fleet.vehicles[0].last
    change = fleet.vehicles[0].transitions[-1]
    assert last.pose is not None
    assert np.array_equal(np.reshape(rows[1]["covariance"], (6, 6)), last.pose.covariance)
    assert np.array_equal(np.reshape(rows[1]["change_covariance"], (6, 6)), change.covariance)
    assert rows[1]["change"] == change.change.tolist()
    assert rows[1]["change_rotation_deg"] == change.rotation_deg
    assert rows[1]["recorded_ns"] == last.outcome.recorded_ns
    assert rows[0]["change_from"] is None
    assert rows[4]["covariance"] is None


def test_csv_has_the_same_rows(fleet: FleetRecord) -> None:
    rows = list(csv.DictReader(io.StringIO(csv_bytes(fleet).decode())))
    table = pyarrow.parquet.read_table(io.BytesIO(parquet_bytes(fleet)))
    assert list(rows[0]) == table.column_names
    assert [row["vehicle"] for row in rows] == table.column("vehicle").to_pylist()
    assert rows[4]["reason"] == "too few\nplacements"
    assert [float(one) for one in rows[1]["covariance"].split()] == table.column("covariance").to_pylist()[1]


def test_without_pyarrow_the_way_out_is_named(fleet: FleetRecord, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> object:
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(InputError, match=r"pip install pyarrow, or write CSV with --csv"):
        parquet_bytes(fleet)


def test_an_empty_fleet_is_a_table_without_rows(tmp_path: Path) -> None:
    assert pyarrow.parquet.read_table(io.BytesIO(parquet_bytes(FleetRecord(())))).num_rows == 0


def test_a_text_that_a_spreadsheet_would_compute_is_escaped_and_numbers_stay(tmp_path: Path) -> None:
    make_result(tmp_path, "=HYPERLINK(1)", "-2", radar_serial="+cmd", camera_serial="@a", reason="-1+2")
    text = csv_bytes(read_fleet(tmp_path)).decode()
    (row,) = csv.DictReader(io.StringIO(text))
    assert (row["vehicle"], row["session"], row["radar_serial"]) == ("'=HYPERLINK(1)", "-2", "'+cmd")
    assert (row["camera_serial"], row["reason"]) == ("'@a", "'-1+2")
    assert len([float(one) for one in row["covariance"].split()]) == 36
    assert all(float(row[name]) <= 10.0 for name in ("qw", "qx", "x_m", "sigma_cm"))
