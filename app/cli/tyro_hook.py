"""tyro, and all that is private to it: the events by which it says why a command line makes no sense.

tyro's public API can only print such a reason, in several lines of its own, and exit. A tyro whose private events have
changed costs the wording and nothing else: `missing_parts` finds that out, and tyro then answers in its own words.
"""

import dataclasses
import importlib
import re
import typing
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

import tyro

__all__ = [
    "Argument",
    "BadValue",
    "Fault",
    "MissingArguments",
    "MissingValue",
    "UnknownArgument",
    "WrongChoice",
    "flags_of",
    "missing_parts",
    "parse",
]

_PRIVATE = "tyro._errors"
_PARTS = {
    "UnrecognizedArgs": ("tokens",),
    "MissingArgs": ("missing_arguments", "unrecognized_tokens"),
    "BadValue": ("argument",),
    "InvalidChoice": ("argument", "value", "choices"),
    "InstantiationFailure": ("argument", "message"),
}

Parsed = TypeVar("Parsed")


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument of a command.

    Attributes:
        name: as it is typed, such as `--out`, or `RECORDING...`.
        value: what follows an option, such as `FILE`; "" for an argument that is no option.
    """

    name: str
    value: str


@dataclass(frozen=True, slots=True)
class UnknownArgument:
    """Something was typed that the command does not know."""

    token: str


@dataclass(frozen=True, slots=True)
class MissingArguments:
    """Arguments that the command needs were not given."""

    arguments: tuple[Argument, ...]


@dataclass(frozen=True, slots=True)
class MissingValue:
    """An option was given without its value."""

    argument: Argument


@dataclass(frozen=True, slots=True)
class WrongChoice:
    """An option was given a value that is none of its choices."""

    argument: Argument
    value: str
    choices: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BadValue:
    """A value cannot be read as what its option takes.

    Attributes:
        typed: the value; None where it is not known.
    """

    argument: Argument
    typed: str | None


Fault: TypeAlias = UnknownArgument | MissingArguments | MissingValue | WrongChoice | BadValue


def parse(kind: type[Parsed], arguments: Sequence[str], *, program: str, refuse: Callable[[Fault], None]) -> Parsed:
    """Read the arguments of one command.

    Args:
        kind: the command's dataclass.
        arguments: what was typed after the command.
        program: the program and the command, as the help shows them.
        refuse: is told why the arguments make no sense, and raises; where it does not, tyro says so and exits.

    Raises:
        SystemExit: help was asked for and is printed, or tyro has said what is wrong.
    """

    def read() -> Parsed:
        config = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.FlagCreatePairsOff)
        return tyro.cli(kind, prog=program, args=list(arguments), config=config)

    def on_event(event: Any) -> None:
        if (fault := _fault(event)) is not None:
            refuse(fault)

    if missing_parts():
        return read()
    with importlib.import_module(_PRIVATE).on_parse_error(on_event):
        return read()


def missing_parts() -> tuple[str, ...]:
    """Name the private parts of tyro that are used here and that the installed tyro does not have."""
    try:
        events = importlib.import_module(_PRIVATE)
    except ImportError:
        return (_PRIVATE,)
    missing = [] if hasattr(events, "on_parse_error") else ["on_parse_error"]
    for name, attributes in _PARTS.items():
        event = getattr(events, name, None)
        known = {field.name for field in dataclasses.fields(event)} if dataclasses.is_dataclass(event) else set()
        missing += [f"{name}.{attribute}" for attribute in attributes if attribute not in known]
    return tuple(f"{_PRIVATE}.{name}" for name in missing)


def flags_of(kind: type[Any], prefix: str = "") -> Iterator[str]:
    """Yield the options of a command, such as `--out` and `--noise.sigma-px`, from the fields of its dataclass."""
    hints = typing.get_type_hints(kind, include_extras=True)
    for field in dataclasses.fields(kind):
        annotated = typing.get_origin(hints[field.name]) is typing.Annotated
        value, *notes = typing.get_args(hints[field.name]) if annotated else (hints[field.name],)
        if dataclasses.is_dataclass(value):
            unnamed = any(getattr(note, "name", None) == "" for note in notes)  # as tyro.conf.arg(name="") leaves it
            yield from flags_of(typing.cast(type, value), prefix if unnamed else f"{prefix}{field.name}.")
        elif tyro.conf.Positional not in notes and not any(map(dataclasses.is_dataclass, typing.get_args(value))):
            yield f"--{prefix}{field.name}".replace("_", "-")


def _fault(event: Any) -> Fault | None:
    """Translate an event of tyro; None for one that only tyro can word."""
    match type(event).__name__:
        case "UnrecognizedArgs":
            return UnknownArgument(event.tokens[0])
        case "MissingArgs" if event.unrecognized_tokens:
            return UnknownArgument(event.unrecognized_tokens[0])
        case "MissingArgs":
            return MissingArguments(tuple(_argument(missing.arg) for missing in event.missing_arguments))
        case "BadValue":
            return MissingValue(_argument(event.argument))
        case "InvalidChoice":
            return WrongChoice(_argument(event.argument), event.value, tuple(event.choices))
        case "InstantiationFailure" if event.argument is not None:
            typed = re.search(r"'([^']*)'$", event.message)
            return BadValue(_argument(event.argument), typed[1] if typed else None)
    return None


def _argument(definition: Any) -> Argument:
    value = re.sub(r"\{None\}\|", "", str(definition.lowered.metavar or "")).strip("{}")
    if definition.is_positional():
        return Argument(value, "")
    return Argument(definition.lowered.name_or_flags[-1], value)
