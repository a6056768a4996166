"""Flags that several commands share, and how values are called in the help."""

import dataclasses
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import tyro

__all__ = ["File", "Folder", "NewFile", "Switch", "called", "same"]


def called(metavar: str | None = None) -> object:
    """Name a value in the help; a default of None or False tells nobody anything, so it is left out."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


def same(options: type[Any], name: str) -> Any:
    """Return a field with the default and the text of one in a class of options, for a subclass that names its value."""
    (found,) = (field for field in dataclasses.fields(options) if field.name == name)
    return dataclasses.field(default=found.default, metadata=found.metadata)


File: TypeAlias = Annotated[Path | None, called("FILE")]
NewFile: TypeAlias = Annotated[Path, tyro.conf.arg(metavar="FILE")]
Folder: TypeAlias = Annotated[Path | None, called("FOLDER")]
Switch: TypeAlias = Annotated[bool, called()]
