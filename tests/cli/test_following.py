"""`cocalib open --follow`: the file may come later, and what is waited for is said."""

from pathlib import Path

import pytest

from calib_core.recordings import FollowedRecording, Recording
from tests.growing_recording import SampleWriter


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[tuple[Recording, int]]:
    """Return the recordings that would be served, each with its number of frames."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    found: list[tuple[Recording, int]] = []
    monkeypatch.setattr(
        "cocalib.web.port.serving.Service.serve",
        lambda _service, _workspace, recording: found.append((recording, len(recording.image_times))),
    )
    return found


def test_a_recording_that_has_not_been_begun_is_waited_for(cocalib, served, monkeypatch, tmp_path):
    path = tmp_path / "drive.mcap"
    writers: list[SampleWriter] = []

    def write_on(_seconds: float) -> None:
        if not writers:
            writers.append(SampleWriter(path))
        else:
            writers[0].write_until(8.0)

    monkeypatch.setattr("cocalib.opening.opened.sleep", write_on)
    answer = cocalib("open", "--follow", path, "--no-browser", "--port", 0, "--session", tmp_path / "session")
    writers[0].stop()
    assert answer.code == 0, answer.err
    waiting = [line for line in answer.out.splitlines() if line.startswith("Waiting for drive.mcap: ")]
    assert ["no radar messages" in line for line in waiting] == [False, True]
    [(recording, frames)] = served
    assert isinstance(recording, FollowedRecording)
    assert frames > 5
