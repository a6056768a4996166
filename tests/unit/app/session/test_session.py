"""What events do to a session, and what undo and redo do to a history."""

from dataclasses import replace
from functools import reduce

import numpy as np
import pytest
from msgspec.structs import replace as replaced

from calib_core.camera import Camera, CameraCovariance
from calib_core.errors import CalibrationError, OptionError
from calib_core.measurements import ChosenReturn, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions, NoiseOptions
from cocalib.session.applying import EventError, History, advance, apply, settled
from cocalib.session.events import (
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    IntrinsicsChosen,
    MarksReviewed,
    OptionsChanged,
    PlacementDismissed,
    Redo,
    ReturnChosen,
    Solved,
    Undo,
    WarningsAcknowledged,
)
from cocalib.session.state import ChosenIntrinsics, DismissedPlacement, RecordingFacts, Session
from tests.unit.app.session.drive import FACTS, START_NS, TIMES, place

NO_ANSWER = Unsolvable.reported("too-few-pairs", "1 of at least 4 pairs", "click more")
PLACED = ReflectorClick(TIMES[3], "c1", 3.0, 1.0)
GUESSED = ClickPlaced(TIMES[3], (3.0, 1.0), "untouched")
CAMERA = Camera(
    "plumb_bob",
    640,
    480,
    np.array([[500.25, 0.0, 320.0], [0.0, 501.0, 239.1], [0.0, 0.0, 1.0]]),
    np.array([-0.1, 0.01, 0.0, 1e-4]),
    CameraCovariance(("fx_px", "k1"), np.array([[0.25, 1e-4], [1e-4, 1e-6]])),
)
CHOSEN = ChosenIntrinsics.of(CAMERA, "the board in this recording, 24 views")


def session_of(*events) -> Session:
    return reduce(lambda session, event: apply(session, event, FACTS), events, Session())


def history_of(*steps) -> History:
    return reduce(lambda history, step: advance(history, step, FACTS), steps, History())


def imported(frame: int, name: str, **more) -> ClicksImported:
    return ClicksImported.of((ReflectorClick(TIMES[frame], name, 5.0, 5.0, **more),))


def ids(session: Session) -> list[str]:
    return [click.id for click in session.clicks]


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        ((place(3),), PLACED),
        ((GUESSED, place(3)), PLACED),
        ((GUESSED, ClickMoved("c1", (3.5, 1.0))), replace(PLACED, u_px=3.5, mark="moved")),
        ((place(3), ClickMoved("c1", (1.5, 2.5))), replace(PLACED, u_px=1.5, v_px=2.5, mark="moved")),
        ((place(3), ClickExcluded("c1", True)), replace(PLACED, excluded=True)),
        ((place(3), ClickExcluded("c1", True), ClickExcluded("c1", False)), PLACED),
        ((place(3), imported(3, "p1", sigma_px=0.5)), ReflectorClick(TIMES[3], "p1", 5.0, 5.0, sigma_px=0.5)),
    ],
    ids=["placed", "guess marked", "guess moved", "moved", "excluded", "included", "imported"],
)
def test_a_frames_only_click_is_what_the_last_event_made_it(events, expected):
    session = session_of(*events)
    assert session.clicks == (expected,)
    assert session.clicks[0].counts is not expected.excluded
    assert session.next_click == 2
    assert not session_of(GUESSED).clicks[0].counts


def test_a_frame_may_have_several_marks_and_imported_clicks_replace_those_of_their_frames_only():
    session = session_of(place(3), ClickPlaced(TIMES[3], (99.5, 88.25), "clicked"), place(4))
    assert [(click.id, click.u_px) for click in session.clicks] == [("c1", 3.0), ("c2", 99.5), ("c3", 4.0)]
    assert ids(apply(session, imported(4, "p1"), FACTS)) == ["c1", "c2", "p1"]
    for corner in ((-0.5, -0.5), (639.5, 479.5)):  # half a pixel beyond the outermost pixels' centres
        assert session_of(ClickPlaced(TIMES[0], corner, "clicked")).clicks[0].u_px == corner[0]
    assert FACTS.frame_at(TIMES[49]) == 49
    assert FACTS.frame_at(TimeNs(START_NS + 1)) is None, "only by its exact stamp"
    assert RecordingFacts("empty", np.zeros(0, dtype=np.int64), 1, 1).frame_at(TimeNs(0)) is None


def test_a_snapped_mark_has_its_own_sigma_and_loses_it_when_it_is_moved():
    session = session_of(place(3), ClickMoved("c1", (14.0, 21.0), "snapped", 0.3))
    assert (session.clicks[0].mark, session.clicks[0].sigma_px) == ("snapped", 0.3)
    assert apply(session, ClickMoved("c1", (15.0, 21.0)), FACTS).clicks[0].sigma_px is None


def test_a_chosen_return_belongs_to_the_click_until_it_is_taken_back():
    chosen = ChosenReturn((20.0, -0.9, 0.1), TIMES[3], "/radar")
    session = session_of(place(3), ReturnChosen("c1", chosen))
    assert (session.clicks[0].chosen, session.revision) == (chosen, 2)
    assert apply(session, ReturnChosen("c1", None), FACTS).clicks == (PLACED,)


def test_a_dismissed_placement_comes_back_by_undo_and_leaves_the_answer_valid():
    dismissed = PlacementDismissed(TIMES[3], (5.0, 0.0, 0.0))
    history = history_of(place(1), Solved(1, NO_ANSWER), dismissed)
    assert history.present.dismissed == (DismissedPlacement(TIMES[3], (5.0, 0.0, 0.0)),)
    assert history.present.is_solved
    present = advance(history, Undo(), FACTS).present
    assert (present.dismissed, present.is_solved) == ((), True)
    assert apply(present, PlacementDismissed(TIMES[3], (5.0, 0.0, 0.0), dismissed=False), FACTS) is present


def test_a_mark_is_reviewed_until_it_changes_and_the_answer_stays():
    reviewed = history_of(place(1), place(2), MarksReviewed(("c1", "c2", "c9")))
    assert set(reviewed.present.reviewed) == {"c1", "c2"}
    assert reviewed.present.revision == history_of(place(1), place(2)).present.revision
    assert advance(reviewed, MarksReviewed(("c1",)), FACTS) is reviewed
    assert advance(reviewed, MarksReviewed(("c1",), reviewed=False), FACTS).present.reviewed == ("c2",)
    moved = advance(reviewed, ClickMoved("c1", (30.0, 40.0)), FACTS)
    assert moved.present.reviewed == ("c2",)
    assert set(advance(moved, Undo(), FACTS).present.reviewed) == {"c1", "c2"}
    assert advance(advance(moved, Undo(), FACTS), Undo(), FACTS).present.reviewed == ()


def test_acknowledged_warnings_stay_so_when_clicks_are_undone():
    present = history_of(place(1), WarningsAcknowledged(("few-pairs",)), Undo()).present
    assert present.acknowledged == ("few-pairs",)
    assert apply(present, WarningsAcknowledged(("few-pairs",), acknowledged=False), FACTS).acknowledged == ()


@pytest.mark.parametrize(
    ("steps", "expected"),
    [
        ((place(3), place(4), ClickRemoved("c2"), place(9)), ["c1", "c3"]),
        ((place(1), Undo(), place(2), place(3)), ["c2", "c3"]),
        ((imported(4, "c7"), place(5)), ["c7", "c8"]),
        ((place(3), imported(4, "c1"), place(5)), ["c1", "c2", "c3"]),
    ],
    ids=["removed", "undone", "imported", "imported a second time"],
)
def test_an_id_is_not_given_again(steps, expected):
    assert ids(history_of(*steps).present) == expected


def test_clearing_removes_the_clicks_and_the_answer_and_keeps_the_options():
    options = CalibrationOptions(method="paper")
    cleared = session_of(place(3), OptionsChanged.of(options), Solved(2, NO_ANSWER), Cleared())
    assert (cleared.clicks, cleared.outcome, cleared.options) == ((), None, options)


@pytest.mark.parametrize(
    "event",
    [
        place(3),
        ClickMoved("c1", (3.0, 1.0)),
        ClickExcluded("c1", False),
        OptionsChanged.of(CalibrationOptions()),
        ClicksImported.of(()),
        Solved(7, NO_ANSWER),
        IntrinsicsChosen(CHOSEN),
        Redo(),
    ],
    ids=lambda event: type(event).__name__,
)
def test_an_event_that_changes_nothing_returns_the_same_objects(event):
    history = history_of(IntrinsicsChosen(CHOSEN), place(3))
    assert advance(history, event, FACTS) is history
    assert isinstance(event, Redo) or apply(history.present, event, FACTS) is history.present


@pytest.mark.parametrize(
    ("event", "words"),
    [
        (replaced(place(3), image_time=TimeNs(START_NS + 1)), "no frame of drive has the stamp 1700000000.123456790 s"),
        (replaced(place(3), image_time=TimeNs(START_NS - 1)), "no frame"),
        (replaced(place(3), image_time=TimeNs(START_NS + 10**12)), "no frame"),
        (replaced(place(0), pixel_px=(639.6, 1.0)), "(639.6, 1.0) px is outside the frame of 640 x 480 px"),
        (replaced(place(0), pixel_px=(1.0, -0.6)), "outside the frame"),
        (replaced(place(0), pixel_px=(float("nan"), 1.0)), "outside the frame"),
        (ClickMoved("c1", (float("inf"), 1.0)), "outside the frame"),
        (ClickMoved("c1", (15.0, 21.0), "snapped", -1.0), "sigma_px"),
        (ReturnChosen("c1", ChosenReturn((float("nan"), 0.0, 0.0))), "not finite"),
        (ClickMoved("c9", (1.0, 1.0)), "there is no click 'c9'"),
        (ClickRemoved("c9"), "there is no click 'c9'"),
        (ClickExcluded("c9", True), "there is no click 'c9'"),
        (ClicksImported.of((ReflectorClick(TimeNs(5), "a", 1.0, 1.0),)), "no frame"),
        (imported(0, "a", sigma_px=0.0), "click 'a' has a sigma_px of 0"),
        (IntrinsicsChosen(replaced(CHOSEN, size_px=(800, 600))), "800 x 600 px, but the frames have 640 x 480"),
        (IntrinsicsChosen(replaced(CHOSEN, model="mirror")), "unknown camera model"),
        (IntrinsicsChosen(replaced(CHOSEN, distortion=(1.0,))), "distortion coefficients"),
    ],
)
def test_an_event_that_does_not_fit_is_refused_with_a_clear_error(event, words):
    with pytest.raises(EventError) as refused:
        apply(session_of(place(3)), event, FACTS)
    assert words in str(refused.value)
    assert isinstance(refused.value, CalibrationError)


def test_edited_options_change_only_what_they_name_and_none_out_of_range():
    event = OptionsChanged({"noise": {"sigma_px": 3.5}})
    session = session_of(place(3), event)
    assert session.options == CalibrationOptions(noise=NoiseOptions(sigma_px=3.5))
    assert settled(event, session_of(place(3))) == OptionsChanged.of(session.options)
    with pytest.raises(OptionError, match=r"noise\.sigma_px"):
        session_of(OptionsChanged.of(CalibrationOptions(noise=NoiseOptions(sigma_px=float("nan")))))


def test_an_answer_stays_shown_while_a_newer_one_is_computed():
    session = session_of(place(3), Solved(1, NO_ANSWER))
    assert (session.outcome, session.is_solved, session.needs_solving) == (NO_ANSWER, True, False)
    session = apply(session, ClickMoved("c1", (1.0, 1.0)), FACTS)
    assert (session.outcome, session.is_solved, session.needs_solving) == (NO_ANSWER, False, True)


def test_undo_reverts_the_last_change_and_redo_repeats_it_until_another_change():
    start = history_of(place(1), ClickMoved("c1", (2.0, 2.0)))
    undone = advance(start, Undo(), FACTS)
    assert undone.present.clicks[0].u_px == 1.0
    assert undone.present.needs_solving, "that state was never answered"
    assert advance(undone, Redo(), FACTS).present.clicks == start.present.clicks
    changed = advance(undone, place(2), FACTS)
    assert advance(changed, Redo(), FACTS) is changed
    assert advance(History(), Undo(), FACTS) == History()


def test_an_answer_is_no_step_and_undo_brings_the_old_one_back_without_asking_again():
    history = history_of(place(1), Solved(1, NO_ANSWER))
    assert (len(history.past), history.present.outcome) == (1, NO_ANSWER)
    present = history_of(place(1), Solved(1, NO_ANSWER), ClickMoved("c1", (2.0, 2.0)), Undo()).present
    assert (present.outcome, present.is_solved) == (NO_ANSWER, True)


def test_chosen_intrinsics_are_solved_with_undone_and_redone_and_have_all_numbers_of_their_camera():
    chosen = advance(History(), IntrinsicsChosen(CHOSEN), FACTS)
    assert (chosen.present.intrinsics, chosen.present.revision) == (CHOSEN, 1)
    undone = advance(chosen, Undo(), FACTS)
    assert undone.present.intrinsics is None
    assert advance(undone, Redo(), FACTS).present.intrinsics == CHOSEN
    camera = CHOSEN.camera
    assert (camera.model, camera.width_px, camera.height_px) == ("plumb_bob", 640, 480)
    np.testing.assert_array_equal(camera.parameters, CAMERA.parameters)
    assert ChosenIntrinsics.of(camera, CHOSEN.about) == CHOSEN
