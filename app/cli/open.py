"""`cocalib demo` and `cocalib open`: calibrate in the browser."""

import hashlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from app.cli.flags import File, Folder, Switch, called
from app.cli.output import read_text
from app.cli.recording_flags import CameraPosition, MeasuredCamera, Options, Recordings, TopicFlags, Topics
from calib_core.errors import InputError
from calib_core.options import CalibrationOptions

if TYPE_CHECKING:
    from app.opening import Choice

__all__ = ["Demo", "Open"]


@dataclass(frozen=True, slots=True)
class ServingFlags:
    """Where to serve the page."""

    host: Annotated[str, tyro.conf.arg(metavar="ADDRESS")] = "127.0.0.1"
    """Address to bind; any other than loopback admits other machines, which then need the token."""
    port: int = 8080
    """Port; if it is taken, the next free one; 0 for any free port."""
    token: Annotated[str | None, called("TOKEN")] = None
    """Token that the link must contain, 8 characters or more, 16 for other machines; generated and printed if omitted."""
    socket: Annotated[Path | None, called("PATH")] = None
    """Serve on a Unix socket that only you can reach, for shared robots; the ssh command that forwards it is printed."""
    no_browser: Switch = False
    """Print the link, do not open a browser."""
    on_problem: Annotated[Literal["ask", "exit"] | None, called()] = None
    """What to do if the recording cannot be opened: ask in the page, or exit with code 2; by default ask, but exit
    with --no-browser if the output is no terminal, as in scripts."""


@dataclass(frozen=True, slots=True)
class Demo:
    """Open the sample recording in the browser."""

    session: Folder = None
    """Session folder; by default, one in your user folder that is kept between runs."""
    fresh: Switch = False
    """Start without the previous clicks (a backup is kept)."""
    serving: Annotated[ServingFlags, tyro.conf.arg(name="")] = field(default_factory=ServingFlags)

    def run(self) -> int:
        """Serve until Ctrl+C, SIGTERM or SIGHUP; return the exit code."""
        from app.opening import Choice
        from app.resources import sample_folder
        from app.session.file import user_session_folder

        sample = sample_folder() / "rooftop"
        bags = (sample / "radar.bag", sample / "camera.bag")
        choice = Choice(
            bags,
            "the sample recording",
            session=self.session or user_session_folder(f"demo-{_digest(bags)}"),
            fresh=self.fresh,
            is_sample=True,
        )
        return _serve(choice, self.serving)


def _digest(files: Sequence[Path]) -> str:
    """Return a short hash that identifies the version of the sample: a session belongs to one recording."""
    content = hashlib.sha256()
    for file in files:
        content.update(file.read_bytes())
    return content.hexdigest()[:8]


@dataclass(frozen=True, slots=True)
class Open:
    """Calibrate your own recording in the browser."""

    recording: Recordings
    """Bags (.bag, .mcap, .db3, folders), or folders of pictures, radar CSV, videos; several are read as one recording.
    Without one, it is chosen in the page."""
    camera: File = None
    """Intrinsics to use if the recording has none, or instead of its own: camera_info YAML, OpenCV YAML/XML, Kalibr, JSON."""
    calibration: File = None
    """A calibration to show, in any format: drawn until the clicks give a new one, then compared with it."""
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
    measured: CameraPosition = field(default_factory=MeasuredCamera)
    topics: Topics = field(default_factory=TopicFlags)
    options: Options = field(default_factory=CalibrationOptions)
    serving: Annotated[ServingFlags, tyro.conf.arg(name="")] = field(default_factory=ServingFlags)

    def run(self) -> int:
        """Serve until Ctrl+C, SIGTERM or SIGHUP; return the exit code."""
        from app.opening import Choice, GivenClicks
        from calib_core.interchange import CameraFile
        from calib_core.recordings import require_files

        if not self.recording:
            return _serve(None, self.serving, self.root)
        paths = self.recording if self.follow else require_files(self.recording)
        _require_given(self.camera, self.calibration, self.clicks)
        choice = Choice(
            paths,
            topics=self.topics,
            camera_file=None if self.camera is None else CameraFile.read(self.camera),
            calibration_file=self.calibration,
            clicks=None if self.clicks is None else GivenClicks(read_text(self.clicks), str(self.clicks)),
            options=self.measured.over(self.options),
            session=self.session,
            fresh=self.fresh,
            follow=self.follow,
        )
        return _serve(choice, self.serving, self.root)


def _serve(choice: "Choice | None", flags: ServingFlags, root: Path | None = None) -> int:
    """Check where to serve, then serve.

    Raises:
        CalibrationError: the address, the token or the folder cannot be used; or the recording, and nothing is to be asked.
    """
    from app.opening import Serving, serve
    from app.opening.root_folder import RootFolder
    from app.resources import check_installation
    from app.web.port.address import require_address, require_one_address, require_token
    from app.web.port.guard import is_loopback
    from app.web.port.server import ServerOptions

    check_installation()
    require_address(flags.host, flags.port)
    require_one_address(flags.socket, flags.host)
    require_token(flags.token, reachable=not is_loopback(flags.host))
    return serve(
        choice,
        Serving(
            ServerOptions(flags.host, flags.port, flags.token, flags.no_browser, socket=flags.socket),
            asks=_asks(flags),
            root=None if root is None else RootFolder(root),
        ),
    )


def _asks(flags: ServingFlags) -> bool:
    """Return whether a recording that cannot be opened leads to a question in the page, or ends the command."""
    if flags.on_problem is not None:
        return flags.on_problem == "ask"
    return not flags.no_browser or sys.stdout.isatty()


def _require_given(*files: Path | None) -> None:
    """Refuse missing files before anything is read or served.

    Raises:
        InputError: a file is missing.
    """
    for path in files:
        if path is not None and not path.exists():
            raise InputError(f"{path}: no such file; check the path")
