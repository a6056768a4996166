"""The commands, in one table: what the overview prints, what may be typed, and where each is written.

A test compares every summary with the first sentence of the command's own docstring.
"""

import importlib
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, cast

__all__ = ["COMMANDS", "PROGRAM", "Command", "Runnable", "overview"]

PROGRAM = "cocalib"
_DESCRIPTION = "Radar-camera calibration: click the corner reflector, get camera_from_radar and how far to trust it."
_WIDTH = 80


class Runnable(Protocol):
    """A command whose arguments are read."""

    def run(self) -> int:
        """Do what was asked for; return the exit code."""
        ...


@dataclass(frozen=True, slots=True)
class Command:
    """One command.

    Attributes:
        name: as it is typed.
        where: its module and class, such as "app.cli.info:Info"; imported only when this command is typed.
        summary: the first paragraph of the class's docstring, in one line.
    """

    name: str
    where: str
    summary: str

    def load(self) -> type[Runnable]:
        """Import the command's class."""
        module, _, name = self.where.partition(":")
        return cast(type[Runnable], getattr(importlib.import_module(module), name))


COMMANDS: Mapping[str, Command] = {
    command.name: command
    for command in (
        Command("demo", "app.cli.open:Demo", "Open the sample recording in the browser."),
        Command("open", "app.cli.open:Open", "Calibrate your own recording in the browser."),
        Command(
            "info",
            "app.cli.info:Info",
            "Say what a recording holds: files, topics, types, rates, stamps, overlap, camera, warnings.",
        ),
        Command(
            "solve",
            "app.cli.solve:Solve",
            "Solve a calibration from a recording and its clicks, or from a file of pairs.",
        ),
        Command(
            "export",
            "app.cli.export:Export",
            "Write a calibration as another stack reads it; `--to list` names the formats.",
        ),
        Command(
            "check",
            "app.cli.export:Check",
            "Read a calibration back, say what is wrong with it, or compare two. "
            "Exit code 1: wrong; 3: looks wrong, not proven.",
        ),
        Command(
            "import",
            "app.cli.import_file:Import",
            "Turn a calibration of any known format into cocalib/calibration-1 JSON.",
        ),
        Command(
            "video",
            "app.cli.video:Video",
            "Write the camera's frames into a video, each at its recorded time; recorded JPEG is not encoded again.",
        ),
        Command(
            "simulate",
            "app.cli.simulate:Simulate",
            "Record a scene that was never there: radar, camera, and the truth about both (truth.json).",
        ),
    )
}


def overview() -> str:
    """Return what `cocalib --help` prints."""
    lines = [
        f"usage: {PROGRAM} COMMAND ...",
        "",
        *textwrap.wrap(_DESCRIPTION, _WIDTH),
        "",
        "commands:",
        *_columns({command.name: command.summary for command in COMMANDS.values()}),
        "",
        "options:",
        *_columns({"-h, --help": "Show this; after a command, its arguments.", "--version": "Print the version."}),
    ]
    return "\n".join(lines)


def _columns(rows: Mapping[str, str]) -> Iterator[str]:
    """Lay out names and what they mean, the meaning wrapped in a column of its own."""
    width = max(map(len, rows)) + 4
    for name, text in rows.items():
        indent = f"{f'  {name}':<{width}}"
        yield from textwrap.wrap(text, _WIDTH, initial_indent=indent, subsequent_indent=" " * width)
