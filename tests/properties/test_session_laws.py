"""Laws of the session under any sequence of steps: undo, replay, one click per frame, no stale answer, no loss by a kill."""

import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from calib_core.errors import CalibrationError
from calib_core.measurements import ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions
from cocalib.session.applying import History, advance, settled
from cocalib.session.events import (
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    OptionsChanged,
    Redo,
    Solved,
    Step,
    Undo,
)
from cocalib.session.file.session_file import open_session_file
from cocalib.session.state import RecordingFacts, Session
from cocalib.view.build import view
from cocalib.view.model import View
from cocalib.workspace import Workspace

FACTS = RecordingFacts("drive", 1_700_000_000_123_456_789 + 33_333_333 * np.arange(8), width_px=64, height_px=48)

frames = st.sampled_from([TimeNs(int(time)) for time in FACTS.image_times])
columns = st.floats(-0.5, 63.5)
rows = st.floats(-0.5, 47.5)
ids = st.integers(1, 12).map(lambda number: f"c{number}")
option_edits = st.one_of(
    st.floats(0.01, 1000.0).map(lambda sigma_px: {"noise": {"sigma_px": sigma_px}}),
    st.sampled_from(["default", "paper"]).map(lambda method: {"method": method}),
)
clicks_of_files = st.lists(
    st.builds(ReflectorClick, frames, st.one_of(ids, st.sampled_from(["p1", "c0", "c007", "č"])), columns, rows),
    max_size=4,
    unique_by=(lambda click: click.image_time, lambda click: click.id),
).map(tuple)
steps = st.one_of(
    st.builds(ClickPlaced, frames, st.tuples(columns, rows), st.just("clicked")),
    st.builds(ClickMoved, ids, st.tuples(columns, rows)),
    st.builds(ClickRemoved, ids),
    st.builds(ClickExcluded, ids, st.booleans()),
    st.builds(OptionsChanged, option_edits),
    st.builds(Cleared),
    st.builds(ClicksImported.of, clicks_of_files),
    st.builds(Undo),
    st.builds(Redo),
)


def bare(session: Session) -> Session:
    """The session without its answer, which is worked out again and not kept."""
    return replace(session, outcome=None, outcome_revision=-1)


def bare_history(history: History) -> History:
    return History(
        bare(history.present), tuple(bare(session) for session in history.past), tuple(map(bare, history.future))
    )


def answer_to(clicks: Sequence[ReflectorClick], options: CalibrationOptions) -> Unsolvable:
    """Return an answer that states its clicks and options."""
    return Unsolvable.reported("test", repr((tuple(clicks), options)), "")


class HeldSolver:
    """Keeps every request and answers on demand, however late."""

    def __init__(self) -> None:
        self.requests: list[tuple[int, Unsolvable, Callable[[Solved], None]]] = []

    def request(self, revision: int, clicks, options, when_done, camera=None) -> None:
        self.requests.append((revision, answer_to(clicks, options), when_done))

    def answer(self, index: int) -> None:
        revision, outcome, when_done = self.requests[index % len(self.requests)]
        when_done(Solved(revision, outcome))

    def close(self) -> None:
        """There is nothing to stop."""


def kept_of(session: Session) -> tuple[object, ...]:
    """What the user decided, without the answer and the counters."""
    return (session.clicks, session.options)


class SessionLaws(RuleBasedStateMachine):
    """Random steps, answers, refusals and restarts."""

    @initialize()
    def open(self) -> None:
        self.folder = Path(tempfile.mkdtemp())
        self.views: list[View] = []
        self._open()

    def _open(self) -> None:
        self.solver = HeldSolver()
        session_file = open_session_file(self.folder, FACTS)
        self.workspace = Workspace(FACTS, session_file.restored, session_file, self.solver)
        self.workspace.subscribe(self.views.append)

    def teardown(self) -> None:
        self.workspace.close()
        shutil.rmtree(self.folder)

    @rule(step=steps)
    def take(self, step: Step) -> None:
        before = self.workspace.history
        try:
            self.workspace.dispatch(step)
        except CalibrationError:
            assert self.workspace.history is before

    @precondition(lambda self: self.solver.requests)
    @rule(index=st.integers(0, 50))
    def answer_some_request(self, index: int) -> None:
        self.solver.answer(-1 - index)

    @rule()
    def restart(self) -> None:
        history = self.workspace.history
        self.workspace.close()
        self._open()
        assert bare_history(self.workspace.history) == bare_history(history)

    @rule()
    def undo_then_redo_changes_nothing(self) -> None:
        before = self.workspace.history
        if before.past:
            self.workspace.dispatch(Undo())
            self.workspace.dispatch(Redo())
        after = self.workspace.history
        assert kept_of(after.present) == kept_of(before.present)
        assert after.present.is_solved == before.present.is_solved
        assert len(after.past) == len(before.past)

    @invariant()
    def the_screen_shows_the_session(self) -> None:
        assert self.views[-1] == self.workspace.view == view(self.workspace.history, FACTS)

    @invariant()
    def clicks_are_in_order_of_time(self) -> None:
        clicks = self.workspace.session.clicks
        assert [click.image_time for click in clicks] == sorted(click.image_time for click in clicks)

    @invariant()
    def no_two_clicks_have_one_id_and_the_next_id_is_new(self) -> None:
        names = [click.id for click in self.workspace.session.clicks]
        assert len(set(names)) == len(names)
        assert f"c{self.workspace.session.next_click}" not in names

    @invariant()
    def an_answer_belongs_to_the_clicks_and_options_it_is_shown_with(self) -> None:
        for session in (self.workspace.session, *self.workspace.history.past, *self.workspace.history.future):
            assert not session.is_solved or session.outcome == answer_to(session.clicks, session.options)

    @invariant()
    def revisions_only_grow(self) -> None:
        revisions = [shown.revision for shown in self.views]
        assert revisions == sorted(revisions)


TestSessionLaws = SessionLaws.TestCase
TestSessionLaws.settings = settings(max_examples=25, stateful_step_count=25, deadline=None)


def lived(taken: Sequence[Step]) -> list[tuple[Step, History]]:
    """Return the steps that changed something, as journalled, each with what it led to."""
    history, kept = History(), []
    for step in taken:
        try:
            step = settled(step, history.present)
            after = advance(history, step, FACTS)
        except CalibrationError:
            continue
        if after is not history:
            history = after
            kept.append((step, history))
    return kept


@settings(max_examples=30, deadline=None)
@given(taken=st.lists(steps, max_size=12), share=st.floats(0.0, 1.0))
def test_a_journal_cut_at_any_byte_gives_the_last_confirmed_session_back(taken, share):
    kept = lived(taken)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        session_file = open_session_file(folder, FACTS)
        for step, history in kept:
            session_file.append(step, history)
        session_file.close()
        (folder / "journal-copy.jsonl").unlink()  # it would know of steps beyond the cut
        journal = folder / "journal.jsonl"
        whole = journal.read_bytes()
        first = whole.index(b"\n") + 1
        cut = first + round(share * (len(whole) - first))
        journal.write_bytes(whole[:cut])
        confirmed = whole[:cut].count(b"\n") - 1
        again = open_session_file(folder, FACTS)
        assert again.restored.history == (kept[confirmed - 1][1] if confirmed else History())
        assert (again.restored.torn_bytes > 0) == (not whole[:cut].endswith(b"\n"))
        again.close()
        assert whole.startswith(journal.read_bytes())
