"""What is to be opened, and how: given on the command line, chosen in the page, or both."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, TypeAlias

from calib_core.errors import CalibrationError, InputError
from calib_core.input_files import name_text
from calib_core.interchange.cameras.files import CameraFile
from calib_core.options import CalibrationOptions
from calib_core.recordings import RecordingOptions
from cocalib.web.messages.opening_messages import OpenWith, SessionPlan

ChoicePart: TypeAlias = Literal["camera", "calibration", "clicks", "session"]
"""What is opened together with a recording, and can be left out."""


class UnusablePartError(InputError):
    """One part of a choice cannot be used; the recording may open without it.

    Attributes:
        part: which one.
    """

    def __init__(self, part: ChoicePart, words: str) -> None:
        super().__init__(words)
        self.part: ChoicePart = part


@contextlib.contextmanager
def part_of_choice(part: ChoicePart) -> Iterator[None]:
    """Say of an error in the `with` block which part of the choice it is about.

    Raises:
        UnusablePartError: in the words of the error.
    """
    try:
        yield
    except CalibrationError as error:
        raise UnusablePartError(part, str(error)) from error
    except OSError as error:
        words = f"{error.filename or 'a file'}: {error.strerror or error}"
        raise UnusablePartError(part, words) from error


@dataclass(frozen=True, slots=True)
class GivenClicks:
    """A file of clicks to start a new session with.

    Attributes:
        text: its content.
        source: its path, for messages.
    """

    text: str
    source: str


@dataclass(frozen=True, slots=True)
class MeaningPick:
    """What a person picked as the meaning of a calibration that does not state it.

    Attributes:
        meaning: the key of a hypothesis; "" if nothing was picked.
        place: of the pose in the file; "" for the only one.
    """

    meaning: str = ""
    place: str = ""


@dataclass(frozen=True, slots=True)
class Choice:
    """A recording, and how to open it.

    Attributes:
        paths: its files or folders, at least one.
        name: what to call it; by default, the name of the first.
        topics: how to read it.
        camera_file: the intrinsics; None to use the recording's own.
        calibration_file: a calibration to show; None for none.
        pick: what its numbers mean, if it does not say and a person picked it.
        clicks: to start a new session with.
        options: to set in the session; None to keep its own.
        session: its folder; None to find it.
        session_plan: continue the one with the same frames, start a new one, or start one with the clicks that fit.
        copy_from: the session whose clicks are copied, if they are.
        fresh: start without the previous clicks.
        follow: the recording is still being written.
        is_sample: it is the sample recording, which is not listed among the recent ones.
        below: the real folder that the paths must stay in; None if they were not chosen in the page's folders.
    """

    paths: tuple[Path, ...]
    name: str = ""
    topics: RecordingOptions = field(default_factory=RecordingOptions)
    camera_file: CameraFile | None = None
    calibration_file: Path | None = None
    pick: MeaningPick = MeaningPick()
    clicks: GivenClicks | None = None
    options: CalibrationOptions | None = None
    session: Path | None = None
    session_plan: SessionPlan = "continue"
    copy_from: Path | None = None
    fresh: bool = False
    follow: bool = False
    is_sample: bool = False
    below: Path | None = None

    @property
    def title(self) -> str:
        """What to call the recording."""
        return self.name or name_text(self.paths[0].name)

    def settled(self) -> "Choice":
        """Return the same choice after it was opened: what belongs to a new session has been done."""
        return replace(self, fresh=False, clicks=None, options=None, session_plan="continue", copy_from=None)

    def without(self, part: ChoicePart) -> "Choice":
        """Return the same recording without a part that cannot be used; opening it does not fail again for the same reason.

        A session that was not named but found next to the recording is left alone, and a new one is started.
        """
        if part == "camera":
            return replace(self, camera_file=None)
        if part == "calibration":
            return replace(self, calibration_file=None)
        if part == "clicks":
            return replace(self, clicks=None)
        if self.session is not None:
            return replace(self, session=None, session_plan="continue", copy_from=None)
        return replace(self, session_plan="new", copy_from=None)

    def read_as(self, command: OpenWith, camera_file: CameraFile | None, copy_from: Path | None) -> "Choice":
        """Return the same recording, read as a page wants it.

        Args:
            command: of the page.
            camera_file: the intrinsics that it chose.
            copy_from: the session that clicks are copied from.
        """
        radar, image = command.radar_topic, command.image_topic
        info = self.topics.camera_info_topic if image == self.topics.image_topic else None
        return replace(
            self,
            topics=replace(self.topics, radar_topic=radar, image_topic=image, camera_info_topic=info),
            camera_file=camera_file,
            pick=MeaningPick(command.meaning, command.meaning_place) if command.meaning else self.pick,
            session_plan=command.session,
            copy_from=copy_from if command.session == "copy" else None,
        )
