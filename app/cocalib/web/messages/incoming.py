"""What a page may send: text in, commands out."""

import base64
import binascii
import difflib
from dataclasses import dataclass, replace
from functools import singledispatch
from typing import Annotated, Any, Literal, TypeAlias, get_args

import msgspec
from msgspec import Meta

from calib_core.errors import InputError
from calib_core.measurements import TimeNs
from cocalib.option_changes import changes_from_tree
from cocalib.session import ClickPlaced, OptionsEdited, Step
from cocalib.session.file import step_json as forms
from cocalib.session.file.form_parts import StampForm
from cocalib.web.messages.lens_messages import LensRequest
from cocalib.web.messages.opening_messages import ChoicesWanted, FolderWanted, OpeningCommand, OpenWith, RecentForgotten
from cocalib.web.messages.proposal_messages import ProposingSwitch
from cocalib.web.messages.review_messages import ReviewRequest

MAX_TEXT_BYTES = 4 * 1024 * 1024
"""A longer message is refused without parsing; 10,000 clicks take about one megabyte."""

RequestNumber: TypeAlias = Annotated[int, Meta(ge=0, le=2**53 - 1)]
FrameIndex: TypeAlias = Annotated[int, Meta(ge=0, le=2**31 - 1)]


@dataclass(frozen=True, slots=True)
class Hello:
    """A page has opened: send it the recording and the view."""


@dataclass(frozen=True, slots=True)
class ViewWanted:
    """A page missed a change of the View: send it a whole one."""


@dataclass(frozen=True, slots=True)
class FrameWanted:
    """A page wants the picture of a frame.

    Attributes:
        index: of the frame.
        request: echoed in the picture's header; a newer request of the same page supersedes this one.
        playing: frames follow one another quickly.
        size: "half" is enough while playing; "rectified" is the whole picture without distortion.
    """

    index: int
    request: int
    playing: bool = False
    size: Literal["full", "half", "rectified"] = "full"


ReturnColour: TypeAlias = Literal["speed", "range", "doppler", "amplitude", "height"]


@dataclass(frozen=True, slots=True)
class CursorMoved:
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

    index: int
    playing: bool = False
    selected: str | None = None
    light: bool = False
    trail_s: float = 0.0
    colour: ReturnColour = "speed"
    whole: bool = False
    hidden: bool = False


Viewpoint: TypeAlias = Literal["behind", "above", "side"]


@dataclass(frozen=True, slots=True)
class ViewpointWanted:
    """A page wants another viewpoint for its 3D view.

    Attributes:
        viewpoint: behind, above or to the side of the radar.
    """

    viewpoint: Viewpoint


@dataclass(frozen=True, slots=True)
class ImportWanted:
    """A page read a file of clicks.

    Attributes:
        text: the file's content.
        name: the file's name, for error messages.
    """

    text: str
    name: str


@dataclass(frozen=True, slots=True)
class SnapWanted:
    """A page wants the reflector's apex near a pixel of a frame; nothing is changed.

    Attributes:
        image_time: stamp of the frame.
        pixel_px: column and row.
        id: of the click that stands there; None for the keyboard's cross, and for a new click.
        over_dwell: whether to average it over the frames of the placement, near the pixel.
    """

    image_time: TimeNs
    pixel_px: tuple[float, float]
    id: str | None = None
    over_dwell: bool = False


@dataclass(frozen=True, slots=True)
class BoxesWanted:
    """A page read a file of boxes.

    Attributes:
        content: of the file.
        name: its name.
    """

    content: bytes
    name: str


@dataclass(frozen=True, slots=True)
class FollowingStopped:
    """A page wants boxes to be followed no farther than they have been."""


Command: TypeAlias = (
    Step
    | Hello
    | ViewWanted
    | FrameWanted
    | CursorMoved
    | ViewpointWanted
    | ImportWanted
    | ReviewRequest
    | LensRequest
    | ProposingSwitch
    | SnapWanted
    | FollowingStopped
    | BoxesWanted
)


@dataclass(frozen=True, slots=True)
class Incoming:
    """A message from a page.

    Attributes:
        command: what it wants.
        request: the number to answer with; None when no answer is wanted.
    """

    command: Command | OpeningCommand
    request: int | None = None


class _Form(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A message of the page that is not a step."""


class HelloForm(_Form, frozen=True, tag="hello"):
    """A page has opened."""


class ViewForm(_Form, frozen=True, tag="view"):
    """A change of the View was missed."""


class FrameForm(_Form, frozen=True, tag="frame"):
    """The picture of a frame is requested; exactly one binary message answers, unless a newer request comes first."""

    index: FrameIndex
    request: RequestNumber
    playing: bool = False
    size: Literal["full", "half", "rectified"] = "full"


class CursorForm(_Form, frozen=True, tag="cursor"):
    """Another frame is shown."""

    index: FrameIndex
    playing: bool = False
    selected: Annotated[str, Meta(max_length=100)] | None = None
    light: bool = False
    trail_s: Annotated[float, Meta(ge=0, le=60)] = 0.0
    colour: ReturnColour = "speed"
    whole: bool = False
    hidden: bool = False


class ViewpointForm(_Form, frozen=True, tag="viewpoint"):
    """Another viewpoint is requested for the 3D view."""

    viewpoint: Viewpoint


class ImportForm(_Form, frozen=True, tag="import_clicks"):
    """A file of clicks was read."""

    text: str
    name: Annotated[str, Meta(max_length=300)] = "the file"


class SnapForm(_Form, frozen=True, tag="snap_wanted"):
    """The reflector's apex near a pixel is requested; one message `snapped` answers."""

    image_time: StampForm
    pixel_px: forms.PixelForm
    id: forms.ClickId | None = None
    over_dwell: bool = False


class LoadBoxesForm(_Form, frozen=True, tag="load_boxes"):
    """A file of boxes was read; they take the place of all boxes."""

    name: Annotated[str, Meta(max_length=300)]
    content_base64: str


class StopFollowingForm(_Form, frozen=True, tag="stop_following"):
    """Boxes are to be followed no farther."""


OpeningForm: TypeAlias = ChoicesWanted | FolderWanted | RecentForgotten | OpenWith
MessageForm: TypeAlias = (
    forms.StepForm
    | HelloForm
    | ViewForm
    | FrameForm
    | CursorForm
    | ViewpointForm
    | ImportForm
    | ReviewRequest
    | LensRequest
    | ProposingSwitch
    | SnapForm
    | StopFollowingForm
    | LoadBoxesForm
    | OpeningForm
)


_TYPES = {str(form.__struct_config__.tag): form for form in get_args(MessageForm)}


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
        fields = msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
        raise InputError(f"the message is not JSON: {error}") from error
    kind = _kind(fields)
    request = None if kind == "frame" else fields.pop("request", None)
    try:
        form = msgspec.convert(fields, _TYPES[kind])
        return Incoming(_command(form), msgspec.convert(request, RequestNumber | None))
    except msgspec.ValidationError as error:
        raise InputError(f"invalid message '{kind}': {error}") from error


def request_of(text: str | bytes) -> int | None:
    """Return the request number of a message that `parse` refused; None if it has none that can be read."""
    try:
        return msgspec.json.decode(text[:MAX_TEXT_BYTES], type=_Envelope).request
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
        return None


def is_about_opening(text: str | bytes) -> bool:
    """Return whether a message that `parse` refused was about the choice of a recording."""
    try:
        kind = msgspec.json.decode(text[:MAX_TEXT_BYTES], type=_Named).type
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
        return False
    return kind in _TYPES and issubclass(_TYPES[kind], OpeningCommand)


def _kind(fields: object) -> str:
    if not isinstance(fields, dict):
        raise InputError('the message is not a JSON object; expected one with a "type"')
    kind = fields.get("type")
    if isinstance(kind, str) and kind in _TYPES:
        return kind
    near = difflib.get_close_matches(str(kind)[:80], _TYPES, n=1)
    advice = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(_TYPES)}"
    raise InputError(f"unknown message type '{str(kind)[:80]}'; {advice}")


@singledispatch
def _command(form: Any) -> Command | OpeningCommand:
    return forms.step_from_form(form)


@_command.register
def _options(form: forms.OptionsChangedForm) -> Command:
    return OptionsEdited(changes_from_tree(form.options))


@_command.register
def _placed(form: forms.ClickPlacedForm) -> Command:
    step = forms.step_from_form(form)
    return replace(step, mark=step.mark or "clicked") if isinstance(step, ClickPlaced) else step


@_command.register
def _mapped(form: forms.ColumnsMappedForm) -> Command:
    raise InputError("the columns of the radar are given when the recording is opened, with --map")


@_command.register
def _hello(form: HelloForm) -> Command:
    return Hello()


@_command.register
def _view(form: ViewForm) -> Command:
    return ViewWanted()


@_command.register
def _frame(form: FrameForm) -> Command:
    return FrameWanted(form.index, form.request, form.playing, form.size)


@_command.register
def _cursor(form: CursorForm) -> Command:
    return CursorMoved(
        form.index, form.playing, form.selected, form.light, form.trail_s, form.colour, form.whole, form.hidden
    )


@_command.register
def _viewpoint(form: ViewpointForm) -> Command:
    return ViewpointWanted(form.viewpoint)


@_command.register
def _review(form: ReviewRequest) -> Command:
    return form


@_command.register
def _lens(form: LensRequest) -> Command:
    return form


@_command.register
def _propose(form: ProposingSwitch) -> Command:
    return form


@_command.register
def _import(form: ImportForm) -> Command:
    return ImportWanted(form.text, form.name)


@_command.register
def _snap(form: SnapForm) -> Command:
    return SnapWanted(form.image_time.stamp.time, form.pixel_px, form.id, form.over_dwell)


@_command.register
def _load_boxes(form: LoadBoxesForm) -> Command:
    try:
        return BoxesWanted(base64.b64decode(form.content_base64, validate=True), form.name)
    except binascii.Error as error:
        raise InputError(f"{form.name}: was not sent as base64: {error}") from None


@_command.register
def _stop_following(form: StopFollowingForm) -> Command:
    return FollowingStopped()


@_command.register
def _opening(form: OpeningCommand) -> OpeningCommand:
    return form
