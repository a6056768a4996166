"""Assumptions about a recording: shown until they are confirmed, remembered in the session, written into the file."""

import json
import os
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.recordings import Recording, RecordingOptions, open_recording
from calib_core.results import Calibration
from cocalib.session.events import AssumptionsConfirmed, ColumnsMapped, Undo
from cocalib.session.file.finding import remembered_map
from cocalib.solving.solving import GivenPairs, calibration_text, calibration_text_of_pairs, solve_pairs
from cocalib.workspace import Workspace, open_workspace
from tests.vendor_recording import STATED, vendor_sample


@pytest.fixture(scope="module")
def paths(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return vendor_sample(project_root / "sample_data" / "rooftop", tmp_path_factory.mktemp("vendor"))


@pytest.fixture
def recording(paths: tuple[Path, Path]) -> Iterator[Recording]:
    with open_recording(paths) as opened:
        yield opened


def workspace_of(recording: Recording, folder: Path) -> Workspace:
    return open_workspace(recording, camera=recording.camera(), session_folder=folder, name="vendor")


def solved(workspace: Workspace, clicks: str) -> Calibration:
    answered = threading.Event()
    workspace.import_clicks(clicks, "clicks.json")
    end = workspace.subscribe(lambda shown: answered.set() if shown.stage == "solved" else None)
    assert answered.wait(120)
    end()
    assert isinstance(workspace.session.outcome, Calibration)
    return workspace.session.outcome


@pytest.mark.slow
def test_an_unconfirmed_assumption_is_in_the_view_and_the_file(recording, project_root, tmp_path):
    workspace = workspace_of(recording, tmp_path)
    clicks = (project_root / "sample_data" / "rooftop" / "clicks.json").read_text(encoding="utf-8")
    calibration = solved(workspace, clicks)
    texts = tuple(row.text for row in workspace.view.assumptions)
    assert ["f_Azimuth" in text or "f_VelRad" in text for text in texts] == [True, True]
    file = read_calibration(calibration_text(calibration, recording, workspace.session.confirmed))
    assert [(one.text, one.confirmed) for one in file.provenance.assumptions] == [(text, False) for text in texts]
    assert [warning.code for warning in file.calibration.warnings].count("assumed") == 2
    text = calibration_text(calibration, recording)
    given = GivenPairs.read(text, "a.json")
    again = read_calibration(calibration_text_of_pairs(solve_pairs(given), given))
    assert [warning.code for warning in again.calibration.warnings].count("assumed") == 2, (
        "solving again confirms nothing"
    )
    revision = workspace.session.revision
    workspace.dispatch(AssumptionsConfirmed(texts))
    assert workspace.view.assumptions == ()
    assert workspace.session.revision == revision, "what was solved stays valid"
    file = read_calibration(calibration_text(calibration, recording, workspace.session.confirmed))
    assert [one.confirmed for one in file.provenance.assumptions] == [True, True]
    assert "assumed" not in [warning.code for warning in file.calibration.warnings]
    workspace.dispatch(Undo())
    assert workspace.view.assumptions == (), "undo is about clicks and options"
    workspace.close()


def test_the_confirmation_is_remembered_and_covers_only_what_was_confirmed(recording, tmp_path):
    workspace = workspace_of(recording, tmp_path)
    first, second = (row.text for row in workspace.view.assumptions)
    workspace.dispatch(AssumptionsConfirmed((first,)))
    workspace.close()
    (tmp_path / "journal.jsonl").rename(tmp_path / "lost")
    for path in ("lost", None):
        again = workspace_of(recording, tmp_path)
        assert [row.text for row in again.view.assumptions] == [second], "from the copy, then from the new journal"
        again.close()
        if path:
            (tmp_path / path).unlink()


def test_the_map_is_remembered_for_the_next_opening(paths, tmp_path):
    assert remembered_map(tmp_path) == ()
    with open_recording(paths, RecordingOptions(map=STATED)) as recording:
        assert recording.assumptions == ()
        workspace = workspace_of(recording, tmp_path)
        workspace.dispatch(ColumnsMapped(recording.column_map))
        workspace.dispatch(Undo())
        assert workspace.session.column_map == STATED
        workspace.close()
    assert remembered_map(tmp_path) == STATED
    with open_recording(paths, RecordingOptions(map=remembered_map(tmp_path))) as recording:
        assert recording.column_map == STATED


DAMAGED = b'\xff\xfe\n{"step": 3}\n[]\n{"step": {"type": "columns_mapped", "column_map": 3}}\n'


@pytest.mark.parametrize("content", [DAMAGED, b'{"step":{"type":"x","a":' + b"[" * 100_000 + b"\n", None])
def test_a_journal_that_is_damaged_a_pipe_or_a_link_remembers_nothing(tmp_path, content):
    if content is not None:
        (tmp_path / "journal.jsonl").write_bytes(content)
        assert remembered_map(tmp_path) == ()
        return
    os.mkfifo(tmp_path / "journal.jsonl")
    assert remembered_map(tmp_path) == ()
    (tmp_path / "other").mkdir()
    step = {"n": 1, "step": {"type": "columns_mapped", "column_map": list(STATED)}}
    (tmp_path / "elsewhere").write_text(json.dumps(step) + "\n")
    (tmp_path / "other" / "journal.jsonl").symlink_to(tmp_path / "elsewhere")
    assert remembered_map(tmp_path / "other") == ()
