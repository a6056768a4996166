"""Flags that several commands share, and how values are called in the help."""

from pathlib import Path
from typing import Annotated, TypeAlias

import tyro

__all__ = ["File", "Folder", "NewFile", "Switch", "called"]


def called(metavar: str | None = None) -> object:
    """Name a value in the help; a default of None or False tells nobody anything, so it is left out."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


File: TypeAlias = Annotated[Path | None, called("FILE")]
NewFile: TypeAlias = Annotated[Path, tyro.conf.arg(metavar="FILE")]
Folder: TypeAlias = Annotated[Path | None, called("FOLDER")]
Switch: TypeAlias = Annotated[bool, called()]
