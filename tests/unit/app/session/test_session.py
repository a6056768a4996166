"""What events do to a session, and what undo and redo do to a history."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.errors import CalibrationError, OptionError
from calib_core.measurements import ChosenReturn, ReflectorClick, Stamp, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions, NoiseOptions
from cocalib.session import (
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    DismissedPlacement,
    EventError,
    History,
    OptionsChanged,
    PlacementDismissed,
    RecordingFacts,
    Redo,
    ReturnChosen,
    Session,
    Solved,
    Undo,
    WarningsAcknowledged,
    advance,
    apply,
    settled,
)
from tests.unit.app.session.drive import FACTS, START_NS, TIMES

NO_ANSWER = Unsolvable("too-few-pairs", "1 of at least 4 pairs", "click more")


def frame_time(index: int) -> TimeNs:
    return TIMES[index]


def placed(*frames: int) -> Session:
    session = Session()
    for frame in frames:
        session = apply(session, ClickPlaced(frame_time(frame), (10.0 + frame, 20.0), "clicked"), FACTS)
    return session


def history_of(*steps) -> History:
    history = History()
    for step in steps:
        history = advance(history, step, FACTS)
    return history


def test_a_placed_click_is_in_the_session_with_its_exact_stamp() -> None:
    session = placed(3)
    assert session.clicks == (ReflectorClick(frame_time(3), "c1", 13.0, 20.0),)
    assert session.revision == 1


def test_clicks_are_sorted_by_time_whatever_the_order_of_placing() -> None:
    assert [click.id for click in placed(7, 2, 5).clicks] == ["c2", "c3", "c1"]


def test_a_frame_may_have_several_marks() -> None:
    session = apply(placed(3), ClickPlaced(frame_time(3), (99.5, 88.25), "clicked"), FACTS)
    assert session.clicks == (
        ReflectorClick(frame_time(3), "c1", 13.0, 20.0),
        ReflectorClick(frame_time(3), "c2", 99.5, 88.25),
    )


def test_a_step_of_an_older_journal_moves_the_click_that_the_frame_has() -> None:
    session = apply(placed(3), ClickPlaced(frame_time(3), (99.5, 88.25), mark=None), FACTS)
    assert session.clicks == (ReflectorClick(frame_time(3), "c1", 99.5, 88.25),)
    assert session.next_click == 2


def test_marking_a_guess_again_at_its_pixel_makes_it_a_measurement() -> None:
    session = apply(Session(), ClickPlaced(frame_time(3), (13.0, 20.0), "untouched"), FACTS)
    assert not session.clicks[0].counts
    session = apply(session, ClickPlaced(frame_time(3), (13.0, 20.0), "clicked"), FACTS)
    assert session.clicks == (ReflectorClick(frame_time(3), "c1", 13.0, 20.0),)
    assert session.clicks[0].counts


def test_moving_a_guess_makes_it_a_measurement_and_a_move_to_its_own_pixel_does_not() -> None:
    session = apply(Session(), ClickPlaced(frame_time(3), (13.0, 20.0), "untouched"), FACTS)
    assert apply(session, ClickMoved("c1", (13.0, 20.0)), FACTS) is session
    moved = apply(session, ClickMoved("c1", (13.5, 20.0)), FACTS)
    assert moved.clicks[0].mark == "moved"
    assert moved.clicks[0].counts


def test_a_snapped_mark_has_its_own_sigma_and_loses_it_when_it_is_moved() -> None:
    session = apply(placed(3), ClickMoved("c1", (14.0, 21.0), "snapped", 0.3), FACTS)
    assert (session.clicks[0].mark, session.clicks[0].sigma_px) == ("snapped", 0.3)
    assert apply(session, ClickMoved("c1", (15.0, 21.0)), FACTS).clicks[0].sigma_px is None
    with pytest.raises(EventError, match="sigma_px"):
        apply(session, ClickMoved("c1", (15.0, 21.0), "snapped", -1.0), FACTS)


def test_a_chosen_return_belongs_to_the_click_until_it_is_taken_back() -> None:
    chosen = ChosenReturn((20.0, -0.9, 0.1), frame_time(3), "/radar")
    session = apply(placed(3), ReturnChosen("c1", chosen), FACTS)
    assert session.clicks[0].chosen == chosen
    assert session.revision == 2
    assert apply(session, ReturnChosen("c1", None), FACTS).clicks == placed(3).clicks
    with pytest.raises(EventError, match="not finite"):
        apply(session, ReturnChosen("c1", ChosenReturn((float("nan"), 0.0, 0.0))), FACTS)


def test_a_dismissed_placement_comes_back_by_undo_and_leaves_the_answer_valid() -> None:
    dismissed = PlacementDismissed(frame_time(3), (5.0, 0.0, 0.0))
    history = history_of(ClickPlaced(frame_time(1), (1.0, 1.0), "clicked"), Solved(1, NO_ANSWER), dismissed)
    assert history.present.dismissed == (DismissedPlacement(frame_time(3), (5.0, 0.0, 0.0)),)
    assert history.present.is_solved
    history = advance(history, Undo(), FACTS)
    assert history.present.dismissed == ()
    assert history.present.is_solved
    assert (
        apply(history.present, PlacementDismissed(frame_time(3), (5.0, 0.0, 0.0), dismissed=False), FACTS)
        is history.present
    )


def test_acknowledged_warnings_stay_so_when_clicks_are_undone() -> None:
    history = history_of(
        ClickPlaced(frame_time(1), (1.0, 1.0), "clicked"), WarningsAcknowledged(("few-pairs",)), Undo()
    )
    assert history.present.acknowledged == ("few-pairs",)
    shown = apply(history.present, WarningsAcknowledged(("few-pairs",), acknowledged=False), FACTS)
    assert shown.acknowledged == ()


def test_a_moved_click_is_where_it_was_moved_to() -> None:
    assert apply(placed(3), ClickMoved("c1", (1.5, 2.5)), FACTS).clicks[0] == ReflectorClick(
        frame_time(3), "c1", 1.5, 2.5, mark="moved"
    )


def test_a_removed_click_is_gone_and_its_id_is_not_given_again() -> None:
    session = apply(placed(3, 4), ClickRemoved("c2"), FACTS)
    session = apply(session, ClickPlaced(frame_time(9), (1.0, 1.0), "clicked"), FACTS)
    assert [click.id for click in session.clicks] == ["c1", "c3"]


def test_an_id_that_was_undone_is_not_given_again() -> None:
    history = history_of(
        ClickPlaced(frame_time(1), (1.0, 1.0), "clicked"),
        Undo(),
        ClickPlaced(frame_time(2), (1.0, 1.0), "clicked"),
        ClickPlaced(frame_time(3), (1.0, 1.0), "clicked"),
    )
    assert [click.id for click in history.present.clicks] == ["c2", "c3"]


def test_an_excluded_click_stays_and_can_be_included_again() -> None:
    excluded = apply(placed(3), ClickExcluded("c1", True), FACTS)
    assert excluded.clicks[0].excluded
    assert apply(excluded, ClickExcluded("c1", False), FACTS).clicks == placed(3).clicks


def test_clearing_removes_the_clicks_and_the_answer_and_keeps_the_options() -> None:
    options = CalibrationOptions(method="paper")
    session = apply(apply(placed(3), OptionsChanged.of(options), FACTS), Solved(2, NO_ANSWER), FACTS)
    cleared = apply(session, Cleared(), FACTS)
    assert (cleared.clicks, cleared.outcome, cleared.options) == ((), None, options)


@pytest.mark.parametrize(
    "event",
    [
        ClickPlaced(frame_time(3), (13.0, 20.0), "clicked"),
        ClickMoved("c1", (13.0, 20.0)),
        ClickExcluded("c1", False),
        OptionsChanged.of(CalibrationOptions()),
        ClicksImported.of(()),
        Solved(7, NO_ANSWER),
    ],
)
def test_an_event_that_changes_nothing_returns_the_same_session_object(event) -> None:
    session = placed(3)
    assert apply(session, event, FACTS) is session
    history = History(session)
    assert advance(history, event, FACTS) is history


@pytest.mark.parametrize(
    ("event", "words"),
    [
        (
            ClickPlaced(TimeNs(START_NS + 1), (1.0, 1.0), "clicked"),
            "no frame of drive has the stamp 1700000000.123456790 s",
        ),
        (ClickPlaced(TimeNs(START_NS - 1), (1.0, 1.0), "clicked"), "no frame"),
        (ClickPlaced(TimeNs(START_NS + 10**12), (1.0, 1.0), "clicked"), "no frame"),
        (ClickPlaced(frame_time(0), (639.6, 1.0), "clicked"), "(639.6, 1.0) px is outside the frame of 640 x 480 px"),
        (ClickPlaced(frame_time(0), (1.0, -0.6), "clicked"), "outside the frame"),
        (ClickPlaced(frame_time(0), (float("nan"), 1.0), "clicked"), "outside the frame"),
        (ClickMoved("c1", (float("inf"), 1.0)), "outside the frame"),
        (ClickMoved("c9", (1.0, 1.0)), "there is no click 'c9'"),
        (ClickRemoved("c9"), "there is no click 'c9'"),
        (ClickExcluded("c9", True), "there is no click 'c9'"),
        (ClicksImported.of((ReflectorClick(TimeNs(5), "a", 1.0, 1.0),)), "no frame"),
        (
            ClicksImported.of((ReflectorClick(frame_time(0), "a", 1.0, 1.0, sigma_px=0.0),)),
            "click 'a' has a sigma_px of 0",
        ),
    ],
)
def test_an_event_that_does_not_fit_is_refused_with_a_clear_error(event, words: str) -> None:
    with pytest.raises(EventError) as refused:
        apply(placed(3), event, FACTS)
    assert words in str(refused.value)
    assert isinstance(refused.value, CalibrationError)


@pytest.mark.parametrize(("u_px", "v_px"), [(-0.5, -0.5), (639.5, 479.5), (0.0, 0.0)])
def test_the_frame_reaches_half_a_pixel_beyond_its_outermost_pixel_centres(u_px: float, v_px: float) -> None:
    assert apply(Session(), ClickPlaced(frame_time(0), (u_px, v_px), "clicked"), FACTS).clicks[0].u_px == u_px


def test_imported_clicks_are_added_and_replace_those_in_the_same_frames() -> None:
    click = ReflectorClick(frame_time(4), "p1", 5.0, 5.0, sigma_px=0.5, excluded=True)
    session = apply(placed(3, 4), ClicksImported.of((click,)), FACTS)
    assert session.clicks == (placed(3).clicks[0], click)


def test_imported_ids_are_kept_and_never_given_again() -> None:
    session = apply(Session(), ClicksImported.of((ReflectorClick(frame_time(4), "c7", 5.0, 5.0),)), FACTS)
    session = apply(session, ClickPlaced(frame_time(5), (1.0, 1.0), "clicked"), FACTS)
    assert [click.id for click in session.clicks] == ["c7", "c8"]


def test_an_imported_id_that_another_frame_has_already_is_replaced_by_a_new_one() -> None:
    session = apply(placed(3), ClicksImported.of((ReflectorClick(frame_time(4), "c1", 5.0, 5.0),)), FACTS)
    assert [click.id for click in session.clicks] == ["c1", "c2"]
    assert session.next_click == 3


def test_options_out_of_range_are_refused_and_the_session_stays() -> None:
    wrong = CalibrationOptions(noise=NoiseOptions(sigma_px=float("nan")))
    with pytest.raises(OptionError, match=r"noise\.sigma_px"):
        apply(placed(3), OptionsChanged.of(wrong), FACTS)


def test_edited_options_change_only_what_they_name() -> None:
    event = OptionsChanged({"noise": {"sigma_px": 3.5}})
    session = apply(placed(3), event, FACTS)
    assert session.options == replace(CalibrationOptions(), noise=replace(NoiseOptions(), sigma_px=3.5))
    assert settled(event, placed(3)) == OptionsChanged.of(session.options)


def test_an_answer_to_the_current_revision_is_kept() -> None:
    session = apply(placed(3), Solved(1, NO_ANSWER), FACTS)
    assert session.outcome is NO_ANSWER
    assert session.is_solved
    assert not session.needs_solving


def test_an_answer_stays_shown_while_a_newer_one_is_computed() -> None:
    session = apply(apply(placed(3), Solved(1, NO_ANSWER), FACTS), ClickMoved("c1", (1.0, 1.0)), FACTS)
    assert session.outcome is NO_ANSWER
    assert session.needs_solving


def test_an_answer_to_an_older_revision_changes_nothing() -> None:
    session = placed(3, 4)
    assert apply(session, Solved(1, NO_ANSWER), FACTS) is session


def test_an_answer_is_no_step_that_can_be_undone() -> None:
    history = history_of(ClickPlaced(frame_time(1), (1.0, 1.0), "clicked"), Solved(1, NO_ANSWER))
    assert len(history.past) == 1
    assert history.present.outcome is NO_ANSWER


def test_undo_reverts_the_last_change_and_redo_repeats_it() -> None:
    history = history_of(ClickPlaced(frame_time(1), (1.0, 1.0), "clicked"), ClickMoved("c1", (2.0, 2.0)))
    undone = advance(history, Undo(), FACTS)
    assert undone.present.clicks[0].u_px == 1.0
    assert advance(undone, Redo(), FACTS).present.clicks == history.present.clicks


def test_undo_and_redo_with_nothing_to_do_return_the_same_history_object() -> None:
    history = History()
    assert advance(history, Undo(), FACTS) is history
    assert advance(history, Redo(), FACTS) is history


def test_a_new_change_drops_what_was_undone() -> None:
    history = history_of(
        ClickPlaced(frame_time(1), (1.0, 1.0), "clicked"), Undo(), ClickPlaced(frame_time(2), (1.0, 1.0), "clicked")
    )
    assert advance(history, Redo(), FACTS) is history


def test_undo_brings_the_old_answer_back_without_asking_again() -> None:
    history = history_of(
        ClickPlaced(frame_time(1), (1.0, 1.0), "clicked"), Solved(1, NO_ANSWER), ClickMoved("c1", (2.0, 2.0)), Undo()
    )
    assert history.present.is_solved
    assert history.present.outcome is NO_ANSWER


def test_undo_to_a_state_that_was_never_answered_asks_again() -> None:
    history = history_of(ClickPlaced(frame_time(1), (1.0, 1.0), "clicked"), ClickMoved("c1", (2.0, 2.0)), Undo())
    assert history.present.needs_solving


def test_an_answer_pending_during_undo_is_not_applied_to_another_state() -> None:
    history = history_of(
        ClickPlaced(frame_time(1), (1.0, 1.0), "clicked"), ClickPlaced(frame_time(2), (1.0, 1.0), "clicked")
    )
    revision = history.present.revision
    history = advance(history, Undo(), FACTS)
    history = advance(history, ClickPlaced(frame_time(3), (9.0, 9.0), "clicked"), FACTS)
    assert advance(history, Solved(revision, NO_ANSWER), FACTS) is history


def test_a_stamp_keeps_every_nanosecond() -> None:
    assert Stamp.of(TimeNs(START_NS)) == Stamp(1_700_000_000, 123_456_789)
    assert Stamp.of(TimeNs(START_NS)).time == START_NS


def test_a_frame_is_found_by_its_exact_stamp_only() -> None:
    assert FACTS.frame_at(frame_time(49)) == 49
    assert FACTS.frame_at(TimeNs(START_NS + 1)) is None
    assert RecordingFacts("empty", np.zeros(0, dtype=np.int64), 1, 1).frame_at(TimeNs(0)) is None
