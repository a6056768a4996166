"""How each event about boxes changes the session; answers in progress stay valid, since no pose depends on boxes."""

import math
from dataclasses import replace
from functools import singledispatch
from typing import TypeAlias

from msgspec.structs import replace as changed

from calib_core.measurements import TimeNs
from cocalib.session.box_tracks import BoxEdges, BoxKeyframe, BoxTrack
from cocalib.session.event_checks import EventError, require_frame
from cocalib.session.events import (
    BoxDrawn,
    BoxesLoaded,
    BoxHidden,
    BoxKeyframeRemoved,
    BoxLabelled,
    BoxMoved,
    BoxRemoved,
)
from cocalib.session.state import RecordingFacts, Session

BoxEvent: TypeAlias = BoxDrawn | BoxMoved | BoxHidden | BoxKeyframeRemoved | BoxRemoved | BoxLabelled | BoxesLoaded

_LEAST_PX = 3.0
"""A box narrower or lower than this is a slip of the hand, and shows nothing that could be followed [px]."""
_LONGEST_LABEL = 60
_MOST_BOXES = 100_000


@singledispatch
def apply_to_boxes(event: BoxEvent, session: Session, facts: RecordingFacts) -> Session:
    """Return the session after an event about boxes; an equal one if the event changes nothing.

    Raises:
        EventError: the event does not fit the session or the recording.
    """
    raise TypeError(f"not an event about boxes: {event!r}")


@apply_to_boxes.register
def _drawn(event: BoxDrawn, session: Session, facts: RecordingFacts) -> Session:
    require_frame(event.image_time, facts, "a box")
    keyframe = BoxKeyframe(event.image_time, _checked_edges(event.edges_px, facts))
    track = BoxTrack(f"b{session.next_box}", _checked_label(event.label), (keyframe,))
    if not track.label:
        raise EventError("a box needs a class, such as person or car")
    return replace(session, boxes=(*session.boxes, track), next_box=session.next_box + 1)


@apply_to_boxes.register
def _moved(event: BoxMoved, session: Session, facts: RecordingFacts) -> Session:
    require_frame(event.image_time, facts, "a box")
    return _with_keyframe(session, event.id, BoxKeyframe(event.image_time, _checked_edges(event.edges_px, facts)))


@apply_to_boxes.register
def _hidden(event: BoxHidden, session: Session, facts: RecordingFacts) -> Session:
    require_frame(event.image_time, facts, "the end of a box")
    if not any(one.image_time < event.image_time for one in _track(session, event.id).keyframes):
        raise EventError(f"box '{event.id}' begins in this frame or later; delete it instead, or go to a later frame")
    return _with_keyframe(session, event.id, BoxKeyframe(event.image_time, None))


@apply_to_boxes.register
def _keyframe_removed(event: BoxKeyframeRemoved, session: Session, facts: RecordingFacts) -> Session:
    track = _track(session, event.id)
    rest = tuple(one for one in track.keyframes if one.image_time != event.image_time)
    if len(rest) == len(track.keyframes):
        raise EventError(f"box '{event.id}' was neither drawn nor corrected in this frame; nothing to take back here")
    if all(one.edges_px is None for one in rest):
        return _without(session, track)
    first = next(index for index, one in enumerate(rest) if one.edges_px is not None)
    return _with_track(session, changed(track, keyframes=rest[first:]))


@apply_to_boxes.register
def _removed(event: BoxRemoved, session: Session, facts: RecordingFacts) -> Session:
    return _without(session, _track(session, event.id))


@apply_to_boxes.register
def _labelled(event: BoxLabelled, session: Session, facts: RecordingFacts) -> Session:
    label = _checked_label(event.label)
    if not label:
        raise EventError("a box needs a class, such as person or car")
    return _with_track(session, changed(_track(session, event.id), label=label))


@apply_to_boxes.register
def _loaded(event: BoxesLoaded, session: Session, facts: RecordingFacts) -> Session:
    for time in event.empty_frames:
        require_frame(time, facts, "an annotated frame")
    if sum(len(track.keyframes) for track in event.tracks) > _MOST_BOXES:
        raise EventError(f"more than {_MOST_BOXES} boxes; load a file with fewer, or use cocalib evaluate --boxes")
    if len({track.id for track in event.tracks}) < len(event.tracks):
        raise EventError("two tracks of boxes have the same name; give each object its own")
    tracks = tuple(_checked_track(track, facts) for track in event.tracks)
    number = max([session.next_box, *(_number(track.id) + 1 for track in tracks)])
    return replace(session, boxes=tracks, empty_frames=event.empty_frames, next_box=number)


def _checked_track(track: BoxTrack, facts: RecordingFacts) -> BoxTrack:
    for keyframe in track.keyframes:
        require_frame(keyframe.image_time, facts, "a box")
        if keyframe.edges_px is not None:
            _checked_edges(keyframe.edges_px, facts)
    times = [keyframe.image_time for keyframe in track.keyframes]
    if not times or track.keyframes[0].edges_px is None or sorted(set(times)) != times:
        raise EventError(f"track '{track.id}' has no box at its start, or two in one frame; give each frame one")
    return changed(track, label=_checked_label(track.label))


def _with_keyframe(session: Session, track_id: str, keyframe: BoxKeyframe) -> Session:
    track = _track(session, track_id)
    others = (one for one in track.keyframes if one.image_time != keyframe.image_time)
    return _with_track(session, changed(track, keyframes=tuple(sorted((*others, keyframe), key=_time))))


def _time(keyframe: BoxKeyframe) -> TimeNs:
    return keyframe.image_time


def _with_track(session: Session, track: BoxTrack) -> Session:
    return replace(session, boxes=tuple(track if other.id == track.id else other for other in session.boxes))


def _without(session: Session, track: BoxTrack) -> Session:
    return replace(session, boxes=tuple(other for other in session.boxes if other is not track))


def _track(session: Session, track_id: str) -> BoxTrack:
    for track in session.boxes:
        if track.id == track_id:
            return track
    raise EventError(f"there is no box '{track_id}'; it may have been deleted in another tab")


def _checked_edges(edges_px: BoxEdges, facts: RecordingFacts) -> BoxEdges:
    """Return the edges of a box in a frame.

    Raises:
        EventError: it is too small, or not in the frame.
    """
    left, top, right, bottom = edges_px
    inside = all(map(math.isfinite, edges_px)) and facts.has_pixel(left, top) and facts.has_pixel(right, bottom)
    if not inside:
        raise EventError(
            f"the box from ({left:.1f}, {top:.1f}) to ({right:.1f}, {bottom:.1f}) px is not in the frame of "
            f"{facts.width_px} x {facts.height_px} px; draw it inside"
        )
    if right - left < _LEAST_PX or bottom - top < _LEAST_PX:
        raise EventError(
            f"the box is {right - left:.1f} x {bottom - top:.1f} px; draw it at least {_LEAST_PX:g} px wide and high"
        )
    return edges_px


def _checked_label(label: str) -> str:
    """Return the class of a box without surrounding blanks.

    Raises:
        EventError: it is too long, or has characters that cannot be shown.
    """
    text = label.strip()
    if len(text) > _LONGEST_LABEL or not text.isprintable():
        raise EventError(f"a class has at most {_LONGEST_LABEL} characters, all of them printable; give a shorter one")
    return text


def _number(track_id: str) -> int:
    digits = track_id[1:]
    return int(digits) if track_id.startswith("b") and digits.isascii() and digits.isdigit() and len(digits) < 10 else 0
