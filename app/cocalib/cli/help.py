"""The help of the commands: one screen each, kept as a file so that it is shown at once; and everything, for `--help all`.

`docs/make_help.py` writes the files again from the commands' classes; a test compares.
"""

import dataclasses
import textwrap
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cocalib.cli.commands import Command

_FOLDER = Path(__file__).parent / "help_texts"
_WIDTH = 80


def short_help(command: Command) -> str:
    """Return the screen that `--help` shows."""
    return (_FOLDER / f"{command.name}.txt").read_text(encoding="utf-8")


def named_options_help(kind: type[Any]) -> str:
    """Return the list of the options by name that a command takes, by group; empty if it takes none."""
    named = getattr(kind, "NAMED", None)
    if named is None:
        return ""
    return "\n".join(["options by name (--set NAME=VALUE, or --options FILE.toml):", *_named(named, ""), ""])


def _named(kind: type[Any], prefix: str) -> Iterator[str]:
    hints = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):
        if dataclasses.is_dataclass(hints[field.name]):
            yield from _named(typing.cast(type, hints[field.name]), f"{prefix}{field.name}.")
        else:
            default = "" if field.default is None or field.default is dataclasses.MISSING else f" ({field.default})"
            yield f"  {prefix}{field.name}{default}"
            yield from textwrap.wrap(
                field.metadata.get("help", ""), _WIDTH, initial_indent=" " * 6, subsequent_indent=" " * 6
            )
