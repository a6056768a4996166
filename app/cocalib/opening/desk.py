"""Answers what pages ask about the choice of a recording, and takes the first answer to each question."""

import threading
from dataclasses import replace
from pathlib import Path

from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.interchange import CameraFile
from cocalib.opening.choice import Choice
from cocalib.opening.opened import Opened
from cocalib.opening.recent import RecentRecordings
from cocalib.opening.root_folder import RootFolder
from cocalib.solving.solving import camera_for, intrinsics_near
from cocalib.web.messages import (
    ChoicesWanted,
    DroppedFile,
    FolderWanted,
    OpeningChoices,
    OpeningCommand,
    OpenWith,
    Outgoing,
    RecentForgotten,
)


class OpeningDesk:
    """Knows what is open and what can be chosen. Used by the main thread and by those that answer pages.

    Attributes:
        chosen: set once a page has chosen; `take` clears it.
    """

    def __init__(self, recent: RecentRecordings, root: RootFolder | None) -> None:
        self.chosen = threading.Event()
        self._recent = recent
        self._root = root
        self._lock = threading.Lock()
        self._question = 0
        self._choices = OpeningChoices(0)
        self._choice: Choice | None = None
        self._opened: Opened | None = None
        self._session: Path | None = None
        self._next: Choice | None = None
        self._answer = ""
        self._asks = False

    def put(self, choices: OpeningChoices, choice: Choice | None, opened: Opened | None = None) -> OpeningChoices:
        """Ask a new question; return it as pages see it.

        Args:
            choices: what can be chosen.
            choice: what is open, or could not be opened; None if nothing has been chosen.
            opened: the open recording with its session; None if none is.
        """
        with self._lock:
            self._question += 1
            self._asks = True
            self._choices, self._choice, self._opened = choices, choice, opened
            return self._current()

    def take(self) -> Choice:
        """Return what a page has chosen; it must have."""
        with self._lock:
            assert self._next is not None
            chosen, self._next = self._next, None
            self._opened = None
            self._asks = False
            self.chosen.clear()
            return chosen

    def answer(self, command: OpeningCommand) -> Outgoing | None:
        """Answer a page.

        Raises:
            InputError: it cannot be done; nothing changed.
            OSError: the list of recent recordings cannot be removed.
        """
        if isinstance(command, OpenWith):
            self._take_answer(command)
            return None
        if isinstance(command, FolderWanted):
            return self._root_folder().listing(command.path)
        if isinstance(command, RecentForgotten):
            self._recent.forget()
        elif not isinstance(command, ChoicesWanted):
            raise InputError("this message cannot be answered")
        with self._lock:
            return self._current()

    def _current(self) -> OpeningChoices:
        root = "" if self._root is None else name_text(self._root.path)
        session = self._choices.session
        if self._opened is not None:
            session = replace(session, clicks=len(self._opened.workspace.session.clicks))
        return replace(self._choices, question=self._question, session=session, recent=self._recent.rows(), root=root)

    def _root_folder(self) -> RootFolder:
        if self._root is None:
            raise InputError("no folder can be browsed in the page; start cocalib open with --root FOLDER")
        return self._root

    def _take_answer(self, command: OpenWith) -> None:
        with self._lock:
            if command.answer == self._answer:
                return  # sent again after a lost connection
            if not self._asks or command.question != self._question or self._next is not None:
                raise InputError(
                    "this question has been answered already, in another tab or window; what was chosen there is being opened"
                )
            self._next = self._chosen_by(command)
            self._answer = command.answer
            self.chosen.set()

    def _chosen_by(self, command: OpenWith) -> Choice:
        """Return what a page wants to open, checked as far as it can be without opening it.

        Raises:
            InputError: it cannot be opened.
        """
        if command.recent:
            paths = self._recent.paths_of(command.recent)
            if not paths:
                raise InputError("this recording is not there any more; choose another one")
            return Choice(paths)
        if command.paths:
            root = self._root_folder()
            return Choice(root.recordings(command.paths), below=root.path)
        if self._choice is None:
            raise InputError("no recording has been chosen; choose one from the list")
        camera_file = self._camera_file(command, self._choice)
        same_frames = command.image_topic == self._choice.topics.image_topic
        if camera_file is not None and self._opened is not None and same_frames:
            camera_for(self._opened.recording, camera_file)  # refused while everything is still open
        folder = self._choices.session.folder
        return self._choice.read_as(command, camera_file, Path(folder) if folder else None)

    def _camera_file(self, command: OpenWith, choice: Choice) -> CameraFile | None:
        if command.intrinsics == "keep":
            return choice.camera_file
        if command.intrinsics == "recorded":
            return None
        if command.intrinsics == "near":
            near = intrinsics_near(choice.paths)
            if near is None:
                raise InputError("there is no file of intrinsics next to the recording any more; drop one on the page")
            return CameraFile.read(near)
        if command.file is None:
            raise InputError("no file of intrinsics was sent; drop one on the page")
        return _dropped(command.file)


def _dropped(file: DroppedFile) -> CameraFile:
    """Take a file that was dropped on the page; it is checked to be a camera's here, and its size against the frames later."""
    name = name_text(file.name.replace("\\", "/").rpartition("/")[2]) or "the file"
    dropped = CameraFile(name, file.data, file.camera or None)
    if not file.data:
        raise InputError(f"{name}: is empty; drop the file of intrinsics")
    return dropped
