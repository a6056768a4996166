"""What a page says and sees while a recording is chosen: which one, how it is read, with which intrinsics and session."""

from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

MAX_CAMERA_FILE_BYTES = 512 * 1024
"""A file of intrinsics has a few kB; a larger one is refused before it is sent, and again when it arrives."""

Text: TypeAlias = Annotated[str, Meta(max_length=4096)]
SessionPlan: TypeAlias = Literal["continue", "new", "copy"]
IntrinsicsChoice: TypeAlias = Literal["keep", "recorded", "near", "file"]


class OpeningCommand(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A message about the choice of a recording. It is answered before one is open, too."""


class ChoicesWanted(OpeningCommand, frozen=True, tag="choices"):
    """A page asks what can be chosen."""


class FolderWanted(OpeningCommand, frozen=True, tag="folder"):
    """A page looks into a folder below the root folder, by its path from there; "" is the root itself."""

    path: Text = ""


class RecentForgotten(OpeningCommand, frozen=True, tag="forget_recent"):
    """The list of recent recordings is to be emptied."""


class DroppedFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file that was dropped on the page; its content is written in base 64."""

    name: Annotated[str, Meta(min_length=1, max_length=300)]
    data: Annotated[bytes, Meta(max_length=MAX_CAMERA_FILE_BYTES)]
    camera: Annotated[str, Meta(max_length=300)] = ""


class OpenWith(OpeningCommand, frozen=True, tag="open_with"):
    """A recording is to be opened, or opened again in another way.

    Attributes:
        question: number of the question that this answers; an older one has been answered already.
        answer: made up by the page: the same answer, sent again after a lost connection, is not a second one.
        recent: id of a recent recording; "" for another or the same recording.
        paths: of the files of a recording, from the root folder; empty for the same recording.
        radar_topic: None to choose automatically.
        image_topic: None to choose automatically.
        intrinsics: those in use, the recording's own, those of the file next to it, or those of `file`.
        file: a file of intrinsics.
        session: continue the one with the same frames, start a new one, or start one with the clicks that fit.
        meaning: what the numbers of the calibration to show mean, if it does not say: the key of a hypothesis; "" for as before.
        meaning_place: of these numbers in its file.
    """

    question: Annotated[int, Meta(ge=0, le=2**53 - 1)]
    answer: Annotated[str, Meta(min_length=1, max_length=100)]
    recent: Annotated[str, Meta(max_length=100)] = ""
    paths: Annotated[tuple[Text, ...], Meta(max_length=100)] = ()
    radar_topic: Text | None = None
    image_topic: Text | None = None
    intrinsics: IntrinsicsChoice = "keep"
    file: DroppedFile | None = None
    session: SessionPlan = "continue"
    meaning: Text = ""
    meaning_place: Text = ""


@dataclass(frozen=True, slots=True)
class TopicRow:
    """A radar or a camera that can be chosen.

    Attributes:
        value: what to send to choose it.
        about: counts, rate and figures.
        used: whether it is in use.
        problem: why it cannot be used; "" if it can.
    """

    value: str
    about: str
    used: bool
    problem: str = ""


@dataclass(frozen=True, slots=True)
class SessionOffer:
    """The session that an opening would continue, or could take clicks from.

    Attributes:
        folder: path on the server's machine; "" if there is none.
        clicks: how many it has.
        recording: what its recording was called.
        continues: whether it can be continued: it has the frames of this recording.
        plan: what is chosen unless the user chooses otherwise.
    """

    folder: str = ""
    clicks: int = 0
    recording: str = ""
    continues: bool = False
    plan: SessionPlan = "continue"


@dataclass(frozen=True, slots=True)
class RecentRecording:
    """A recording that was opened before and still exists.

    Attributes:
        id: to choose it by.
        name: of the recording.
        folder: where its first file is.
        opened_s: when it was opened last, in seconds since 1970.
        clicks: how many its session had then.
    """

    id: str
    name: str
    folder: str
    opened_s: int
    clicks: int


@dataclass(frozen=True, slots=True)
class OpeningChoices:
    """What can be chosen now.

    Attributes:
        question: to be named by the answer.
        name: of the recording; "" if none has been chosen.
        problem: why it cannot be opened as chosen; "" if it is open, or none has been chosen.
        is_open: whether it is open.
        radars: the radars, the one in use first.
        radar_reason: why this one is used; "" if there is no choice.
        cameras: the image topics.
        radar_topic: what was asked for; None if it was chosen automatically.
        image_topic: what was asked for; None if it was chosen automatically.
        intrinsics: where those in use come from; "" if there are none.
        intrinsics_file: whether those in use come from a file of intrinsics.
        recorded_intrinsics: whether the recording has its own.
        intrinsics_near: name of a file next to the recording that may hold intrinsics; "" if there is none.
        session: what can be continued or copied from.
        recent: the newest first.
        root: the folder that can be browsed; "" if none was given.
    """

    question: int
    name: str = ""
    problem: str = ""
    is_open: bool = False
    radars: tuple[TopicRow, ...] = ()
    radar_reason: str = ""
    cameras: tuple[TopicRow, ...] = ()
    radar_topic: str | None = None
    image_topic: str | None = None
    intrinsics: str = ""
    intrinsics_file: bool = False
    recorded_intrinsics: bool = False
    intrinsics_near: str = ""
    session: SessionOffer = SessionOffer()
    recent: tuple[RecentRecording, ...] = ()
    root: str = ""


@dataclass(frozen=True, slots=True)
class FolderEntry:
    """A recording or a folder below the root folder.

    Attributes:
        name: within the folder.
        path: from the root folder.
        kind: a folder can be looked into; a recording, which may be a folder, can be opened.
        size_bytes: of a file, or of the recording files in a folder.
    """

    name: str
    path: str
    kind: Literal["folder", "recording", "recording folder"]
    size_bytes: int


@dataclass(frozen=True, slots=True)
class FolderListing:
    """What is in a folder below the root folder.

    Attributes:
        path: of the folder, from the root folder; "" for the root itself.
        parent: of the folder above; None for the root.
        entries: folders first, by name.
        note: what is not listed, and why; "" if everything is.
    """

    path: str
    parent: str | None
    entries: tuple[FolderEntry, ...]
    note: str = ""
