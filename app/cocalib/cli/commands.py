"""The table of commands: each one's name, the summary that the overview prints, and the class that implements it.

A test compares every summary with the first sentence of the command's own docstring.
"""

import importlib
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, cast

from cocalib.cli.exit_codes import exit_codes

PROGRAM = "cocalib"
_DESCRIPTION = "Radar-camera calibration: click the corner reflector, get camera_from_radar and its uncertainty."
_WIDTH = 80


class Runnable(Protocol):
    """A command whose arguments have been parsed."""

    def run(self) -> int:
        """Run the command; return the exit code."""
        ...


@dataclass(frozen=True, slots=True)
class Command:
    """One command.

    Attributes:
        name: as typed.
        where: its module and class, such as "cocalib.cli.info:Info"; imported only when this command is used.
        summary: the first paragraph of the class's docstring, on one line.
        examples: what to type after its name, for the two most usual tasks.
    """

    name: str
    where: str
    summary: str
    examples: tuple[str, ...] = ()

    def load(self) -> type[Runnable]:
        """Import the command's class."""
        module, _, name = self.where.partition(":")
        return cast(type[Runnable], getattr(importlib.import_module(module), name))


COMMANDS: Mapping[str, Command] = {
    command.name: command
    for command in (
        Command("demo", "cocalib.cli.demo:Demo", "Open the sample recording in the browser."),
        Command(
            "open",
            "cocalib.cli.open:Open",
            "Calibrate your own recording in the browser.",
            (
                "radar.bag camera.bag",
                "drive.mcap --camera camera_info.yaml",
            ),
        ),
        Command(
            "info",
            "cocalib.cli.info:Info",
            "Show what a recording contains: files, topics, types, rates, stamps, overlap, camera, placements, warnings.",
            (
                "radar.bag camera.bag",
                "drive.mcap --verify",
            ),
        ),
        Command(
            "intrinsics",
            "cocalib.cli.intrinsics:Intrinsics",
            "Calibrate a camera's lens from images of a board, or convert a file with intrinsics.",
            (
                "drive.mcap --board 9x6 --square-mm 25 --out camera.yaml",
                "camera.yaml --to kalibr --out camchain.yaml",
            ),
        ),
        Command(
            "solve",
            "cocalib.cli.solve:Solve",
            "Compute a calibration from a recording and its clicks, or from a file of pairs.",
            (
                "drive.mcap --clicks clicks.json --out calibration.json",
                "--pairs pairs.csv --camera camera.yaml --out calibration.json",
            ),
        ),
        Command(
            "import",
            "cocalib.cli.import_file:Import",
            "Convert a calibration from any known format to cocalib/calibration-1 JSON.",
            (
                "old.yaml --camera camera.yaml --out calibration.json",
                "robot.urdf --camera camera.yaml --out calibration.json",
                "T_camera_lidar.txt T_radar_lidar.txt --camera camera.yaml",
            ),
        ),
        Command(
            "export",
            "cocalib.cli.export:Export",
            "Write a calibration in the format of another tool; `--to list` lists the formats.",
            (
                "calibration.json --to tf2",
                "calibration.json --into robot.urdf",
            ),
        ),
        Command(
            "check",
            "cocalib.cli.check:Check",
            "Check calibration files for errors, or compare them.",
            (
                "calibration.json",
                "calibration.json --against old.json",
            ),
        ),
        Command(
            "evaluate",
            "cocalib.cli.evaluate:Evaluate",
            "Evaluate a calibration on a recording: mean reprojection error (AED), share of returns in boxes (Acc); or a report.",
            (
                "calibration.json other.mcap",
                "calibration.json --report report.html --require max-deg=1",
            ),
        ),
        Command(
            "watch",
            "cocalib.cli.watch:Watch",
            "Watch whether camera or radar has turned since a baseline: by the still image, the still returns, and traffic.",
            (
                "calibration.json today.mcap --boxes moving",
                "calibration.json today.mcap --boxes /detections --json",
            ),
        ),
        Command(
            "show",
            "cocalib.cli.show:Show",
            "Show a recording with its calibration in Rerun, or write it to a file: .rrd, or a video.",
            (
                "drive.mcap --calibration calibration.json",
                "drive.mcap --calibration calibration.json --out overlay.mp4",
            ),
        ),
        Command(
            "batch",
            "cocalib.cli.batch:Batch",
            "Calibrate many sessions, finished ones are skipped; batch status: what came of each.",
            (
                "sessions.toml --out out --workers 8",
                "status out",
            ),
        ),
        Command(
            "session",
            "cocalib.cli.session:Session",
            "List the sessions of recordings, repair a damaged one, or export its clicks.",
            (
                "list",
                "repair drive.mcap --yes",
            ),
        ),
        Command(
            "simulate",
            "cocalib.cli.simulate:Simulate",
            "Simulate a recording: radar, camera, and the ground truth (truth.json).",
            (
                "--out somewhere",
                "--out somewhere --preset unkind --set placements=12",
            ),
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
        *_columns(
            {"-h, --help": "Show this help; after a command, show its options.", "--version": "Print the version."}
        ),
        "",
        *textwrap.wrap(exit_codes(), _WIDTH),
    ]
    return "\n".join(lines)


def _columns(rows: Mapping[str, str]) -> Iterator[str]:
    """Lay out names and their texts in two columns, with the texts wrapped."""
    width = max(map(len, rows)) + 4
    for name, text in rows.items():
        indent = f"{f'  {name}':<{width}}"
        yield from textwrap.wrap(text, _WIDTH, initial_indent=indent, subsequent_indent=" " * width)
