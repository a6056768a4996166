"""Undo and redo as steps like any other, so that working and replaying a journal use the same function."""

from dataclasses import dataclass, field, replace

from cocalib.option_changes import changed_options, changes_from_tree
from cocalib.session.applying import apply
from cocalib.session.events import (
    AssumptionsConfirmed,
    ColumnsMapped,
    OptionsChanged,
    Redo,
    ScansAdded,
    Solved,
    Step,
    Undo,
    WarningsAcknowledged,
)
from cocalib.session.state import RecordingFacts, Session


@dataclass(frozen=True, slots=True)
class History:
    """The current session, with those before it (undo) and those undone (redo), nearest last."""

    present: Session = field(default_factory=Session)
    past: tuple[Session, ...] = ()
    future: tuple[Session, ...] = ()


def advance(history: History, step: Step, facts: RecordingFacts) -> History:
    """Apply one step; a step that changes nothing returns the same History object.

    Raises:
        EventError: the event does not fit the session or the recording.
        OptionError: an option is unknown or out of range.
    """
    if isinstance(step, Undo):
        return _undone(history)
    if isinstance(step, Redo):
        return _redone(history)
    present = apply(history.present, step, facts)
    if present is history.present:
        return history
    if isinstance(step, Solved | ScansAdded | ColumnsMapped | AssumptionsConfirmed | WarningsAcknowledged):
        return replace(history, present=present)
    return History(present, (*history.past, history.present))


def settled(step: Step, session: Session) -> Step:
    """Turn a change of some options into the full set of options, so that the journalled step does not depend on earlier ones.

    Raises:
        OptionError: an option is unknown, of the wrong type or out of range.
    """
    if isinstance(step, OptionsChanged):
        return OptionsChanged.of(changed_options(session.options, changes_from_tree(step.options)))
    return step


def _undone(history: History) -> History:
    if not history.past:
        return history
    *past, before = history.past
    return History(_resumed(before, history.present), tuple(past), (*history.future, history.present))


def _redone(history: History) -> History:
    if not history.future:
        return history
    *future, after = history.future
    return History(_resumed(after, history.present), (*history.past, history.present), tuple(future))


def _resumed(kept: Session, current: Session) -> Session:
    """Return to a kept session under a new revision, so that no pending answer can be mistaken for an answer to this."""
    revision = current.revision + 1
    return replace(
        kept,
        revision=revision,
        next_click=current.next_click,
        next_box=current.next_box,
        outcome_revision=revision if kept.is_solved else kept.outcome_revision,
        column_map=current.column_map,
        confirmed=current.confirmed,
        acknowledged=current.acknowledged,
    )
