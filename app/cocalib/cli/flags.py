"""Flags that several commands share, and the names of values in the help."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import tyro

from cocalib.cli.exit_codes import Required

MORE = "more"
"""Marks a flag, or a group of flags, that `--help all` shows, and `--help` does not."""


def called(metavar: str | None = None) -> object:
    """Name a value in the help, and omit its default: None or False would say nothing."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


def same(options: type[Any], name: str) -> Any:
    """Copy an option's default and text to a field of a subclass, which names the value in the help."""
    (found,) = (field for field in dataclasses.fields(options) if field.name == name)
    return dataclasses.field(default=found.default, metadata=found.metadata)


INPUT, OUTPUT, OUTPUT_FOLDER = "input", "output", "output folder"
"""Mark what a flag names: a file that is read, as every path without a mark; a file that is written; a folder for such files."""

File: TypeAlias = Annotated[Path | None, called("FILE")]
Folder: TypeAlias = Annotated[Path | None, called("FOLDER")]
OutFile: TypeAlias = Annotated[Path | None, called("FILE"), OUTPUT]
OutFolder: TypeAlias = Annotated[Path | None, called("FOLDER"), OUTPUT_FOLDER]
Switch: TypeAlias = Annotated[bool, called()]
MoreSwitch: TypeAlias = Annotated[bool, called(), MORE]
Require: TypeAlias = Annotated[Required | None, called("{good,usable}")]


@dataclass(frozen=True, slots=True)
class OutputFlags:
    """What an output may replace."""

    force: MoreSwitch = False
    """Let an output replace a foreign file; never one that is read."""


Output: TypeAlias = Annotated[OutputFlags, tyro.conf.arg(name=""), MORE]
