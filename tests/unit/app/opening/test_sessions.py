"""Which session an opening continues or starts, and which clicks it takes."""

from pathlib import Path

import pytest

from calib_core.measurements import TimeNs
from cocalib.opening.choice import Choice
from cocalib.opening.opened import fitting_clicks, session_folder, session_offer
from cocalib.session.events import ClickPlaced
from cocalib.session.file.finding import has_session_of
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.file.session_file import open_session_file
from cocalib.session.state import RecordingFacts
from cocalib.workspace import open_workspace, recording_facts
from tests.image_recording import ImageRecording, grey_images


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a recording with a session of three frames and two clicks."""
    recording = ImageRecording(grey_images(3))
    folder = tmp_path / "a.bag.cocalib-session"
    workspace = open_workspace(recording, camera=None, session_folder=folder, name="a.bag")
    for frame in (0, 2):
        workspace.dispatch(ClickPlaced(TimeNs(int(recording.image_times[frame])), (5.0, 6.0), "clicked"))
    workspace.close()
    (tmp_path / "a.bag").write_bytes(b"")
    return tmp_path / "a.bag"


def facts(count: int, start: int = 0) -> RecordingFacts:
    recording = ImageRecording(grey_images(count + start))
    whole = recording_facts(recording, "a.bag")
    return RecordingFacts(whole.name, whole.image_times[start:], whole.width_px, whole.height_px)


def test_a_session_of_these_frames_is_continued(path):
    found = session_folder(Choice((path,)), facts(3)).path
    assert found == path.with_name("a.bag.cocalib-session")
    assert session_offer(Choice((path,)), facts(3), None).continues
    assert session_offer(Choice((path,)), facts(3), None).clicks == 2


def test_a_session_of_other_frames_is_left_alone_and_its_clicks_that_fit_are_copied(path):
    other, folder = facts(2, start=1), path.with_name("a.bag.cocalib-session")
    assert not has_session_of(folder, other)
    with pytest.raises(SessionFileError, match="belongs to"):
        open_session_file(session_folder(Choice((path,)), other).path, other)
    for plan in ("new", "copy"):
        found = session_folder(Choice((path,), session_plan=plan), other).path
        assert found == path.with_name("a.bag-2.cocalib-session")
    copied = fitting_clicks(folder, other)
    assert [click.image_time for click in copied.clicks] == [int(other.image_times[1])]
    assert copied.about.facts["message"].startswith("1 of the 2 ")


def test_a_new_session_of_the_same_frames_keeps_the_old_one_under_another_name_or_copies_its_clicks(path, capsys):
    folder = path.with_name("a.bag.cocalib-session")
    copy = session_folder(Choice((path,), session_plan="copy"), facts(3)).path
    assert copy == path.with_name("a.bag-2.cocalib-session")
    assert len(fitting_clicks(folder, facts(3)).clicks) == 2
    assert session_folder(Choice((path,), session_plan="new"), facts(3)).path == folder
    assert not folder.exists()
    assert str(path.with_name("a.bag.cocalib-session.1")) in capsys.readouterr().out
