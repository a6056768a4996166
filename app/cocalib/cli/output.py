"""Shared by the commands: reading and writing files, what is printed to stderr, progress."""

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from calib_core.errors import InputError
from cocalib.platform import files
from cocalib.platform.terminal import terminal_stream

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.measurements import ReflectorClick, Unsolvable
    from calib_core.proposing import ViewProgress
    from calib_core.recordings import Recording
    from calib_core.words import OptionPart, Words


def explain_unsolvable(outcome: "Unsolvable", *, what: str = "no calibration") -> int:
    """Print to stderr why there is no calibration, what would help, and which clicks are unpaired; return 1.

    Args:
        outcome: of the solver, or of the search for proposals.
        what: is missing.
    """
    from calib_core.words import in_sentences

    print(f"cocalib: {what}: {on_terminal(in_sentences(outcome))}", file=sys.stderr)
    for click in outcome.unpaired:
        print(f"  click {click.id}: {on_terminal(in_sentences(click))}", file=sys.stderr)
    return 1


def on_terminal(said: "Words") -> str:
    """Return words for the terminal: options as the flags that set them."""
    return said.text(option=_flag)


_FLAGS = {
    "method": "--method",
    "radar_axes": "--radar-axes",
    "clock": "--clock",
    "solving.camera_position": "--camera-position-m",
}


def _flag(part: "OptionPart") -> str:
    value = part.value or "..."
    return f"{_FLAGS[part.option]} {value}" if part.option in _FLAGS else f"--set {part.option}={value}"


def write_whole(path: Path, content: str | bytes, *, again: bool = False) -> None:
    """Write a file atomically: a reader finds the old or the new content, never a part.

    Args:
        path: of the file.
        content: of it.
        again: it is a file that was read and changed: it keeps its mode and owner, and a read-only one is refused.

    Raises:
        InputError: the folder is missing or not writable, or holds a file of this name and of another kind.
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    try:
        if not again and path.is_file() and (old := path.read_bytes()) and _kind(old) != _kind(data):
            raise InputError(
                f"{path}: holds something else, which is not overwritten; choose another name, or remove it"
            )
        (files.rewrite_whole if again else files.write_whole)(path, data)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error


def refuse_input(out: Path | None, *inputs: Path | None) -> None:
    """Refuse an output that is one of the files that are read.

    Raises:
        InputError: it is.
    """
    if out and out.exists() and any(one and one.exists() and out.samefile(one) for one in inputs):
        raise InputError(f"{out}: is also an input, which is never changed; choose another name for --out")


def _kind(data: bytes) -> bytes:
    """Return what tells kinds of output apart: our JSON by its schema, our other texts by a word, the rest by how it begins."""
    if b"camera_matrix:" in data and b"camera_name:" in data:
        return b"camera_info"
    schema = re.search(rb'"schema": ?"(cocalib/[\w-]+)"', data[:200])
    return schema[1] if schema else b"cocalib" if b"cocalib" in data and b"\0" not in data else data[:4]


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
    from cocalib.session.click_stamps import clicks_at_frames

    found = clicks_at_frames(clicks, recording.image_times, source=source, others=recording.other_image_times)
    _tell_notes(found.notes)
    return found.clicks


def recorded_clicks(
    clicks: "Sequence[ReflectorClick]", recording: "Recording", camera: "Camera", *, source: Path
) -> "tuple[ReflectorClick, ...]":
    """Return the clicks of a file at the frames of a recording.

    Raises:
        InputError: a click is not of this recording.
    """
    from cocalib.solving.recorded_clicks import clicks_in_recording

    found = clicks_in_recording(clicks, recording, camera, source=source)
    _tell_notes(found.notes)
    return found.clicks


def tell_choices(recording: "Recording") -> None:
    """Print to stderr which radar and which camera are used and why, where there are several, and what is damaged."""
    for what, choice in (("radar", recording.radar_choice), ("camera", recording.image_choice)):
        if choice:
            print(f"{what}: {choice}", file=sys.stderr)
    from calib_core.words import told

    _tell_notes([str(told(warning).message) for warning in recording.damage])


def _tell_notes(notes: Sequence[str]) -> None:
    """Print what a user may want to know to stderr, a line for each."""
    for line in notes:
        print(f"note: {line}", file=sys.stderr)


@contextmanager
def shown_progress() -> "Iterator[Callable[[ViewProgress | str], None]]":
    """Show on stderr how far the search for proposals is: a bar on a terminal, else a line for each step."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(file=terminal_stream(sys.stderr))
    if not console.is_terminal:
        yield _tell_step
        return
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task("searching for proposals", total=None)

        def show(progress: "ViewProgress | str") -> None:
            if isinstance(progress, str):
                bar.update(task, description=progress)
            else:
                bar.update(task, description="looking at the pictures", completed=progress.done, total=progress.count)

        yield show


def _tell_step(progress: "ViewProgress | str") -> None:
    """Print the beginning of each step; of the pictures only the first and the last dwell."""
    if isinstance(progress, str):
        print(f"{progress} ...", file=sys.stderr, flush=True)
    elif progress.done in (1, progress.count):
        print(f"looking at the pictures: {progress.done} of {progress.count} placements", file=sys.stderr, flush=True)
