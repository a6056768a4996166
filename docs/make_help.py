"""Write the help screens of the commands from their classes: `python docs/make_help.py`."""

import ast
import dataclasses
import inspect
import itertools
import textwrap
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cocalib.cli.help
from cocalib.cli.commands import COMMANDS, PROGRAM, Command

FOLDER = Path(cocalib.cli.help.__file__).parent / "help_texts"
_WIDTH = 80
_NAMES = 26
"""Columns of a flag's name."""
_CHOICES = 60
"""Longest list of choices that is shown."""


@dataclass(frozen=True, slots=True)
class _Flag:
    """One argument of a command.

    Attributes:
        name: with its value, as typed.
        text: what it does.
        is_flag: not a positional argument.
        more: it is shown by `--help all` only.
    """

    name: str
    text: str
    is_flag: bool
    more: bool


def written_help(command: Command) -> str:
    """Return the screen of a command, made from its class."""
    kind = command.load()
    flags = [*_flags(kind)]
    positional = " ".join(flag.name for flag in flags if not flag.is_flag)
    lines = [f"usage: {PROGRAM} {command.name} {positional}".rstrip() + " [OPTIONS]", ""]
    lines += [*textwrap.wrap(command.summary, _WIDTH), ""]
    lines += [f"  {PROGRAM} {command.name} {example}".rstrip() for example in command.examples]
    lines += [""] if command.examples else []
    for flag in sorted((flag for flag in flags if not flag.more), key=lambda flag: flag.is_flag):
        lines += _row(flag.name, flag.text)
    lines += _row("--help all", "Every option, with its whole text.")
    return "\n".join(lines) + "\n"


def _row(name: str, text: str) -> Iterator[str]:
    first = f"  {name}"
    indent = " " * _NAMES
    shown = textwrap.wrap(text, _WIDTH - _NAMES)
    if len(first) + 2 > _NAMES:
        yield first
        yield from (indent + line for line in shown)
    else:
        yield f"{first:<{_NAMES}}{shown[0] if shown else ''}".rstrip()
        yield from (indent + line for line in shown[1:])


def _flags(kind: type[Any], *, more: bool = False) -> Iterator[_Flag]:
    """Yield the arguments of a command, in the order of its class."""
    import tyro

    from cocalib.cli.flags import MORE

    hints, texts = typing.get_type_hints(kind, include_extras=True), _texts(kind)
    for field in dataclasses.fields(kind):
        hint = hints[field.name]
        annotated = typing.get_origin(hint) is typing.Annotated
        value, *notes = typing.get_args(hint) if annotated else (hint,)
        hidden = more or MORE in notes
        if dataclasses.is_dataclass(value):
            yield from _flags(typing.cast(type, value), more=hidden)
            continue
        metavar = next((name for note in notes if (name := getattr(note, "metavar", None))), None)
        positional = tyro.conf.Positional in notes
        name = metavar or field.name.upper()
        if not positional:
            flag = f"--{next((one for note in notes if (one := getattr(note, 'name', None))), field.name)}"
            shown = metavar or _metavar(value)
            name = f"{flag.replace('_', '-')} {shown if len(shown) <= _CHOICES else field.name.upper()}".rstrip()
        text = field.metadata.get("help") or texts.get(field.name, "")
        yield _Flag(name, _first_sentence(text), not positional, hidden)


def _metavar(value: Any) -> str:
    """Name the value of a flag by its type."""
    kinds = [kind for kind in typing.get_args(value) if kind is not type(None)] or [value]
    if value is bool:
        return ""
    if typing.get_origin(value) is typing.Literal:
        return "{" + ",".join(typing.get_args(value)) + "}"
    if typing.get_origin(kinds[0]) is typing.Literal:
        return "{" + ",".join(map(str, typing.get_args(kinds[0]))) + "}"
    return {int: "INT", float: "FLOAT", str: "TEXT", Path: "FILE"}.get(kinds[0], "VALUE")


def _first_sentence(text: str) -> str:
    """Return what fits one screen of a text: up to its first full stop or semicolon."""
    text = " ".join(text.split())
    for end in (". ", "; "):
        text = text.partition(end)[0]
    return text.rstrip(".") + "."


def _texts(kind: type[Any]) -> dict[str, str]:
    """Return the texts below the fields of a class and of those it inherits from."""
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__[:-1]):
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(one))).body
        body = tree.body if isinstance(tree, ast.ClassDef) else []
        for field, text in itertools.pairwise(body):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(text, ast.Expr):
                found[field.target.id] = str(ast.literal_eval(text.value))
    return found


if __name__ == "__main__":
    for one in COMMANDS.values():
        (FOLDER / f"{one.name}.txt").write_text(written_help(one), encoding="utf-8")
