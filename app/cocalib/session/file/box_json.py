"""The JSON form of each step about boxes."""

from collections.abc import Callable
from typing import Annotated, Any, TypeAlias

import msgspec
from msgspec import Meta

from calib_core.measurements import Stamp, TimeNs
from cocalib.session import (
    BoxDrawn,
    BoxesLoaded,
    BoxHidden,
    BoxKeyframe,
    BoxKeyframeRemoved,
    BoxLabelled,
    BoxMoved,
    BoxRemoved,
    BoxTrack,
)
from cocalib.session.file.form_parts import StampForm, StepPart

TrackId: TypeAlias = Annotated[str, Meta(min_length=1, max_length=100)]
LabelForm: TypeAlias = Annotated[str, Meta(max_length=100)]
EdgesForm: TypeAlias = tuple[float, float, float, float]


class BoxKeyframeForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A frame in which the box of an object is stated; null: it is hidden from there on."""

    image_time: StampForm
    box_px: EdgesForm | None


class BoxTrackForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The boxes of one object."""

    id: TrackId
    label: LabelForm
    keyframes: tuple[BoxKeyframeForm, ...]
    carried: bool


class BoxDrawnForm(StepPart, frozen=True, tag="box_drawn"):
    """A box drawn around an object that had none: left, top, right, bottom."""

    image_time: StampForm
    box_px: EdgesForm
    label: LabelForm


class BoxMovedForm(StepPart, frozen=True, tag="box_moved"):
    """The box of an object corrected in a frame."""

    id: TrackId
    image_time: StampForm
    box_px: EdgesForm


class BoxHiddenForm(StepPart, frozen=True, tag="box_hidden"):
    """An object hidden from a frame on."""

    id: TrackId
    image_time: StampForm


class BoxKeyframeRemovedForm(StepPart, frozen=True, tag="box_keyframe_removed"):
    """What was said about an object in a frame taken back."""

    id: TrackId
    image_time: StampForm


class BoxRemovedForm(StepPart, frozen=True, tag="box_removed"):
    """All boxes of an object deleted."""

    id: TrackId


class BoxLabelledForm(StepPart, frozen=True, tag="box_labelled"):
    """An object given another class."""

    id: TrackId
    label: LabelForm


class BoxesLoadedForm(StepPart, frozen=True, tag="boxes_loaded"):
    """Boxes from a file, in place of all others."""

    tracks: tuple[BoxTrackForm, ...]
    empty_frames: tuple[StampForm, ...] = ()


def form_of_track(track: BoxTrack) -> BoxTrackForm:
    """Convert the boxes of an object to their JSON form."""
    keyframes = tuple(BoxKeyframeForm(_form(one.image_time), one.edges_px) for one in track.keyframes)
    return BoxTrackForm(track.id, track.label, keyframes, track.is_carried)


def track_from_form(form: BoxTrackForm) -> BoxTrack:
    """Convert the boxes of an object from their JSON form."""
    keyframes = tuple(BoxKeyframe(one.image_time.stamp.time, one.box_px) for one in form.keyframes)
    return BoxTrack(form.id, form.label, keyframes, form.carried)


def _form(time: TimeNs) -> StampForm:
    return StampForm.of(Stamp.of(time))


def _form_of_loaded(step: BoxesLoaded) -> BoxesLoadedForm:
    return BoxesLoadedForm(tuple(map(form_of_track, step.tracks)), tuple(map(_form, step.empty_frames)))


def _loaded(form: BoxesLoadedForm) -> BoxesLoaded:
    empty_frames = tuple(stamp.stamp.time for stamp in form.empty_frames)
    return BoxesLoaded(tuple(map(track_from_form, form.tracks)), empty_frames)


FORM_OF: tuple[tuple[type, Callable[[Any], Any]], ...] = (
    (BoxDrawn, lambda step: BoxDrawnForm(_form(step.image_time), step.edges_px, step.label)),
    (BoxMoved, lambda step: BoxMovedForm(step.id, _form(step.image_time), step.edges_px)),
    (BoxHidden, lambda step: BoxHiddenForm(step.id, _form(step.image_time))),
    (BoxKeyframeRemoved, lambda step: BoxKeyframeRemovedForm(step.id, _form(step.image_time))),
    (BoxRemoved, lambda step: BoxRemovedForm(step.id)),
    (BoxLabelled, lambda step: BoxLabelledForm(step.id, step.label)),
    (BoxesLoaded, _form_of_loaded),
)
"""Each event with what makes its form."""

EVENT_OF: tuple[tuple[type, Callable[[Any], Any]], ...] = (
    (BoxDrawnForm, lambda form: BoxDrawn(form.image_time.stamp.time, form.box_px, form.label)),
    (BoxMovedForm, lambda form: BoxMoved(form.id, form.image_time.stamp.time, form.box_px)),
    (BoxHiddenForm, lambda form: BoxHidden(form.id, form.image_time.stamp.time)),
    (BoxKeyframeRemovedForm, lambda form: BoxKeyframeRemoved(form.id, form.image_time.stamp.time)),
    (BoxRemovedForm, lambda form: BoxRemoved(form.id)),
    (BoxLabelledForm, lambda form: BoxLabelled(form.id, form.label)),
    (BoxesLoadedForm, _loaded),
)
"""Each form with what makes its event."""
