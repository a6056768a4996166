"""What is sent to a page: values in, text out."""

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import msgspec

from calib_core.arrays import TimesNs
from calib_core.measurements import NS_PER_S, Stamp
from calib_core.results import DataWarning
from cocalib.option_changes import OptionGroup, option_groups
from cocalib.view import FollowState, PairCandidates, View
from cocalib.view.review import Compared, PairReview, Review
from cocalib.web.messages.box_messages import FrameBoxes
from cocalib.web.messages.lens_messages import LensResult, LensState
from cocalib.web.messages.opening_messages import FolderListing, OpeningChoices
from cocalib.web.messages.proposal_messages import ProposalNews
from cocalib.web.messages.radar_messages import Placements, RadarLook, RadarMap
from cocalib.web.messages.review_messages import Uncertainty
from cocalib.web.messages.space_messages import SpaceLook
from cocalib.web.messages.view_changes import ViewChange


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
        has_pictures: whether there are frames to click in; without, the moments to look at are those of the radar scans.
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
    has_pictures: bool
    frame_times: StampColumns
    start: Stamp
    radar: StampColumns
    warnings: tuple[DataWarning, ...]
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


class OverlayReturn(msgspec.Struct, frozen=True, array_like=True):
    """One radar return on the picture; written as an array, since there are many.

    Attributes:
        u_px: column.
        v_px: row.
        range_m: from the radar.
        doppler_mps: positive moving away; None or NaN if the radar has none.
        snr_db: None or NaN if the radar has none.
        static: slow enough to be the reflector.
    """

    u_px: float
    v_px: float
    range_m: float
    doppler_mps: float | None
    snr_db: float | None
    static: bool


class OverlayGuess(msgspec.Struct, frozen=True, array_like=True):
    """Where the reflector of a placement is expected; written as an array.

    Attributes:
        u_px: column.
        v_px: row.
        range_m: of the placement.
    """

    u_px: float
    v_px: float
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
    returns: tuple[OverlayReturn, ...] | None
    guesses: tuple[OverlayGuess, ...]


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a long operation."""

    label: str
    done: int
    total: int


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
    """The header that precedes the bytes of a picture.

    Attributes:
        index: of the frame; -1 for the preview shown while the recording is being opened.
        request: the number of the message it answers; 0 if it answers none.
        width_px: columns of the recorded frame.
        height_px: rows of the recorded frame.
        scale: size of this picture relative to the recorded one.
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
    | RadarLook
    | RadarMap
    | SpaceLook
    | Overlay
    | FrameBoxes
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
    RadarLook: "radar_look",
    RadarMap: "radar_map",
    SpaceLook: "space",
    Overlay: "overlay",
    FrameBoxes: "frame_boxes",
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
        body = msgspec.json.encode(message).decode()
    except UnicodeEncodeError:
        body = msgspec.json.encode(_unicode(msgspec.to_builtins(message))).decode()
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
    """Encode a picture: length of the header (32 bits, little-endian), the header as JSON, the picture's own bytes."""
    text = msgspec.json.encode(header)
    return b"".join((struct.pack("<I", len(text)), text, data))
