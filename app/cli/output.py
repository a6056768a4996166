"""Shared by the commands: reading and writing files, required intrinsics, progress."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from app import whole_file
from app.terminal import terminal_stream
from calib_core.errors import InputError
from calib_core.input_files import file_text, read_input

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.interchange import CameraFile
    from calib_core.measurements import ReflectorClick, TimeNs, Unsolvable
    from calib_core.recordings import Recording

__all__ = [
    "explain_unsolvable",
    "progress_bar",
    "read_text",
    "required_camera",
    "seconds_text",
    "told_clicks_at_frames",
    "write_whole",
]

_MAX_TEXT_BYTES = 64 * 1024 * 1024


def explain_unsolvable(outcome: "Unsolvable", *, what: str = "no calibration") -> int:
    """Print to stderr why there is no calibration, what would help, and which clicks are unpaired; return 1.

    Args:
        outcome: of the solver, or of the search for proposals.
        what: is missing.
    """
    from app.view import sentence

    print(f"cocalib: {what}: {sentence(outcome.reason)} {sentence(outcome.hint)}", file=sys.stderr)
    for click in outcome.unpaired:
        print(f"  click {click.id}: {sentence(click.reason)} {sentence(click.hint)}", file=sys.stderr)
    return 1


def read_text(path: Path) -> str:
    """Read a text file.

    Raises:
        InputError: it is missing, a folder, a pipe or a device, unreadable, too large or not text.
    """
    try:
        return file_text(read_input(path, max_bytes=_MAX_TEXT_BYTES, is_what="a file of clicks or pairs"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {(error.strerror or str(error)).lower()}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file (byte {error.start} is not UTF-8)") from error


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file atomically: a reader finds the old or the new content, never a part.

    Raises:
        InputError: the folder is missing or not writable.
    """
    try:
        whole_file.write_whole(path, content.encode("utf-8") if isinstance(content, str) else content)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {(error.strerror or str(error)).lower()}") from error


def required_camera(recording: "Recording", camera_file: "CameraFile | None") -> "Camera":
    """Return the intrinsics: from the file if one is given, else from the recording.

    Raises:
        InputError: there are none.
    """
    from app.solving import camera_for, intrinsics_near

    camera = camera_for(recording, camera_file)
    if camera is None:
        found = (
            f"{recording.camera_info_topic} has none that can be used"
            if recording.camera_info_topic
            else "it has no CameraInfo topic"
        )
        near = intrinsics_near(recording.paths)
        raise InputError(
            f"{recording.paths[0].name}: no intrinsics for {recording.image_topic}: {found}; "
            "give them with --camera FILE (ROS camera_info YAML, OpenCV YAML or XML, Kalibr camchain, JSON)"
            + (f", such as --camera {near}" if near else "")
            + "; or calibrate the lens from pictures of a board: cocalib intrinsics --help"
        )
    return camera


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar on stderr; nothing if stderr is not a terminal.

    Args:
        label: what is being done.

    Yields:
        a function that takes the amount done and the total.
    """
    from rich.console import Console
    from rich.progress import Progress

    console = Console(file=terminal_stream(sys.stderr))
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(label, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def told_clicks_at_frames(
    clicks: "Sequence[ReflectorClick]", recording: "Recording", *, source: str
) -> "tuple[ReflectorClick, ...]":
    """Move the clicks of a file to the nearest frames, and print to stderr which ones had the stamp of no frame.

    Raises:
        InputError: a click is far from every frame.
    """
    from app.session.click_stamps import clicks_at_frames

    found = clicks_at_frames(clicks, recording.image_times, source=source)
    for line in found.moved:
        print(f"note: {line}", file=sys.stderr)
    return found.clicks


def seconds_text(time: "TimeNs") -> str:
    """Write a stamp as seconds with all its digits."""
    from calib_core.measurements import time_parts

    sec, nanosec = time_parts(time)
    return f"{sec}.{nanosec:09d} s"
