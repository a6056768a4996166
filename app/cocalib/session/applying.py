"""How each event changes the session: `apply`, one rule per event, and its checks; `advance` with undo and redo as steps."""

import math
from dataclasses import dataclass, field, replace
from functools import singledispatch
from typing import TypeAlias

from calib_core.errors import CalibrationError
from calib_core.interchange.own.clicks_json import click_of
from calib_core.measurements import Mark, ReflectorClick, TimeNs, time_parts
from cocalib.option_changes import changed_options, changes_from_tree
from cocalib.session.click_stamps import nearest_frame
from cocalib.session.events import (
    AssumptionsConfirmed,
    AxesStated,
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    ColumnsMapped,
    IntrinsicsChosen,
    MarksReviewed,
    OptionsChanged,
    PlacementDismissed,
    Redo,
    ReturnChosen,
    ScansAdded,
    Solved,
    Step,
    Undo,
    WarningsAcknowledged,
)
from cocalib.session.state import ChosenIntrinsics, DismissedPlacement, RecordingFacts, Session

_Aside: TypeAlias = ColumnsMapped | AssumptionsConfirmed | WarningsAcknowledged | PlacementDismissed | MarksReviewed
"""Events that no pose depends on."""


def apply(session: Session, event: Step, facts: RecordingFacts) -> Session:
    """Return the session after an event; the same object if the event changes nothing.

    Raises:
        EventError: the event does not fit the session or the recording.
        OptionError: an option is unknown or out of range.
    """
    if isinstance(event, Solved):
        if event.revision != session.revision:
            return session
        return replace(session, outcome=event.outcome, outcome_revision=event.revision, checked=event.checked)
    if isinstance(event, AxesStated):
        return session
    if isinstance(event, ScansAdded):
        return replace(session, revision=session.revision + 1)
    if isinstance(event, _Aside):
        return _keep_answer(event, session)
    changed = _apply_event(event, session, facts)
    if (changed.clicks, changed.options, changed.intrinsics) == (session.clicks, session.options, session.intrinsics):
        return session
    unchanged = {click.id for click in changed.clicks if click in session.clicks}
    reviewed = tuple(one for one in changed.reviewed if one in unchanged)
    return replace(changed, reviewed=reviewed, revision=session.revision + 1)


def _keep_answer(event: _Aside, session: Session) -> Session:
    """Return the session after an event that no pose depends on; answers in progress stay valid."""
    if isinstance(event, WarningsAcknowledged):
        return _acknowledged(event, session)
    if isinstance(event, PlacementDismissed):
        return _dismissed(event, session)
    if isinstance(event, MarksReviewed):
        others = tuple(one for one in session.reviewed if one not in event.ids)
        known = tuple(click.id for click in session.clicks if click.id in event.ids)
        reviewed = (*others, *known) if event.reviewed else others
        return session if set(reviewed) == set(session.reviewed) else replace(session, reviewed=reviewed)
    if isinstance(event, ColumnsMapped):
        return session if event.column_map == session.column_map else replace(session, column_map=event.column_map)
    confirmed = tuple(dict.fromkeys((*session.confirmed, *event.texts)))
    return session if confirmed == session.confirmed else replace(session, confirmed=confirmed)


def _acknowledged(event: WarningsAcknowledged, session: Session) -> Session:
    """Return the session with warnings folded away or shown again; answers in progress stay valid."""
    others = tuple(code for code in session.acknowledged if code not in event.codes)
    codes = tuple(dict.fromkeys((*session.acknowledged, *event.codes))) if event.acknowledged else others
    return session if codes == session.acknowledged else replace(session, acknowledged=codes)


def _dismissed(event: PlacementDismissed, session: Session) -> Session:
    """Return the session with a placement dismissed or offered again; answers in progress stay valid."""
    if not all(map(math.isfinite, event.position_m)):
        raise EventError("the position of the placement is not finite; give it in metres")
    placement = DismissedPlacement(event.time, event.position_m)
    others = tuple(one for one in session.dismissed if one != placement)
    dismissed = (*others, placement) if event.dismissed else others
    return session if set(dismissed) == set(session.dismissed) else replace(session, dismissed=dismissed)


@singledispatch
def _apply_event(event: Step, session: Session, facts: RecordingFacts) -> Session:
    """Return the session with the event applied; `apply` increments the revision."""
    raise TypeError(f"not an event of the session: {event!r}")


@_apply_event.register
def _placed(event: ClickPlaced, session: Session, facts: RecordingFacts) -> Session:
    _require_frame(event.image_time, facts)
    u_px, v_px = _require_pixel(event.pixel_px, facts)
    for click in session.clicks:
        if click.image_time == event.image_time and (click.u_px, click.v_px) == event.pixel_px:
            return _with_click(session, _marked_click(click, event.mark, event.sigma_px))
    click = ReflectorClick(
        event.image_time,
        f"c{session.next_click}",
        u_px,
        v_px,
        sigma_px=event.sigma_px,
        mark=event.mark,
    )
    _require_sigma(click)
    return replace(_with_click(session, click), next_click=session.next_click + 1)


def _marked_click(click: ReflectorClick, mark: Mark, sigma_px: float | None) -> ReflectorClick:
    """Return a click that was marked again at its pixel: a guess becomes a measurement; what a person marked stays as it is."""
    marked = replace(click, mark=mark, sigma_px=sigma_px) if click.mark == "untouched" or mark == "snapped" else click
    _require_sigma(marked)
    return marked


@_apply_event.register
def _moved(event: ClickMoved, session: Session, facts: RecordingFacts) -> Session:
    u_px, v_px = _require_pixel(event.pixel_px, facts)
    click = _click(session, event.id)
    if (click.u_px, click.v_px) == event.pixel_px and event.mark == "moved":
        return session
    moved = replace(click, u_px=u_px, v_px=v_px, mark=event.mark, sigma_px=event.sigma_px)
    _require_sigma(moved)
    return _with_click(session, moved)


@_apply_event.register
def _chosen(event: ReturnChosen, session: Session, facts: RecordingFacts) -> Session:
    if event.chosen is not None and not all(map(math.isfinite, event.chosen.position_m)):
        raise EventError("the position of the chosen return is not finite; give it in metres")
    return _with_click(session, replace(_click(session, event.id), chosen=event.chosen))


@_apply_event.register
def _removed(event: ClickRemoved, session: Session, facts: RecordingFacts) -> Session:
    gone = _click(session, event.id)
    return replace(session, clicks=tuple(click for click in session.clicks if click is not gone))


@_apply_event.register
def _excluded(event: ClickExcluded, session: Session, facts: RecordingFacts) -> Session:
    return _with_click(session, replace(_click(session, event.id), excluded=event.excluded))


@_apply_event.register
def _options_changed(event: OptionsChanged, session: Session, facts: RecordingFacts) -> Session:
    return replace(session, options=changed_options(session.options, changes_from_tree(event.options)))


@_apply_event.register
def _intrinsics_chosen(event: IntrinsicsChosen, session: Session, facts: RecordingFacts) -> Session:
    if event.intrinsics is not None:
        _require_camera(event.intrinsics, facts)
    return replace(session, intrinsics=event.intrinsics)


@_apply_event.register
def _cleared(event: Cleared, session: Session, facts: RecordingFacts) -> Session:
    return replace(session, clicks=(), outcome=None, outcome_revision=-1, checked=())


@_apply_event.register
def _imported(event: ClicksImported, session: Session, facts: RecordingFacts) -> Session:
    imported = sorted(map(click_of, event.clicks))
    for click in imported:
        _require_frame(click.image_time, facts)
        _require_pixel((click.u_px, click.v_px), facts)
        _require_sigma(click)
    times = {click.image_time for click in imported}
    clicks = [click for click in session.clicks if click.image_time not in times]
    taken = {click.id for click in clicks}
    number = max([session.next_click, *(_number(click.id) + 1 for click in imported)])
    for click in imported:
        if click.id in taken:
            click, number = replace(click, id=f"c{number}"), number + 1
        taken.add(click.id)
        clicks.append(click)
    return replace(session, clicks=tuple(sorted(clicks)), next_click=number)


def _with_click(session: Session, click: ReflectorClick) -> Session:
    others = (other for other in session.clicks if other.id != click.id)
    return replace(session, clicks=tuple(sorted((*others, click))))


def _click(session: Session, click_id: str) -> ReflectorClick:
    for click in session.clicks:
        if click.id == click_id:
            return click
    raise EventError(f"there is no click '{click_id}'; it may have been removed in another tab")


def _require_sigma(click: ReflectorClick) -> None:
    if click.sigma_px is not None and not 0.0 < click.sigma_px < math.inf:
        raise EventError(
            f"click '{click.id}' has a sigma_px of {click.sigma_px:g}; give a number above 0, or leave it out"
        )


def _number(click_id: str) -> int:
    """Return the number in an id that the session gave, such as 7 of "c7"; 0 for ids of files."""
    digits = click_id[1:]
    return int(digits) if click_id.startswith("c") and digits.isascii() and digits.isdigit() and len(digits) < 10 else 0


class EventError(CalibrationError):
    """An event that does not fit the session or the recording; the session is unchanged."""


def _require_frame(time: TimeNs, facts: RecordingFacts) -> None:
    """Check that a frame has a stamp.

    Args:
        time: the stamp.
        facts: the recording's frames.

    Raises:
        EventError: no frame has it.
    """
    if facts.frame_at(time) is not None:
        return
    nearest = ""
    if len(facts.image_times):
        index = nearest_frame(facts.image_times, time)
        nearest = f", the nearest is frame {index + 1} at {seconds(TimeNs(int(facts.image_times[index])))}"
    raise EventError(
        f"no frame of {facts.name} has the stamp {seconds(time)}{nearest}; a click needs the exact stamp of its frame"
    )


def _require_pixel(pixel_px: tuple[float, float], facts: RecordingFacts) -> tuple[float, float]:
    """Return a pixel that is in the frame.

    Raises:
        EventError: it is not.
    """
    u_px, v_px = pixel_px
    if not (math.isfinite(u_px) and math.isfinite(v_px) and facts.has_pixel(u_px, v_px)):
        raise EventError(
            f"({u_px:.1f}, {v_px:.1f}) px is outside the frame of {facts.width_px} x {facts.height_px} px; click inside it"
        )
    return pixel_px


def _require_camera(intrinsics: ChosenIntrinsics, facts: RecordingFacts) -> None:
    """Check that intrinsics are a camera's, for frames of this size.

    Raises:
        EventError: they are not.
    """
    try:
        camera = intrinsics.camera
    except ValueError as error:
        raise EventError(f"the intrinsics cannot be used: {error}; calibrate the lens again") from None
    if (camera.width_px, camera.height_px) != (facts.width_px, facts.height_px):
        raise EventError(
            f"the intrinsics are for images of {camera.width_px} x {camera.height_px} px, but the frames have "
            f"{facts.width_px} x {facts.height_px}; calibrate with images of that size"
        )


def seconds(time: TimeNs) -> str:
    """Return a stamp as text, to the nanosecond."""
    sec, nanosec = time_parts(time)
    return f"{sec}.{nanosec:09d} s"


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
        outcome_revision=revision if kept.is_solved else kept.outcome_revision,
        column_map=current.column_map,
        confirmed=current.confirmed,
        acknowledged=current.acknowledged,
    )
