"""Shared by the commands: which files they read and write, what is printed to stderr, progress."""

import dataclasses
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calib_core.errors import InputError
from cocalib.cli.flags import INPUT, OUTPUT, OUTPUT_FOLDER, OutputFlags
from cocalib.platform import files
from cocalib.platform.terminal import terminal_stream

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.measurements import ReflectorClick, Unsolvable
    from calib_core.proposing import ViewProgress
    from calib_core.recordings import Recording
    from calib_core.words.text import OptionPart, Words


def explain_unsolvable(outcome: "Unsolvable", *, what: str = "no calibration") -> int:
    """Print to stderr why there is no calibration, what would help, and which clicks are unpaired; return 1.

    Args:
        outcome: of the solver, or of the search for proposals.
        what: is missing.
    """
    from calib_core.words.outcomes import by_cause, in_sentences
    from calib_core.words.text import listed

    print(f"cocalib: {what}: {on_terminal(in_sentences(outcome))}", file=sys.stderr)
    for ids, first in by_cause(outcome.unpaired):
        print(f"  {on_terminal(listed(ids))}: {on_terminal(in_sentences(first))}", file=sys.stderr)
    return 1


def on_terminal(said: "Words") -> str:
    """Return words for the terminal: options as the flags that set them."""
    return said.text(option=_flag)


_FLAGS = {
    "method": "--method",
    "radar_axes": "--radar-axes",
    "clock": "--clock",
    "radar_late": "--radar-late",
    "radar_frame": "--radar-frame",
    "radar_mount": "--radar-mount",
    "solving.camera_position": "--camera-position-m",
}


def _flag(part: "OptionPart") -> str:
    value = part.value or "..."
    return f"{_FLAGS[part.option]} {value}" if part.option in _FLAGS else f"--set {part.option}={value}"


@contextmanager
def kept_inputs(command: object) -> Iterator[None]:
    """Keep what a command reads from being written over while it runs, and refuse what it may not write before it begins.

    Raises:
        InputError: an output is an input, a file of another program, or named twice.
    """
    named = list(_named_files(command))
    inputs = [one for path, mark in named if mark == INPUT for one in (path, Path(str(path).partition("#")[0]))]
    outputs = [path for path, mark in named if mark == OUTPUT or (mark == OUTPUT_FOLDER and not _may_be_folder(path))]
    output: OutputFlags = getattr(command, "output", OutputFlags())
    with files.keeping(inputs, force=output.force):
        for path in outputs:
            files.require_writable(path)
        if twice := next((path for path in outputs if outputs.count(path) > 1), None):
            raise InputError(f"{twice}: is named for two outputs; give each a name of its own")
        yield


def _may_be_folder(path: Path) -> bool:
    return path.is_dir() or not os.path.lexists(path)


def _named_files(flags: Any) -> Iterator[tuple[Path, str]]:
    """Yield the files that flags name, each with its mark; what has none is read."""
    for flag in dataclasses.fields(flags):
        value, marks = getattr(flags, flag.name), getattr(flag.type, "__metadata__", ())
        mark = next((mark for mark in (INPUT, OUTPUT, OUTPUT_FOLDER) if mark in marks), None)
        if dataclasses.is_dataclass(value):
            yield from _named_files(value)
        for each in value if isinstance(value, tuple) else (value,):
            if isinstance(each, Path) or (mark and each is not None):
                yield Path(each), mark or INPUT


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

    frames = clicks_at_frames(clicks, recording.image_times, source=source, others=recording.other_image_times)
    _tell_notes(frames.notes)
    return frames.clicks


def recorded_clicks(
    clicks: "Sequence[ReflectorClick]", recording: "Recording", camera: "Camera", *, source: Path
) -> "tuple[ReflectorClick, ...]":
    """Return the clicks of a file at the frames of a recording.

    Raises:
        InputError: a click is not of this recording.
    """
    from cocalib.solving.recorded_clicks import clicks_in_recording

    frames = clicks_in_recording(clicks, recording, camera, source=source)
    _tell_notes(frames.notes)
    return frames.clicks


_OF_FRAMES = ("radar-in-vehicle-frame", "radar-looks-left")


def tell_choices(recording: "Recording", *, but: str = "") -> None:
    """Print to stderr which radar and which camera are used and why, where there are several, and what is wrong with them.

    Args:
        recording: that is used.
        but: the code of a warning that the verdict will say.
    """
    for what, choice in (("radar", recording.radar_choice), ("camera", recording.image_choice)):
        if choice:
            print(f"{what}: {choice}", file=sys.stderr)
    from calib_core.words.outcomes import in_sentences
    from calib_core.words.warnings import warning_remark

    doubted = [warning for warning in recording.warnings if warning.code in _OF_FRAMES and warning.code != but]
    _tell_notes(recording.radar_option_notes)
    _tell_notes([on_terminal(in_sentences(warning)) for warning in doubted])
    _tell_notes([str(warning_remark(warning).message) for warning in recording.damage])


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
                bar.update(task, description="looking at the images", completed=progress.done, total=progress.count)

        yield show


def _tell_step(progress: "ViewProgress | str") -> None:
    """Print the beginning of each step; of the images only the first and the last dwell."""
    if isinstance(progress, str):
        print(f"{progress} ...", file=sys.stderr, flush=True)
    elif progress.done in (1, progress.count):
        print(f"looking at the images: {progress.done} of {progress.count} placements", file=sys.stderr, flush=True)
