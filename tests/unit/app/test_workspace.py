"""The only mutable state: order of journalling and notifying, threads, answers, import and download."""

import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.own.clicks_json import read_clicks
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs, Unsolvable
from cocalib.session.applying import EventError, History
from cocalib.session.events import ClickPlaced, ClickRemoved, IntrinsicsChosen, OptionsChanged, Redo, Solved, Step, Undo
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.file.session_file import Closed, Restored
from cocalib.session.state import ChosenIntrinsics, RecordingFacts
from cocalib.view.build import view
from cocalib.view.model import View
from cocalib.workspace import Workspace, open_workspace, recording_facts

FACTS = RecordingFacts("drive", 1_700_000_000_123_456_789 + 100_000_000 * np.arange(50), width_px=640, height_px=480)
TIMES = [TimeNs(int(time)) for time in FACTS.image_times]
NO_ANSWER = Unsolvable.reported("too-few-pairs", "1 of at least 4 pairs", "click more")


class ListJournal:
    def __init__(self) -> None:
        self.steps: list[Step] = []
        self.refuse = False
        self.closed = False

    def append(self, step: Step, history: History) -> None:
        if self.refuse:
            raise SessionFileError("the disk is full")
        self.steps.append(step)

    def close(self) -> Closed:
        self.closed = True
        return Closed(Path("nowhere"), 0)


class HeldSolver:
    def __init__(self) -> None:
        self.revisions: list[int] = []
        self.closed = False

    def request(self, revision: int, clicks, options, when_done: Callable[[Solved], None], camera=None) -> None:
        self.revisions.append(revision)
        self.when_done, self.camera = when_done, camera

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def journal() -> ListJournal:
    return ListJournal()


@pytest.fixture
def solver() -> HeldSolver:
    return HeldSolver()


@pytest.fixture
def workspace(journal: ListJournal, solver: HeldSolver) -> Workspace:
    return Workspace(FACTS, Restored(Path("nowhere"), History()), journal, solver)


CLICK = ClickPlaced(TIMES[3], (1.0, 2.0), "clicked")


def test_a_click_is_seen_at_once_and_the_answer_later_until_the_workspace_is_closed(workspace, solver, journal):
    seen, journalled, ended = [], [], []
    workspace.subscribe(seen.append)
    workspace.subscribe(lambda shown: journalled.append(len(journal.steps)))
    workspace.subscribe(ended.append)()
    workspace.dispatch(CLICK)
    assert [shown.stage for shown in seen] == ["collecting", "solving"]
    assert journalled == [0, 1], "before anyone is told"
    solver.when_done(Solved(1, NO_ANSWER))
    assert [shown.solving for shown in seen] == [False, True, False]
    assert seen[-1] == workspace.view == view(workspace.history, FACTS)
    assert len(ended) == 1
    workspace.close()
    assert journal.closed
    assert solver.closed


def test_a_step_that_cannot_be_stored_or_does_not_fit_is_not_made(workspace, journal, solver):
    seen = []
    workspace.subscribe(seen.append)
    with pytest.raises(EventError):
        workspace.dispatch(ClickRemoved("c1"))
    journal.refuse = True
    with pytest.raises(SessionFileError):
        workspace.dispatch(CLICK)
    assert (workspace.session.clicks, journal.steps, solver.revisions, len(seen)) == ((), [], [], 1)
    journal.refuse = False
    workspace.dispatch(CLICK)
    assert len(workspace.session.clicks) == 1


def test_undo_and_redo_and_the_whole_of_the_options_are_journalled_and_answers_are_not(workspace, journal):
    workspace.dispatch(OptionsChanged({"method": "paper"}))
    assert journal.steps == [OptionsChanged.of(workspace.session.options)]
    assert workspace.session.options.method == "paper"
    workspace.dispatch(CLICK)
    workspace.dispatch(Solved(2, NO_ANSWER))
    for _ in range(3):  # the last has nothing to undo
        workspace.dispatch(Undo())
    workspace.dispatch(Redo())
    assert [type(step).__name__ for step in journal.steps[1:]] == ["ClickPlaced", "Undo", "Undo", "Redo"]


def test_the_solver_is_asked_for_every_revision_with_clicks_and_only_for_those(workspace, solver):
    workspace.dispatch(OptionsChanged({"method": "paper"}))
    workspace.dispatch(CLICK)
    workspace.dispatch(Solved(2, NO_ANSWER))
    workspace.dispatch(ClickPlaced(TIMES[4], (1.0, 2.0), "clicked"))
    workspace.dispatch(Undo())
    assert solver.revisions == [2, 3]


def test_the_camera_chosen_last_is_solved_with(workspace, solver):
    workspace.dispatch(CLICK)
    for focal_px in (500.0, 600.0):
        camera = Camera(
            "pinhole", 640, 480, np.array([[focal_px, 0.0, 320.0], [0.0, focal_px, 240.0], [0.0, 0.0, 1.0]])
        )
        workspace.dispatch(IntrinsicsChosen(ChosenIntrinsics.of(camera, "a file")))
        assert solver.camera.matrix_px[0, 0] == workspace.camera.matrix_px[0, 0] == focal_px


def test_a_restored_session_is_solved_at_once(journal, solver):
    first = Workspace(FACTS, Restored(Path("nowhere"), History()), journal, HeldSolver())
    first.dispatch(CLICK)
    Workspace(FACTS, Restored(Path("nowhere"), first.history), journal, solver)
    assert solver.revisions == [1]


def test_an_answer_that_comes_within_the_request_does_not_deadlock(journal):
    class Immediate(HeldSolver):
        def request(self, revision: int, clicks, options, when_done: Callable[[Solved], None], camera=None) -> None:
            when_done(Solved(revision, NO_ANSWER))

    workspace = Workspace(FACTS, Restored(Path("nowhere"), History()), journal, Immediate())
    workspace.dispatch(CLICK)
    assert workspace.session.is_solved


def test_a_subscriber_may_dispatch(workspace):
    def tidy(shown: View) -> None:
        if len(shown.clicks) > 1:
            workspace.dispatch(ClickRemoved(shown.clicks[0].id))

    seen: list[int] = []
    workspace.subscribe(tidy)
    workspace.subscribe(lambda shown: seen.append(len(shown.clicks)))
    workspace.dispatch(CLICK)
    workspace.dispatch(ClickPlaced(TIMES[4], (1.0, 2.0), "clicked"))
    assert seen == [0, 1, 2, 1]


def test_a_subscriber_that_fails_does_not_silence_the_workspace(workspace):
    def fail(shown: View) -> None:
        raise ZeroDivisionError

    seen: list[View] = []
    with pytest.raises(ZeroDivisionError):
        workspace.subscribe(fail)
    workspace.subscribe(seen.append)
    with pytest.raises(ZeroDivisionError):
        workspace.dispatch(CLICK)
    assert len(workspace.session.clicks) == 1


def test_many_threads_at_once_lose_no_step_and_views_come_in_order(workspace, journal):
    seen: list[int] = []
    workspace.subscribe(lambda shown: seen.append(shown.revision))
    ready = threading.Barrier(4)

    def click(start: int) -> None:
        ready.wait()
        for frame in range(start, 48, 4):
            workspace.dispatch(ClickPlaced(TIMES[frame], (1.0, 2.0), "clicked"))

    threads = [threading.Thread(target=click, args=(start,)) for start in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(workspace.session.clicks) == len(journal.steps) == 48
    assert seen == list(range(49))


def test_a_change_is_shown_before_it_is_done_also_while_another_is_being_shown(workspace):
    seen: list[int] = []
    when_done: list[int] = []
    showing, going_on = threading.Event(), threading.Event()

    def slow(shown: View) -> None:
        seen.append(len(shown.clicks))
        if len(shown.clicks) == 1:
            showing.set()
            assert going_on.wait(10)

    def click_again() -> None:
        workspace.dispatch(ClickPlaced(TIMES[4], (1.0, 2.0), "clicked"))
        when_done.append(seen[-1])

    workspace.subscribe(slow)
    threads = [threading.Thread(target=lambda: workspace.dispatch(CLICK)), threading.Thread(target=click_again)]
    threads[0].start()
    assert showing.wait(10)
    threads[1].start()
    threads[1].join(0.1)
    going_on.set()
    for thread in threads:
        thread.join()
    assert when_done == [2]


def test_downloaded_clicks_can_be_imported_again(workspace):
    for frame in (3, 5):
        workspace.dispatch(ClickPlaced(TIMES[frame], (1.5, 2.5), "clicked"))
    text, clicks = workspace.clicks_text(), workspace.session.clicks
    assert read_clicks(text) == clicks
    workspace.dispatch(Undo())
    workspace.dispatch(Undo())
    workspace.import_clicks(text, "clicks.json")
    assert workspace.session.clicks == clicks
    workspace.dispatch(Undo())
    assert workspace.session.clicks == ()
    with pytest.raises(InputError, match=r"holiday\.json"):
        workspace.import_clicks("[]", "holiday.json")


class BareRecording:
    radar_topic = image_topic = camera_info_topic = radar_clock = image_clock = None
    radar_axes: str | None = None
    radar_topics, radar_choice = (), ""
    video_start = None
    assumptions = stated_assumptions = column_map = image_names = ()
    radar_frame, camera_frame = "radar", "camera"
    image_times = FACTS.image_times
    radar_times = FACTS.image_times + 7

    def camera(self) -> None:
        return None

    def image_bytes(self, index: int) -> SimpleNamespace:
        return SimpleNamespace(width_px=640, height_px=480)

    def fingerprint(self) -> tuple[()]:
        return ()

    def radar_scans_around(self, times, half_window_s: float) -> RadarScans:
        return RadarScans()


def test_a_workspace_opened_again_has_the_earlier_clicks(tmp_path):
    for expected in ([], ["c1"]):
        workspace = open_workspace(BareRecording(), camera=None, session_folder=tmp_path / "s", name="drive")
        assert [click.id for click in workspace.restored.history.present.clicks] == expected
        workspace.dispatch(ClickPlaced(TIMES[3], (1.5, 2.5), "clicked"))
        workspace.close()


def test_a_recording_without_images_can_be_looked_at_and_stores_nothing_and_one_without_radar_too_is_refused(
    tmp_path,
):
    recording = BareRecording()
    recording.image_times = np.zeros(0, dtype=np.int64)
    facts = recording_facts(recording, "drive")
    assert not facts.has_images
    assert facts.moments.tolist() == recording.radar_times.tolist()
    workspace = open_workspace(recording, camera=None, session_folder=tmp_path / "s", name="drive")
    assert [one.code for one in workspace.view.warnings] == ["no-camera"]
    with pytest.raises(EventError, match="no frame of drive"):
        workspace.dispatch(ClickPlaced(TimeNs(int(recording.radar_times[0])), (1.0, 1.0), "clicked"))
    workspace.close()
    assert not (tmp_path / "s").exists()
    recording.radar_times = recording.image_times
    with pytest.raises(InputError, match="drive: has neither images nor radar scans"):
        recording_facts(recording, "drive")


def test_a_recording_that_grows_gets_frames_that_can_be_clicked(workspace, journal):
    later = FACTS.image_times[-1] + 100_000_000
    with pytest.raises(EventError):
        workspace.dispatch(ClickPlaced(TimeNs(int(later)), (1.0, 2.0), "clicked"))
    workspace.extend(np.append(FACTS.image_times, later), None)
    workspace.dispatch(ClickPlaced(TimeNs(int(later)), (1.0, 2.0), "clicked"))
    assert workspace.view.clicks[0].frame == len(FACTS.image_times)
    assert len(journal.steps) == 1


def test_clicks_are_solved_again_when_scans_of_their_windows_come(workspace, solver, journal):
    workspace.dispatch(CLICK)
    locating = workspace.session.options.locating
    last = TimeNs(TIMES[3] + round((locating.window_s / 2 + locating.max_time_gap_s) * NS_PER_S))
    workspace.extend(FACTS.image_times, TimeNs(last + 1))
    workspace.extend(FACTS.image_times, None)
    assert solver.revisions == [1]
    workspace.extend(FACTS.image_times, last)
    assert solver.revisions == [1, 2]
    assert [type(step).__name__ for step in journal.steps] == ["ClickPlaced"]
    workspace.dispatch(Undo())
    assert workspace.session.clicks == ()
