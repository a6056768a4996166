"""All use of tyro's private API: the events that say why a command line is invalid.

With its public API, tyro can only print the reason itself, on several lines, and exit. If a new tyro has changed these
private events, only our wording is lost: `missing_parts` detects it, and tyro then prints its own message.
"""

import dataclasses
import importlib
import re
import typing
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

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
        name: as typed, such as `--out`, or `RECORDING...`.
        value: what follows an option, such as `FILE`; "" for a positional argument.
    """

    name: str
    value: str


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong with the arguments of a command.

    Attributes:
        kind: an unknown argument, required ones that are missing, an option without a value or with a wrong one.
        typed: the unknown argument, or the wrong value; None if that is not known.
        arguments: those that it is about.
        choices: of the option's value, if there are such.
    """

    kind: Literal["unknown", "missing", "no value", "wrong value"]
    typed: str | None = None
    arguments: tuple[Argument, ...] = ()
    choices: tuple[str, ...] = ()


_VALUES = ConstructorRegistry()
"""How values are read and shown that tyro would show with its own words."""


@_VALUES.primitive_rule
def _optional_number(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """Show a number that may be unset as FLOAT or INT, not as {None}|FLOAT."""
    kind = next((kind for kind in (float, int) if set(typing.get_args(info.type)) == {kind, type(None)}), None)
    if kind is None:
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=kind.__name__.upper(),
        instance_from_str=lambda words: kind(words[0]),
        is_instance=lambda value: value is None or isinstance(value, kind | int),
        str_from_instance=lambda value: ["unset" if value is None else str(value)],
    )


@_VALUES.primitive_rule
def _text(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """Show a text as TEXT, not as STR."""
    if info.type is not str:
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="TEXT",
        instance_from_str=lambda words: words[0],
        is_instance=lambda value: isinstance(value, str),
        str_from_instance=lambda value: [value],
    )


def parse(
    kind: type[Parsed],
    arguments: Sequence[str],
    *,
    program: str,
    refuse: Callable[[Fault], None],
) -> Parsed:
    """Parse the arguments of one command.

    Args:
        kind: the command's dataclass.
        arguments: the command-line arguments after the command.
        program: the program and command names, as shown in the help.
        refuse: called with the fault if the arguments are invalid; raises. If it returns, tyro prints its message and exits.

    Raises:
        SystemExit: the help was requested and printed, or tyro printed an error.
    """

    def read() -> Parsed:
        helped = bool({"-h", "--help"} & set(arguments))  # finding the texts of a help takes longer than all else here
        quick = () if helped else (tyro.conf.HelptextFromCommentsOff,)
        config = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.FlagCreatePairsOff, *quick)
        return tyro.cli(kind, prog=program, args=list(arguments), config=config, registry=_VALUES)

    def on_event(event: Any) -> None:
        if (fault := _fault(event)) is not None:
            refuse(fault)

    if missing_parts():
        return read()
    with importlib.import_module(_PRIVATE).on_parse_error(on_event):
        return read()


def missing_parts() -> tuple[str, ...]:
    """Return the private parts of tyro used here that the installed version lacks."""
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
    """Yield the options of a command, such as `--out`, from the fields of its dataclass."""
    hints = typing.get_type_hints(kind, include_extras=True)
    for field in dataclasses.fields(kind):
        annotated = typing.get_origin(hints[field.name]) is typing.Annotated
        value, *notes = typing.get_args(hints[field.name]) if annotated else (hints[field.name],)
        if tyro.conf.Suppress in notes:
            continue
        if dataclasses.is_dataclass(value):
            # tyro.conf.arg(name="") sets a name
            unnamed = tyro.conf.OmitArgPrefixes in notes or any(getattr(note, "name", None) == "" for note in notes)
            yield from flags_of(typing.cast(type, value), prefix if unnamed else f"{prefix}{field.name}.")
        elif tyro.conf.Positional not in notes and not any(map(dataclasses.is_dataclass, typing.get_args(value))):
            given = next((name for note in notes if (name := getattr(note, "name", None))), field.name)
            yield f"--{prefix}{given}".replace("_", "-")


def _fault(event: Any) -> Fault | None:
    """Translate a tyro event; None for one whose message is left to tyro."""
    match type(event).__name__:
        case "UnrecognizedArgs":
            return Fault("unknown", event.tokens[0])
        case "MissingArgs" if event.unrecognized_tokens:
            return Fault("unknown", event.unrecognized_tokens[0])
        case "MissingArgs":
            return Fault("missing", None, tuple(_argument(missing.arg) for missing in event.missing_arguments))
        case "BadValue":
            return Fault("no value", None, (_argument(event.argument),))
        case "InvalidChoice":
            given = [choice for choice in event.choices if choice != "None"]  # unset is nothing to type
            choices = event.choices if len(given) == len(event.choices) else sorted(given)
            return Fault("wrong value", event.value, (_argument(event.argument),), tuple(choices))
        case "InstantiationFailure" if event.argument is not None:
            typed = re.search(r"'([^']*)'$|instantiated from \[(.*?)\]", event.message)
            words = typed and (typed[1] if typed[2] is None else typed[2].replace("', '", " ").strip("'"))
            return Fault("wrong value", words, (_argument(event.argument),))
    return None


def _argument(definition: Any) -> Argument:
    value = re.sub(r"\{None\}\|", "", str(definition.lowered.metavar or "")).strip("{}")
    if definition.is_positional():
        return Argument(value, "")
    return Argument(definition.lowered.name_or_flags[-1], value)
