"""The words of the channel between the page and the program: text to commands, values to text.

A page's message is a JSON object with a "type" and, if it wants an answer, a "request" number. `python -m app.web.messages`
writes `static/messages.d.ts` from the types here, and a test holds the file to them.
"""

import difflib
import struct
from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias, get_args

import msgspec
from msgspec import Meta

from app.option_changes import OptionGroup, changes_from_tree, option_groups
from app.session import OptionsEdited, Stamp, Step
from app.session_file import forms
from app.view import CautionRow, View
from calib_core.arrays import TimesNs
from calib_core.errors import InputError
from calib_core.measurements import NS_PER_S

__all__ = [
    "MAX_TEXT_BYTES",
    "Command",
    "CursorMoved",
    "Done",
    "FrameHeader",
    "FrameWanted",
    "Hello",
    "ImportWanted",
    "Incoming",
    "Outgoing",
    "Overlay",
    "OverlayReturn",
    "PlacementRow",
    "Placements",
    "Problem",
    "Progress",
    "RecordingNote",
    "SessionNote",
    "StampColumns",
    "encode",
    "encode_frame",
    "parse",
    "request_of",
]

MAX_TEXT_BYTES = 4 * 1024 * 1024
"""A longer message is refused unread; 10,000 clicks take about one megabyte."""

RequestNumber: TypeAlias = Annotated[int, Meta(ge=0, le=2**53 - 1)]
FrameIndex: TypeAlias = Annotated[int, Meta(ge=0, le=2**31 - 1)]


@dataclass(frozen=True, slots=True)
class Hello:
    """A page has opened: send it the recording and the view."""


@dataclass(frozen=True, slots=True)
class FrameWanted:
    """A page wants the picture of a frame.

    Attributes:
        index: of the frame.
        request: echoed in the picture's header; a newer request of the same page makes this one void.
        playing: frames follow one another quickly.
        size: "half" is enough while playing.
    """

    index: int
    request: int
    playing: bool = False
    size: Literal["full", "half"] = "full"


@dataclass(frozen=True, slots=True)
class CursorMoved:
    """A page looks at another frame: the 3D view and the overlay follow."""

    index: int


@dataclass(frozen=True, slots=True)
class ImportWanted:
    """A page read a file of clicks.

    Attributes:
        text: the file's content.
        name: the file's name, for error messages.
    """

    text: str
    name: str


Command: TypeAlias = Step | Hello | FrameWanted | CursorMoved | ImportWanted


@dataclass(frozen=True, slots=True)
class Incoming:
    """A message from a page.

    Attributes:
        command: what it wants.
        request: the number to answer with; None when no answer is wanted.
    """

    command: Command
    request: int | None = None


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
    """Where the session is kept and what was found there.

    Attributes:
        folder: path on the server's machine.
        restored_clicks: clicks found there.
        note: one sentence about anything unusual that was found; "" when there is nothing to say.
    """

    folder: str
    restored_clicks: int
    note: str = ""


@dataclass(frozen=True, slots=True)
class RecordingNote:
    """The recording, told once to each page.

    Attributes:
        name: what the person calls it.
        radar_topic: its radar.
        image_topic: its camera.
        width_px: columns of a frame.
        height_px: rows of a frame.
        frame_times: the stamp of every frame.
        start: the stamp of the first frame.
        radar: the stamp of every radar scan.
        cautions: what is odd about the recording.
        session: where the work is kept.
        version: of the program.
        option_groups: how to draw the options; their values are in the view.
    """

    name: str
    radar_topic: str
    image_topic: str
    width_px: int
    height_px: int
    frame_times: StampColumns
    start: Stamp
    radar: StampColumns
    cautions: tuple[CautionRow, ...]
    session: SessionNote
    version: str
    option_groups: tuple[OptionGroup, ...] = field(default_factory=option_groups)


@dataclass(frozen=True, slots=True)
class PlacementRow:
    """A dwell of the reflector that the radar has seen.

    Attributes:
        start_s: since the first frame [s].
        end_s: since the first frame [s].
        frame: the frame to click in.
        range_m: of the reflector.
        score: 0 to 1.
    """

    start_s: float
    end_s: float
    frame: int
    range_m: float
    score: float


@dataclass(frozen=True, slots=True)
class Placements:
    """The placements found from the radar alone."""

    placements: tuple[PlacementRow, ...]


@dataclass(frozen=True, slots=True)
class OverlayReturn:
    """One radar return on the picture."""

    u_px: float
    v_px: float
    range_m: float
    doppler_mps: float
    snr_db: float
    static: bool


@dataclass(frozen=True, slots=True)
class Overlay:
    """The nearest radar scan as the camera would see it.

    Attributes:
        index: of the frame.
        revision: of the session whose calibration carried the returns.
        returns: None without a calibration.
        guesses: pixels (u, v) at which the reflector may be.
    """

    index: int
    revision: int
    returns: tuple[OverlayReturn, ...] | None
    guesses: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Progress:
    """Something long is under way."""

    label: str
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class Problem:
    """Something the person asked for could not be done.

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
    """A message with a request number was carried out (and kept, if it was a step)."""

    request: int


@dataclass(frozen=True, slots=True)
class FrameHeader:
    """What comes before the bytes of a picture.

    Attributes:
        index: of the frame.
        request: the number of the message it answers.
        width_px: columns of the recorded frame.
        height_px: rows of the recorded frame.
        scale: size of this picture over the recorded one.
        format: of the bytes.
    """

    index: int
    request: int
    width_px: int
    height_px: int
    scale: float
    format: Literal["jpeg", "png"]


Outgoing: TypeAlias = View | RecordingNote | Placements | Overlay | Progress | Problem | Done

_TYPES: dict[type, str] = {
    View: "view",
    RecordingNote: "recording",
    Placements: "placements",
    Overlay: "overlay",
    Progress: "progress",
    Problem: "error",
    Done: "done",
}


class _Form(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A message of the page that is not a step."""


class _HelloForm(_Form, frozen=True, tag="hello"):
    pass


class _FrameForm(_Form, frozen=True, tag="frame"):
    index: FrameIndex
    request: RequestNumber
    playing: bool = False
    size: Literal["full", "half"] = "full"


class _CursorForm(_Form, frozen=True, tag="cursor"):
    index: FrameIndex


class _ImportForm(_Form, frozen=True, tag="import_clicks"):
    text: str
    name: Annotated[str, Meta(max_length=300)] = "the file"


_MessageForm: TypeAlias = forms.StepForm | _HelloForm | _FrameForm | _CursorForm | _ImportForm


def parse(text: str | bytes) -> Incoming:
    """Read a message from a page.

    Raises:
        InputError: it is too long, not JSON, of an unknown type, or has a field that is missing, unknown or wrong.
        OptionError: it names an option that does not exist or gives it a value of the wrong type.
    """
    raise NotImplementedError


def request_of(text: str | bytes) -> int | None:
    """Return the request number of a message that `parse` refused; None when it has none that can be read."""
    raise NotImplementedError


def encode(message: Outgoing) -> str:
    """Write a message to a page as JSON text, with its "type"; a number that is not finite becomes null."""
    body = msgspec.json.encode(message).decode()
    separator = "," if len(body) > 2 else ""
    return f'{{"type":"{_TYPES[type(message)]}"{separator}{body[1:]}'


def encode_frame(header: FrameHeader, data: bytes) -> bytes:
    """Write a picture: length of the header (32 bits, little-endian), the header as JSON, the picture's own bytes."""
    text = msgspec.json.encode(header)
    return b"".join((struct.pack("<I", len(text)), text, data))
