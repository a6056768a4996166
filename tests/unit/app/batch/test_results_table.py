"""The table of results says what came of each session that the manifests name, in CSV as in JSON."""

import csv
import hashlib
import io
import json
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import msgspec
import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.errors import CalibrationError, InputError
from calib_core.geometry import quaternion_wxyz_from_matrix
from calib_core.interchange.own.calibration_json import calibration_text, read_calibration
from calib_core.results.verdict import stated_error
from cocalib.batch.job import Job
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, OutcomeFile, outcome_text
from cocalib.batch.plan import write_plan
from cocalib.batch.results_folder import OUTCOME_FILE, ResultsFolder
from cocalib.batch.results_table import SessionRow, csv_bytes, json_bytes, read_results, write_results

FIRST_NS = 1_790_000_000_000_000_000


@cache
def calibration() -> str:
    simulated = simulate_pairs(12, rng=np.random.default_rng(3), noise="imaging")
    return calibration_text(calibrate_pairs(simulated.pairs, simulated.camera).unwrap())


def digest_of(vehicle: str, session: str) -> str:
    return hashlib.sha256(f"{vehicle}\0{session}".encode()).hexdigest()[:32]


def make(folder: Path, vehicle: str, session: str, status: Any = "solved", **changes: Any) -> Path:
    """Write the result of a session; return its folder."""
    outcome = Outcome(OUTCOME_SCHEMA, digest_of(vehicle, session), vehicle, session, status)
    results, text = ResultsFolder(folder), calibration()
    with results.writing(outcome.digest) as unfinished:
        if status in ("solved", "weak"):
            (unfinished / "calibration.json").write_text(text)
            files = (OutcomeFile("calibration.json", hashlib.sha256(text.encode()).hexdigest()),)
            more = {"files": files, "verdict": "usable", "recorded_ns": FIRST_NS, "aed_px": 2.5, "pairs": 12}
            outcome = msgspec.structs.replace(outcome, **more)
        (unfinished / OUTCOME_FILE).write_text(outcome_text(msgspec.structs.replace(outcome, **changes)))
    return results.folder_of(outcome.digest)


def plan(folder: Path, *names: tuple[str, str], manifest: str = "all.toml") -> None:
    write_plan(folder, Path(manifest), [Job(ManifestRow(*name, ()), digest_of(*name)) for name in names])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with two sessions of one vehicle in the wrong order, a refused one, and one without a result."""
    make(tmp_path, "V1", "a", recorded_ns=FIRST_NS + 86_400_000_000_000)
    make(tmp_path, "V1", "b")
    make(tmp_path, "V0", "a", "refused", reason="too few\nplacements", hint="-1+2")
    make(tmp_path, "V2", "of no manifest")
    plan(tmp_path, ("V1", "a"), ("V1", "b"), ("V0", "a"), ("V9", "a"))
    return tmp_path


def test_a_row_says_what_the_calibration_says(folder):
    table = read_results(folder)
    assert [(row.vehicle, row.session, row.status) for row in table.sessions] == [
        ("V0", "a", "refused"),
        ("V1", "b", "solved"),
        ("V1", "a", "solved"),
        ("V9", "a", "missing"),
    ]
    row, solved = table.sessions[1], read_calibration(calibration()).calibration
    assert datetime.fromisoformat(row.recorded) == datetime.fromtimestamp(FIRST_NS // 10**9, UTC)
    assert (row.verdict, row.aed_px, row.pairs) == ("usable", 2.5, 12)
    stated = stated_error(solved)
    assert (row.rotation_95_deg, row.position_95_cm) == (stated.rotation_deg, stated.position_cm)
    assert [row.qw, row.qx, row.qy, row.qz] == quaternion_wxyz_from_matrix(solved.camera_from_radar.rotation).tolist()
    assert [row.x_m, row.y_m, row.z_m] == solved.camera_from_radar.translation_m.tolist()
    assert (folder / row.folder / "calibration.json").is_file()
    assert not table.all_solved
    plan(folder, ("V1", "a"), ("V1", "b"))
    assert read_results(folder).all_solved


def test_csv_and_json_have_the_same_rows_and_json_fits_its_schema(folder, project_root):
    table = read_results(folder)
    write_results(folder, table)
    document = json.loads((folder / "results.json").read_text())
    schema = json.loads((project_root / "docs/schemas/batch-results-1.schema.json").read_text())
    jsonschema.validate(document, schema)
    with (folder / "results.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [[*row] for row in rows] == [[*row] for row in document["sessions"]] == [[*SessionRow.__struct_fields__]] * 4
    assert rows[0] | {"hint": "-1+2"} == {
        key: "" if value is None else str(value) for key, value in document["sessions"][0].items()
    }
    assert [float(rows[1][name]) for name in ("qw", "x_m")] == [table.sessions[1].qw, table.sessions[1].x_m]


def test_a_text_that_a_spreadsheet_would_compute_is_escaped_and_numbers_stay(folder):
    make(folder, "=HYPERLINK(1)", "@s", reason="-1+2")
    plan(folder, ("=HYPERLINK(1)", "@s"))
    (row,) = csv.DictReader(io.StringIO(csv_bytes(read_results(folder)).decode()))
    assert (row["vehicle"], row["session"], row["reason"]) == ("'=HYPERLINK(1)", "'@s", "'-1+2")
    assert float(row["x_m"]) == read_results(folder).sessions[0].x_m


def test_the_latest_batch_says_which_job_counts(folder):
    make(folder, "V1", "old")
    document = json.loads((folder / "manifests" / "all.toml.json").read_text())
    for row, session in zip(document["sessions"][:2], ("old", "b"), strict=True):
        row |= {"session": session, "digest": digest_of("V1", "old")}
    (folder / "manifests" / "other.toml.json").write_text(json.dumps(document | {"started": "2000-01-01T00:00:00"}))
    statuses = {(row.vehicle, row.session): row.status for row in read_results(folder).sessions}
    assert statuses == {
        **{("V0", "a"): "refused", ("V1", "a"): "solved", ("V1", "b"): "solved", ("V9", "a"): "missing"},
        ("V1", "old"): "solved",
    }


@pytest.mark.parametrize(
    "text",
    [
        "garbage",
        outcome_text(Outcome(OUTCOME_SCHEMA, "other", "V1", "b", "solved")),
        outcome_text(Outcome(OUTCOME_SCHEMA, digest_of("V1", "b"), "V1", "b", "solved")).replace("come-1", "come-2"),
        outcome_text(Outcome(OUTCOME_SCHEMA, digest_of("V1", "b"), "V1", "b", "solved", pairs=1)).replace(
            '"pairs": 1', f'"pairs": {10**30}'
        ),
        '{"schema": ' * 100_000,
        f'{{"deep": {"[" * 100_000}{"]" * 100_000}}}',
    ],
    ids=["no JSON", "of another job", "of another version", "huge", "deep and torn", "deep"],
)
def test_an_outcome_that_cannot_be_read_is_one_row(folder, text):
    (folder / "results" / digest_of("V1", "b") / OUTCOME_FILE).write_text(text)
    rows = {(row.vehicle, row.session): row for row in read_results(folder).sessions}
    assert rows["V1", "b"].status == "unreadable"
    assert digest_of("V1", "b") in rows["V1", "b"].reason
    assert rows["V1", "a"].status == "solved"
    assert json_bytes(read_results(folder))


def test_a_calibration_that_was_changed_is_named_and_has_no_pose(folder):
    (folder / "results" / digest_of("V1", "b") / "calibration.json").write_text("{}")
    row = read_results(folder).sessions[1]
    assert (row.session, row.status, row.x_m) == ("b", "unreadable", None)
    assert "calibration.json" in row.reason


def test_a_pose_that_nobody_must_use_is_not_in_the_table(folder):
    make(folder, "V3", "a", "weak", verdict="contradictory")
    plan(folder, ("V3", "a"))
    (row,) = read_results(folder).sessions
    assert (row.status, row.verdict, row.qw, row.rotation_95_deg) == ("weak", "contradictory", None, None)


def test_a_stamp_that_no_calendar_has_is_unknown(folder):
    make(folder, "V3", "a", recorded_ns=2**62 * 1000)
    plan(folder, ("V3", "a"))
    assert read_results(folder).sessions[0].recorded is None


def test_a_manifest_s_record_that_cannot_be_read_is_named(folder):
    (folder / "manifests" / "spoilt.json").write_text("garbage")
    table = read_results(folder)
    assert [reason.partition(": ")[0] for reason in table.unread] == ["manifests/spoilt.json"]
    assert len(table.sessions) == 4
    assert not table.all_solved


def test_a_folder_that_no_batch_wrote_to_is_refused(tmp_path):
    with pytest.raises(InputError, match="no results"):
        read_results(tmp_path)


@pytest.mark.parametrize("name", ["results.csv", "results.json"])
def test_the_table_is_never_written_through_a_link(folder, tmp_path, name):
    (tmp_path / "elsewhere").write_text("theirs")
    (folder / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(CalibrationError, match=name):
        write_results(folder, read_results(folder))
    assert (tmp_path / "elsewhere").read_text() == "theirs"
