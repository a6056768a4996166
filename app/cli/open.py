"""`cocalib open`: calibrate in the browser."""

import contextlib
import dataclasses
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from time import sleep
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.flags import File, Folder, Switch
from app.cli.import_file import camera_in, reference_from
from app.cli.output import read_text, required_camera, told_clicks_at_frames
from app.cli.recording_flags import CameraPosition, MeasuredCamera, Options, Recordings, TopicFlags, Topics
from app.cli.serving_flags import ServingFlags
from app.web.port.link import Link
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.options import CalibrationOptions
from calib_core.recordings import AwaitedRecording, Recording, RecordingOptions

if TYPE_CHECKING:
    from app.session.file import FoundFolder
    from app.web.port.serving import Service
    from app.workspace import Workspace

__all__ = ["Open", "serve"]

_RECORDING_SUFFIXES = (".bag", ".mcap", ".db3")
_LARGE_BYTES = 1_000_000_000
"""If the files are this large in total, the page is served before they are opened."""
_LOOK_EVERY_S = 0.2
_SOON_S = 0.2
"""Smaller files are usually open within this time, and the page then shows no waiting screen [s]."""


@dataclass(frozen=True, slots=True)
class Open:
    """Calibrate your own recording in the browser."""

    recording: Recordings
    """Bags (.bag, .mcap, .db3, folders), or folders of pictures, radar CSV, videos; several are read as one recording."""
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
    measured: CameraPosition = field(default_factory=MeasuredCamera)
    topics: Topics = field(default_factory=TopicFlags)
    options: Options = field(default_factory=CalibrationOptions)
    serving: Annotated[ServingFlags, tyro.conf.arg(name="")] = field(default_factory=ServingFlags)

    def run(self) -> int:
        """Serve until Ctrl+C, SIGTERM or SIGHUP; return the exit code."""
        from app.resources import check_installation
        from app.session.file import recording_session_folder
        from calib_core.recordings import require_files

        paths = self.recording if self.follow and self.recording else require_files(self.recording)
        check_installation()
        with contextlib.closing(self.serving.link(self.session or recording_session_folder(paths))) as link:
            return serve(
                paths,
                session=self.session,
                fresh=self.fresh,
                link=link,
                name=name_text(paths[0].name),
                camera_file=self.camera,
                clicks_file=self.clicks,
                calibration_file=self.calibration,
                topics=self.topics,
                options=self.measured.over(self.options),
                follow=self.follow,
            )


def serve(
    paths: Sequence[Path],
    *,
    session: Path | None,
    fresh: Switch,
    link: Link,
    name: str,
    camera_file: Path | None = None,
    clicks_file: Path | None = None,
    calibration_file: Path | None = None,
    topics: RecordingOptions | None = None,
    options: CalibrationOptions | None = None,
    follow: bool = False,
) -> int:
    """Open everything, serve until Ctrl+C, SIGTERM or SIGHUP, close everything.

    Raises:
        CalibrationError: the recording, the intrinsics, the clicks or the session cannot be used.
    """
    from app.session import ClicksImported, OptionsChanged
    from app.session.file import recording_session_folder
    from app.view import sentence
    from app.workspace import open_workspace
    from calib_core.interchange import read_clicks
    from calib_core.recordings import open_recording

    _require_given(camera_file, calibration_file, clicks_file)
    admissions = session or recording_session_folder(paths)
    topics = _with_remembered(topics or RecordingOptions(), admissions, fresh=fresh)
    awaited = AwaitedRecording(paths, topics) if follow else None
    with _service(paths, topics, link, name, follow=follow) as service, ExitStack() as stack:
        opened = (
            _awaited(awaited, service, name)
            if awaited is not None
            else open_recording(paths, topics, require=("radar",))
        )
        recording = stack.enter_context(opened)
        if not len(recording.image_times):
            _require_nothing_to_calibrate(recording, camera_file, calibration_file, clicks_file)
        if recording.radar_choice:
            print(f"radar: {recording.radar_choice}")
        camera = _camera(recording, camera_file, calibration_file)
        reference = reference_from(calibration_file, camera) if calibration_file and camera else None
        found = _session_folder(session, paths, recording, name, fresh=fresh)
        workspace = open_workspace(
            recording, camera=camera, session_folder=found.path, name=name, reference=reference, warnings=found.warnings
        )
        stack.push(partial(_close, workspace))
        _remember(workspace, recording)
        for warning in workspace.restored.warnings:
            print(f"{sentence(warning.message)} {sentence(warning.hint)}")
        if options is not None and options != CalibrationOptions():
            workspace.dispatch(OptionsChanged(options))
        if clicks_file is not None and workspace.restored.steps == 0:
            clicks = read_clicks(read_text(clicks_file), source=str(clicks_file))
            workspace.dispatch(ClicksImported(told_clicks_at_frames(clicks, recording, source=str(clicks_file))))
        elif clicks_file is not None:
            print(f"Continuing the existing session; {clicks_file} was not imported (start over with --fresh)")
        service.serve(workspace, recording)
        closed = workspace.close()
    with contextlib.suppress(OSError):  # the terminal may be gone
        print(f"\nStopped; {closed.note}." if workspace.facts.has_pictures else "\nStopped.")
    return 0


def _awaited(awaited: AwaitedRecording, service: "Service", name: str) -> Recording:
    """Wait until there is enough of a recording that is being written, telling the terminal and the pages what is missing.

    Raises:
        RecordingError: the recording cannot be followed.
    """
    told = ""
    try:
        while (recording := awaited.look()) is None:
            if awaited.missing != told:
                told = awaited.missing
                service.tell(f"Waiting for {name}: {told}…")
            sleep(_LOOK_EVERY_S)
    except BaseException:
        awaited.close()
        raise
    return recording


def _session_folder(
    session: Path | None, paths: Sequence[Path], recording: Recording, name: str, *, fresh: bool
) -> "FoundFolder":
    """Return the given session folder, or the one of this recording; with `fresh`, an existing one is renamed first."""
    from app.session.file import FoundFolder, find_session_folder, recording_session_folder, set_aside
    from app.workspace import recording_facts

    if not fresh:
        return FoundFolder(session) if session else find_session_folder(paths, recording_facts(recording, name))
    folder = session or recording_session_folder(paths)
    if (kept := set_aside(folder)) is not None:
        print(f"The previous session is kept in {kept}")
    return FoundFolder(folder)


def _close(workspace: "Workspace", kind: type[BaseException] | None, *_: object) -> None:
    """Close the workspace; if an error ends the program, print whether the clicks are where they should be."""
    closed = workspace.close()
    if kind is not None and closed.fault:
        print(f"cocalib: {closed.note}", file=sys.stderr)


def _with_remembered(topics: RecordingOptions, session: Path, *, fresh: Switch) -> RecordingOptions:
    """Return the options with the --map that the session was last opened with, unless the user gives another one."""
    from app.session.file import remembered_map

    if topics.map or fresh:
        return topics
    found = remembered_map(session)
    if found:
        print(f"Reading the radar as before in this session: {' '.join(f'--map {one}' for one in found)}")
    return dataclasses.replace(topics, map=found)


def _remember(workspace: "Workspace", recording: Recording) -> None:
    """Keep in the session how the recording is read and what was confirmed about it.

    A session found under another name may have a --map that was not known when its recording was opened: it is named and kept.
    """
    from app.session import AssumptionsConfirmed, ColumnsMapped

    before = workspace.session.column_map
    if before and not recording.column_map:
        words = " ".join(f"--map {one}" for one in before)
        print(f"In this session the radar was read with {words}; open it again with that")
    else:
        workspace.dispatch(ColumnsMapped(recording.column_map))
    sure = tuple(one.assumption.words for one in recording.stated_assumptions if one.confirmed)
    if sure:
        workspace.dispatch(AssumptionsConfirmed(sure))


def _service(paths: Sequence[Path], topics: RecordingOptions, link: Link, name: str, *, follow: bool) -> "Service":
    """Return the service; it serves the page of a large recording before the recording is open."""
    from app.web.messages import Opening
    from app.web.port.serving import Service
    from calib_core.recordings import first_picture

    size_bytes = sum(map(_size_bytes, paths))
    size = f" ({size_bytes / 1e9:.1f} GB)" if size_bytes >= _LARGE_BYTES / 10 else ""
    return Service(
        link,
        Opening(name, f"Waiting for {name}…" if follow else f"Opening {name}{size}: reading its index and times…"),
        partial(first_picture, () if follow else paths, topics),
        let_in_after_s=0.0 if follow or size_bytes >= _LARGE_BYTES else _SOON_S,
    )


def _size_bytes(path: Path) -> int:
    """Return the size of a file, or of the recording files in a folder; 0 if that is unknown."""
    try:
        if path.is_dir():
            return sum(inside.stat().st_size for inside in path.iterdir() if inside.suffix in _RECORDING_SUFFIXES)
        return path.stat().st_size
    except OSError:  # opening the recording reports the error
        return 0


def _require_given(*files: Path | None) -> None:
    """Refuse missing files before anything is read or served.

    Raises:
        InputError: a file is missing.
    """
    for path in files:
        if path is not None and not path.exists():
            raise InputError(f"{path}: no such file; check the path")


def _require_nothing_to_calibrate(recording: Recording, *files: Path | None) -> None:
    """Say that there is no camera; refuse files that need one.

    Raises:
        InputError: a file of intrinsics, of a calibration or of clicks was given.
    """
    name, found = recording.paths[0].name, _unusable_pictures(recording)
    needless = [path for path in files if path is not None]
    if needless:
        raise InputError(
            f"{name}: no pictures{found}, so {needless[0]} cannot be used; give the camera's recording as well"
        )
    print(f"{name}: no pictures{found}: showing the radar only. To calibrate, give the camera's recording as well.")


def _unusable_pictures(recording: Recording) -> str:
    """Return which image topics cannot be used and why, in brackets; "" if there are none."""
    problems = [
        f"{topic.name}: {topic.problem or 'has no messages'}" for topic in recording.topics if topic.kind == "image"
    ]
    return f" ({'; '.join(problems)})" if problems else ""


def _camera(recording: Recording, camera_file: Path | None, calibration_file: Path | None) -> Camera | None:
    """Return the intrinsics: from the file, else from the recording, else from the calibration to show; None without pictures.

    Raises:
        InputError: there are none.
    """
    if not len(recording.image_times):
        return None
    if camera_file is None and calibration_file is not None and recording.camera() is None:
        picture = recording.image_bytes(0)
        found = camera_in(calibration_file, picture.width_px, picture.height_px)
        if found is not None:
            return found
    return required_camera(recording, camera_file)
