"""`cocalib open`: calibrate in the browser."""

import contextlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from calib_core.input_files import no_such, read_text
from calib_core.options import CalibrationOptions
from cocalib.cli.flags import MORE, File, Folder, Switch
from cocalib.cli.recording_flags import CameraFlags, GivenCamera, OptionFlags, Options, Recordings, TopicFlags, Topics
from cocalib.cli.serving_flags import ServingFlags

if TYPE_CHECKING:
    from cocalib.opening import Choice


@dataclass(frozen=True, slots=True)
class Open:
    """Calibrate your own recording in the browser."""

    NAMED = CalibrationOptions

    recording: Recordings
    """Bags (.bag, .mcap, .db3, folders), or folders of images, radar CSV, videos; several are read as one recording.
    Without one, it is chosen in the page."""
    camera: GivenCamera = field(default_factory=CameraFlags)
    calibration: File = None
    """Existing calibration (any format), shown until your clicks give a new one, then compared with it."""
    clicks: File = None
    """Clicks to start a new session with (cocalib/clicks-1 JSON)."""
    session: Folder = None
    """Session folder; by default the one with this recording's frames, next to it or in your user folder, else a new one."""
    fresh: Switch = False
    """Start without the previous clicks (a backup is kept)."""
    follow: Switch = False
    """Open a recording that is still being written (.bag, .mcap, .db3, folders): frames and placements appear as they come."""
    root: Folder = None
    """Folder in which recordings can be chosen in the page; none by default, so that only recent ones can be chosen."""
    topics: Topics = field(default_factory=TopicFlags)
    options: Options = field(default_factory=OptionFlags)
    serving: Annotated[ServingFlags, tyro.conf.arg(name=""), MORE] = field(default_factory=ServingFlags)

    def run(self) -> int:
        """Serve until Ctrl+C, SIGTERM or SIGHUP; return the exit code."""
        from calib_core.recordings import require_files
        from cocalib.opening import Choice, GivenClicks

        if not self.recording:
            return _serve(None, self.serving, self.root)
        paths = self.recording if self.follow else require_files(self.recording)
        _require_given(self.camera.camera, self.calibration, self.clicks)
        choice = Choice(
            paths,
            topics=self.topics,
            camera_file=self.camera.read(),
            calibration_file=self.calibration,
            clicks=None if self.clicks is None else GivenClicks(read_text(self.clicks), str(self.clicks)),
            options=self.options.all(),
            session=self.session,
            fresh=self.fresh,
            follow=self.follow,
        )
        return _serve(choice, self.serving, self.root)


def _serve(choice: "Choice | None", flags: ServingFlags, root: Path | None = None) -> int:
    """Serve from a link that is printed when the recording is open, or when that takes long.

    Raises:
        CalibrationError: the address, the token or the folder cannot be used; or the recording, and nothing is to be asked.
    """
    from cocalib.opening import Serving, serve
    from cocalib.opening.root_folder import RootFolder
    from cocalib.session.file.finding import recording_session_folder

    folder = None if root is None else RootFolder(root)
    if choice is None:
        served = f"choosing: {'no recording' if folder is None else folder.path}"
    else:
        served = str((choice.session or recording_session_folder(choice.paths)).absolute())
    with contextlib.closing(flags.link(served)) as link:
        return serve(choice, Serving(link, asks=flags.asks, root=folder))


def _require_given(*files: Path | None) -> None:
    """Refuse missing files before anything is read or served.

    Raises:
        InputError: a file is missing.
    """
    for path in files:
        if path is not None and not path.exists():
            raise InputError(no_such(path))
