"""What a page may send: text in, commands out."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeAlias, get_args

import msgspec
from msgspec import Meta
from msgspec.structs import replace

from calib_core.errors import InputError, meant
from calib_core.json_forms import from_json
from calib_core.measurements import TimeNs
from calib_core.parsing import json_form
from cocalib.option_changes import changes_from_tree
from cocalib.session.events import AxesStated, ClickPlaced, ColumnsMapped, Id, JournalStep, OptionsChanged
from cocalib.web.messages.lens_messages import LensCalibrate, LensCancel, LensUse
from cocalib.web.messages.opening_messages import ChoicesWanted, FolderWanted, OpeningCommand, OpenWith, RecentForgotten

MAX_TEXT_BYTES = 4 * 1024 * 1024
"""A longer message is refused without parsing; 10,000 clicks take about one megabyte."""

RequestNumber: TypeAlias = Annotated[int, Meta(ge=0, le=2**53 - 1)]
FrameIndex: TypeAlias = Annotated[int, Meta(ge=0, le=2**31 - 1)]


ReturnColour: TypeAlias = Literal["speed", "range", "doppler", "amplitude", "height"]
Viewpoint: TypeAlias = Literal["behind", "above", "side"]


class _Request(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A message of the page that is not a step."""


class Hello(_Request, frozen=True, tag="hello"):
    """A page has opened: send it the recording and the view."""


class ViewWanted(_Request, frozen=True, tag="view"):
    """A page missed a change of the View: send it a whole one."""


class FrameWanted(_Request, frozen=True, tag="frame"):
    """A page wants the image of a frame; exactly one binary message answers, unless a newer request comes first.

    Attributes:
        index: of the frame.
        request: echoed in the image's header; a newer request of the same page supersedes this one.
        playing: frames follow one another quickly.
        size: "half" is enough while playing; "rectified" is the whole image without distortion.
    """

    index: FrameIndex
    request: RequestNumber
    playing: bool = False
    size: Literal["full", "half", "rectified"] = "full"


class CursorMoved(_Request, frozen=True, tag="cursor"):
    """A page shows another frame: the 3D view and the overlay follow.

    Attributes:
        index: of the frame.
        playing: frames follow one another quickly.
        selected: id of the selected click; None if there is none.
        light: the page uses its light theme, and the 3D view follows.
        trail_s: for how long returns stay [s].
        colour: what the colours of returns mean in the 3D view; "speed" says static or moving.
        whole: the 3D view shows the static returns of the whole recording.
        hidden: the 3D view is hidden, and nothing needs to be sent to it.
    """

    index: FrameIndex
    playing: bool = False
    selected: Annotated[str, Meta(max_length=100)] | None = None
    light: bool = False
    trail_s: Annotated[float, Meta(ge=0, le=60)] = 0.0
    colour: ReturnColour = "speed"
    whole: bool = False
    hidden: bool = False


class ViewpointWanted(_Request, frozen=True, tag="viewpoint"):
    """A page wants another viewpoint for its 3D view: behind, above or to the side of the radar."""

    viewpoint: Viewpoint


class ImportWanted(_Request, frozen=True, tag="import_clicks"):
    """A page read a file of clicks.

    Attributes:
        text: the file's content.
        name: the file's name, for error messages.
    """

    text: str
    name: Annotated[str, Meta(max_length=300)] = "the file"


class SnapWanted(_Request, frozen=True, tag="snap_wanted"):
    """A page wants the reflector's apex near a pixel of a frame; one message `snapped` answers, and nothing is changed.

    Attributes:
        image_time: stamp of the frame.
        pixel_px: column and row.
        id: of the click that stands there; None for the keyboard's cross, and for a new click.
        near: whether it lies next to the pixel, as that of a new click where a proposal is shown.
    """

    image_time: TimeNs
    pixel_px: tuple[float, float]
    id: Id | None = None
    near: bool = False


class BoxesWanted(_Request, frozen=True, tag="load_boxes", rename={"content": "content_base64"}):
    """A page read a file of boxes; the calibration is judged by them.

    Attributes:
        name: of the file.
        content: of the file.
    """

    name: Annotated[str, Meta(max_length=300)]
    content: bytes


class FileDropped(_Request, frozen=True, tag="file_dropped", rename={"content": "content_base64"}):
    """A file was dropped on the page, which asks what it is; one message `dropped` answers.

    Attributes:
        name: of the file.
        content: of the file, or its beginning.
        is_whole: whether it is all of it.
    """

    name: Annotated[str, Meta(min_length=1, max_length=300)]
    content: bytes
    is_whole: bool = True


class MovingBoxesWanted(_Request, frozen=True, tag="find_moving"):
    """The calibration is to be judged by boxes around what moves before the camera."""


class ProposingSwitch(_Request, frozen=True, tag="propose"):
    """Proposals are wanted, or not wanted any more."""

    on: bool


SolutionKind: TypeAlias = Literal["now", "default", "paper", "toggled", "before", "reference", "file"]


class ReviewWanted(_Request, frozen=True, tag="review"):
    """The review of all pairs is requested."""


class PairReviewWanted(_Request, frozen=True, tag="review_pair"):
    """The review of one pair is requested."""

    id: Annotated[str, Meta(max_length=100)]


class CompareWanted(_Request, frozen=True, tag="compare"):
    """Two solutions are to be compared; the content of a file is sent once, and kept for later requests of the page."""

    a: SolutionKind
    b: SolutionKind
    pair: Annotated[str, Meta(max_length=100)] | None = None
    file_name: Annotated[str, Meta(max_length=300)] = ""
    file_base64: str = ""


class UncertaintyWanted(_Request, frozen=True, tag="uncertainty"):
    """The contours of the uncertainty in the image are requested."""


ReviewRequest: TypeAlias = ReviewWanted | PairReviewWanted | CompareWanted | UncertaintyWanted


Command: TypeAlias = (
    JournalStep
    | Hello
    | ViewWanted
    | FrameWanted
    | CursorMoved
    | ViewpointWanted
    | ImportWanted
    | ReviewRequest
    | LensCalibrate
    | LensCancel
    | LensUse
    | ProposingSwitch
    | SnapWanted
    | BoxesWanted
    | MovingBoxesWanted
    | FileDropped
)
Message: TypeAlias = Command | ChoicesWanted | FolderWanted | RecentForgotten | OpenWith


@dataclass(frozen=True, slots=True)
class Incoming:
    """A message from a page.

    Attributes:
        command: what it wants.
        request: the number to answer with; None when no answer is wanted.
    """

    command: Message
    request: int | None = None


_TYPES = {str(form.__struct_config__.tag): form for form in get_args(Message)}


class _Envelope(msgspec.Struct):
    request: RequestNumber | None = None


class _Named(msgspec.Struct):
    type: str = ""


def parse(text: str | bytes) -> Incoming:
    """Read a message from a page.

    Raises:
        InputError: it is too long, not JSON, of an unknown type, or has a field that is missing, unknown or wrong.
        OptionError: it names an option that does not exist or gives it a value of the wrong type.
    """
    if len(text) > MAX_TEXT_BYTES:
        raise InputError(f"the message is longer than {MAX_TEXT_BYTES // 2**20} MB, the maximum")
    try:
        fields = json_form(text, dict[str, Any])
    except InputError as error:
        raise InputError(f"the message is not JSON: {error}") from error
    kind = _kind(fields)
    request = None if kind == "frame" else fields.pop("request", None)
    try:
        command = msgspec.convert(fields, _TYPES[kind], dec_hook=from_json)
        return Incoming(_checked(command), msgspec.convert(request, RequestNumber | None))
    except msgspec.ValidationError as error:
        raise InputError(f"invalid message '{kind}': {error}") from error


def request_of(text: str | bytes) -> int | None:
    """Return the request number of a message that `parse` refused; None if it has none that can be read."""
    try:
        return json_form(text[:MAX_TEXT_BYTES], _Envelope).request
    except InputError:
        return None


def is_about_opening(text: str | bytes) -> bool:
    """Return whether a message that `parse` refused was about the choice of a recording."""
    try:
        kind = json_form(text[:MAX_TEXT_BYTES], _Named).type
    except InputError:
        return False
    return kind in _TYPES and issubclass(_TYPES[kind], OpeningCommand)


def _kind(fields: dict[str, Any]) -> str:
    kind = fields.get("type")
    if isinstance(kind, str) and kind in _TYPES:
        return kind
    raise InputError(f"unknown message type '{str(kind)[:80]}'; {meant(str(kind), _TYPES)}")


def _checked(command: Message) -> Message:
    """Return a command as it is carried out.

    Raises:
        InputError: the page may not send it.
        OptionError: it names an option that does not exist or gives it a value of the wrong type.
    """
    if isinstance(command, ColumnsMapped | AxesStated):
        raise InputError("how the radar is read is stated when the recording is opened, with --map and --radar-axes")
    if isinstance(command, OptionsChanged):
        changes_from_tree(command.options)
    if isinstance(command, ClickPlaced) and command.mark is None:
        return replace(command, mark="clicked")
    return command
