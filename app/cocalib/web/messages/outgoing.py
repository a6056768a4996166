"""What is sent to a page: values in, text out."""

import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from operator import attrgetter
from typing import Any, Literal, TypeAlias

import msgspec

from calib_core.arrays import TimesNs
from calib_core.json_forms import to_json
from calib_core.measurements import NS_PER_S, Stamp
from cocalib.option_changes import OptionGroup, option_groups
from cocalib.proposing import ProposingProgress
from cocalib.view.acc_panel import AccPanel
from cocalib.view.candidates import PairCandidates
from cocalib.view.contours import ContourMap
from cocalib.view.following import FollowState
from cocalib.view.model import ClickRow, View, WarningRow
from cocalib.view.review import Compared, PairReview, Review
from cocalib.web.messages.lens_messages import LensResult, LensState
from cocalib.web.messages.opening_messages import FolderListing, OpeningChoices
from cocalib.web.messages.space_messages import Placements, RadarFrame, RadarMap, RadarReturn, SpaceFrame

_VIEW_FIELDS = tuple(field.name for field in fields(View) if field.name != "clicks")
_ROW_FIELDS = tuple(field.name for field in fields(ClickRow))
_row_values = attrgetter(*_ROW_FIELDS)


@dataclass(frozen=True, slots=True)
class RowValues:
    """New values of some fields in some rows.

    Attributes:
        rows: places in the new list, ascending; None for all of them.
        fields: for each field, one value per row.
    """

    rows: tuple[int, ...] | None
    fields: dict[str, tuple[Any, ...]]


@dataclass(frozen=True, slots=True)
class ClickChange:
    """How the list of clicks changes: rows are removed, then added, then given values.

    Attributes:
        removed: places in the old list, ascending.
        added: places in the new list, ascending; `values` has every field of these rows.
        values: what differs; fields that differ in the same rows stand together.
    """

    removed: tuple[int, ...]
    added: tuple[int, ...]
    values: tuple[RowValues, ...]


@dataclass(frozen=True, slots=True)
class ViewChange:
    """What a page changes in the View it has.

    Attributes:
        number: 1 for the first change after a whole View, and so on; a page that misses one asks for a whole View.
        fields: the new values of the View's fields that differ, except `clicks`.
        clicks: the rows that differ; None if none does.
    """

    number: int
    fields: dict[str, Any]
    clicks: ClickChange | None


@dataclass(frozen=True, slots=True)
class ProposalPlace:
    """A place in the image where the reflector may stand.

    Attributes:
        pixel_px: column and row.
        sigma_px: standard deviation of that pixel per axis, if it is the reflector.
    """

    pixel_px: tuple[float, float]
    sigma_px: float


@dataclass(frozen=True, slots=True)
class ProposalRow:
    """Where the reflector probably stands in the images of a placement.

    Attributes:
        placement: its number among the placements, from 0.
        frame: in which it is shown.
        image_time: stamp of that frame.
        width_px: of the reflector there.
        confidence: probability that the first place is the reflector, 0 to 1.
        reason: why the confidence is low, as a clause; "" if it is not.
        places: what the image shows, the most probable first.
    """

    placement: int
    frame: int
    image_time: Stamp
    width_px: float
    confidence: float
    reason: str
    places: tuple[ProposalPlace, ...]


@dataclass(frozen=True, slots=True)
class UnproposedRow:
    """A placement without a proposal.

    Attributes:
        placement: its number among the placements, from 0.
        reason: why there is none, as a clause.
    """

    placement: int
    reason: str


@dataclass(frozen=True, slots=True)
class ProposalNews:
    """The proposals as far as they can be made, and how far they are.

    Attributes:
        on: whether proposals are wanted.
        progress: how far they are, and why there are none.
        rows: the most confident first; placements that have a click are left out.
        unproposed: placements for which nothing can be proposed.
        slips: ids of clicks that are probably wrong: the images show the reflector beside them.
    """

    on: bool
    progress: ProposingProgress
    rows: tuple[ProposalRow, ...] = ()
    unproposed: tuple[UnproposedRow, ...] = ()
    slips: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Where points at several distances may appear in the image.

    Attributes:
        revision: of the session that the answer belongs to.
        maps: one per distance; empty without a calibration.
    """

    revision: int
    maps: tuple[ContourMap, ...]


@dataclass(frozen=True, slots=True)
class StampColumns:
    """Many stamps, as two columns.

    Attributes:
        sec: whole seconds.
        nanosec: nanoseconds within the second.
    """

    sec: tuple[int, ...]
    nanosec: tuple[int, ...]

    @classmethod
    def of(cls, times_ns: TimesNs) -> "StampColumns":
        """Split an array of stamps (n,) [ns]."""
        return cls(tuple((times_ns // NS_PER_S).tolist()), tuple((times_ns % NS_PER_S).tolist()))


@dataclass(frozen=True, slots=True)
class SessionNote:
    """Where the session is stored and what was found there.

    Attributes:
        folder: path on the server's machine.
        restored_clicks: clicks found there.
        note: one sentence about anything unusual that was found; "" when there is nothing to say.
    """

    folder: str
    restored_clicks: int
    note: str = ""


@dataclass(frozen=True, slots=True)
class SensorNote:
    """How the radar or the camera of the recording is read.

    Attributes:
        name: "radar" or "camera".
        topic: its topic; "none" if there is none.
        clock: the source of its times, "header" or "receive"; "" if unknown.
        about: what is read, which clock was chosen and why, and anything unusual, line by line.
    """

    name: str
    topic: str
    clock: str = ""
    about: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Opening:
    """The recording is being opened: there is at most a preview, and nothing can be clicked yet.

    Attributes:
        name: what the user calls it.
        doing: what is being done, as text.
        problem: why it cannot be opened; "" while it is being opened.
    """

    name: str
    doing: str
    problem: str = ""


@dataclass(frozen=True, slots=True)
class RecordingNote:
    """The recording, sent once to each page.

    Attributes:
        name: what the user calls it.
        radar_topic: its radar.
        image_topic: its camera.
        width_px: columns of a frame.
        height_px: rows of a frame.
        has_images: whether there are frames to click in; without, the moments to look at are those of the radar scans.
        frame_times: the stamp of every frame, or moment to look at.
        start: the stamp of the first.
        radar: the stamp of every radar scan.
        warnings: about the recording.
        sensors: how the radar and the camera are read.
        session: where the session is stored.
        version: of the program.
        option_groups: how to draw the options; their values are in the view.
        opening: how often the server has opened a recording; with another number it is another one, or read in another way.
        intrinsics: where the camera's intrinsics come from; "" if there are none.
    """

    name: str
    radar_topic: str
    image_topic: str
    width_px: int
    height_px: int
    has_images: bool
    frame_times: StampColumns
    start: Stamp
    radar: StampColumns
    warnings: tuple[WarningRow, ...]
    sensors: tuple[SensorNote, ...]
    session: SessionNote
    version: str
    option_groups: tuple[OptionGroup, ...] = field(default_factory=option_groups)
    opening: int = 1
    intrinsics: str = ""


@dataclass(frozen=True, slots=True)
class FramesAdded:
    """Frames have been written since; they follow those that a page knows.

    Attributes:
        first: index of the first of them; a page that does not have all before greets again.
        frame_times: the stamp of each.
    """

    first: int
    frame_times: StampColumns


@dataclass(frozen=True, slots=True)
class FollowNote:
    """How a recording that is still being written goes on.

    Attributes:
        state: "live" while it grows, "quiet" when nothing has been written for a while, "complete" once it has been closed,
            "ended" if it can no longer be followed.
        words: the same in one or two sentences, with the delay.
        advice: how many placements there are, and where the next one pays; "" while that is unknown.
    """

    state: FollowState
    words: str
    advice: str = ""


class OverlayGuess(msgspec.Struct, frozen=True, array_like=True):
    """Where the reflector of a placement is expected; written as an array.

    Attributes:
        pixel_px: column and row.
        range_m: of the placement.
    """

    pixel_px: tuple[float, float]
    range_m: float


@dataclass(frozen=True, slots=True)
class Overlay:
    """The nearest radar scan as the camera would see it.

    Attributes:
        index: of the frame.
        revision: of the session whose calibration projected the returns.
        returns: None without a calibration.
        guesses: where the reflectors of the placements at that time are expected.
    """

    index: int
    revision: int
    returns: tuple[RadarReturn, ...] | None
    guesses: tuple[OverlayGuess, ...]


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a long operation."""

    label: str
    done: int
    total: int


DroppedKind: TypeAlias = Literal["camera", "clicks", "calibration", "boxes"]


@dataclass(frozen=True, slots=True)
class Dropped:
    """What the file is that was dropped last: the page gives it to whoever takes such files."""

    kind: DroppedKind


@dataclass(frozen=True, slots=True)
class Snapped:
    """The reflector's apex near a pixel, or why there is none; nothing was changed.

    Attributes:
        pixel_px: column and row; None if no apex was found.
        sigma_px: its standard deviation per axis; None if no apex was found.
        words: what was found, in one sentence.
        id: of the click for which it was searched; None for the keyboard's cross.
    """

    pixel_px: tuple[float, float] | None
    sigma_px: float | None
    words: str
    id: str | None = None


@dataclass(frozen=True, slots=True)
class Problem:
    """A request of the user could not be carried out.

    Attributes:
        message: what and why.
        hint: what to do about it; "" when the message says it.
        request: the number of the message it answers; None when it answers none.
    """

    message: str
    hint: str = ""
    request: int | None = None


@dataclass(frozen=True, slots=True)
class Done:
    """A message with a request number was carried out (and stored, if it was a step)."""

    request: int


@dataclass(frozen=True, slots=True)
class FrameHeader:
    """The header that precedes the bytes of an image.

    Attributes:
        index: of the frame; -1 for the preview shown while the recording is being opened.
        request: the number of the message it answers; 0 if it answers none.
        width_px: columns of the recorded frame.
        height_px: rows of the recorded frame.
        scale: size of this image relative to the recorded one.
        format: of the bytes.
        rectified: whether it is shown without distortion.
    """

    index: int
    request: int
    width_px: int
    height_px: int
    scale: float
    format: Literal["jpeg", "png"]
    rectified: bool = False


Outgoing: TypeAlias = (
    View
    | ViewChange
    | Opening
    | OpeningChoices
    | FolderListing
    | RecordingNote
    | FramesAdded
    | FollowNote
    | Placements
    | RadarFrame
    | RadarMap
    | SpaceFrame
    | Overlay
    | AccPanel
    | PairCandidates
    | Review
    | PairReview
    | Compared
    | Uncertainty
    | LensState
    | LensResult
    | ProposalNews
    | Progress
    | Snapped
    | Dropped
    | Problem
    | Done
)

TYPES: Mapping[type, str] = {
    View: "view",
    ViewChange: "view_change",
    Opening: "opening",
    OpeningChoices: "opening_choices",
    FolderListing: "folder_listing",
    RecordingNote: "recording",
    FramesAdded: "frames_added",
    FollowNote: "following",
    Placements: "placements",
    RadarFrame: "radar_look",
    RadarMap: "radar_map",
    SpaceFrame: "space",
    Overlay: "overlay",
    AccPanel: "acc",
    PairCandidates: "candidates",
    Review: "review",
    PairReview: "pair_review",
    Compared: "compared",
    Uncertainty: "uncertainty",
    LensState: "lens",
    LensResult: "lens_result",
    ProposalNews: "proposals",
    Progress: "progress",
    Snapped: "snapped",
    Dropped: "dropped",
    Problem: "error",
    Done: "done",
}
"""The "type" that each message carries."""


def encode(message: Outgoing) -> str:
    """Encode a message to a page as JSON text, with its "type".

    A number that is not finite becomes null. A character that is not Unicode, such as an undecodable byte of a file name, is
    written as an escape (backslash, x or u, digits).
    """
    try:
        body = msgspec.json.encode(message, enc_hook=to_json).decode()
    except UnicodeEncodeError:
        body = msgspec.json.encode(_unicode(msgspec.to_builtins(message, enc_hook=to_json))).decode()
    separator = "," if len(body) > 2 else ""
    return f'{{"type":"{TYPES[type(message)]}"{separator}{body[1:]}'


def _unicode(tree: object) -> object:
    """Return plain values with every character that UTF-8 cannot encode written as an escape."""
    if isinstance(tree, str):
        return tree.encode("utf-8", "backslashreplace").decode()
    if isinstance(tree, dict):
        return {_unicode(name): _unicode(value) for name, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [_unicode(value) for value in tree]
    return tree


def encode_frame(header: FrameHeader, data: bytes) -> bytes:
    """Encode an image: length of the header (32 bits, little-endian), the header as JSON, the image's own bytes."""
    text = msgspec.json.encode(header)
    return b"".join((struct.pack("<I", len(text)), text, data))


def change_between(before: View, after: View, *, number: int) -> ViewChange:
    """Return what a page that shows `before` needs in order to show `after`.

    Args:
        before: the View that the page has.
        after: the View that it is to have.
        number: counts the changes since the last whole View.
    """
    different = {name: value for name in _VIEW_FIELDS if (value := getattr(after, name)) != getattr(before, name)}
    return ViewChange(number, different, _click_change(before.clicks, after.clicks))


def _click_change(before: Sequence[ClickRow], after: Sequence[ClickRow]) -> ClickChange | None:
    removed, added = _membership([row.id for row in before], [row.id for row in after])
    is_added = set(added)
    places = [place for place in range(len(after)) if place not in is_added]
    is_removed = set(removed)
    kept = [row for place, row in enumerate(before) if place not in is_removed]
    rows: dict[str, list[int]] = {name: list(added) for name in _ROW_FIELDS}
    for place, old in zip(places, kept, strict=True):
        if after[place] is not old:
            for name in _differing(old, after[place]):
                rows[name].append(place)
    values = tuple(_values(rows, after))
    return ClickChange(tuple(removed), tuple(added), values) if removed or added or values else None


def _membership(before: Sequence[str], after: Sequence[str]) -> tuple[list[int], list[int]]:
    """Return the places of the ids to remove and to add; the whole lists if those that stay are in another order."""
    if before == after:
        return [], []
    old, new = set(before), set(after)
    staying = [name for name in before if name in new] == [name for name in after if name in old]
    if not staying or len(old) < len(before) or len(new) < len(after):
        return list(range(len(before))), list(range(len(after)))
    return (
        [index for index, name in enumerate(before) if name not in new],
        [index for index, name in enumerate(after) if name not in old],
    )


def _differing(old: ClickRow, new: ClickRow) -> Iterator[str]:
    pairs = zip(_ROW_FIELDS, _row_values(old), _row_values(new), strict=True)
    return (name for name, before, after in pairs if before != after)


def _values(rows: dict[str, list[int]], after: Sequence[ClickRow]) -> Iterable[RowValues]:
    """Yield the new values, fields that differ in the same rows together."""
    together: dict[tuple[int, ...], list[str]] = {}
    for name, places in rows.items():
        if 2 * len(places) > len(after):
            places = list(range(len(after)))  # shorter to write than most of the places
        if places:
            together.setdefault(tuple(sorted(places)), []).append(name)
    for chosen, names in together.items():
        columns = {name: tuple(getattr(after[place], name) for place in chosen) for name in names}
        yield RowValues(None if len(chosen) == len(after) else chosen, columns)
