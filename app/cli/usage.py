"""What was typed, read into a command; what makes no sense is answered in one line that says what would."""

import io
import re
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from difflib import get_close_matches
from typing import Any, Protocol

from tyro import _errors as faults  # private to tyro: the tests of wrong usage tell when a new version changes it

from calib_core.errors import InputError

__all__ = ["read_command"]

_PROGRAM = "cocalib"
_NUMBERS = {"INT": "a whole number", "FLOAT": "a number"}

Parse = Callable[[Sequence[str]], Any]


class _Argument(Protocol):
    """The part of tyro's argument that is needed here."""

    @property
    def lowered(self) -> Any: ...

    def is_positional(self) -> bool: ...


def read_command(parse: Parse, arguments: Sequence[str]) -> Any:
    """Read a command line.

    Args:
        parse: makes a command of it, with tyro.
        arguments: what was typed after `cocalib`.

    Raises:
        InputError: it makes no sense.
        SystemExit: help was asked for and is printed.
    """

    def refuse(fault: faults.ParseErrorEvent) -> None:
        if reason := _reason(fault, parse, arguments):
            raise InputError(f"{reason}; {_command(parse, arguments)} --help shows what there is")

    with faults.on_parse_error(refuse):
        return parse(arguments)


def _command(parse: Parse, arguments: Sequence[str]) -> str:
    """Return the command that was typed, without what follows it."""
    named = bool(arguments) and arguments[0] in _commands(parse)
    return f"{_PROGRAM} {arguments[0]}" if named else _PROGRAM


def _help(parse: Parse, *command: str) -> str:
    with redirect_stdout(io.StringIO()) as text:
        try:
            parse([*command, "--help"])
        except SystemExit:
            return text.getvalue()
    return ""


def _commands(parse: Parse) -> list[str]:
    found = re.search(r"\{([a-z,]+)\}", _help(parse))
    return found[1].split(",") if found else []


def _reason(fault: faults.ParseErrorEvent, parse: Parse, arguments: Sequence[str]) -> str:
    """Say what is wrong; "" for what only tyro can word."""
    match fault:
        case faults.UnrecognizedArgs():
            return _unknown(fault.tokens[0], parse, arguments)
        case faults.MissingArgs() if fault.unrecognized_tokens:
            return _unknown(fault.unrecognized_tokens[0], parse, arguments)
        case faults.MissingArgs():
            names = [_name(missing.arg, with_value=True) for missing in fault.missing_arguments]
            return f"{' and '.join(names)} {'is' if len(names) == 1 else 'are'} missing"
        case faults.BadValue():
            return f"{_name(fault.argument)} needs a value: {_name(fault.argument, with_value=True)}"
        case faults.InvalidChoice():
            return f"{_name(fault.argument)} takes {_alternatives(fault.choices)}, not '{fault.value}'"
        case faults.InstantiationFailure(argument=argument) if argument is not None:
            return _bad_value(argument, fault.message)
    return ""


def _name(argument: _Argument, *, with_value: bool = False) -> str:
    """Return an argument as it is typed: `--out FILE`, or `RECORDING...`."""
    value = re.sub(r"\{None\}\|", "", str(argument.lowered.metavar or "")).strip("{}")
    if argument.is_positional():
        return value
    return f"{argument.lowered.name_or_flags[-1]} {value if with_value else ''}".rstrip()


def _alternatives(words: Sequence[str]) -> str:
    return " or ".join(filter(None, [", ".join(words[:-1]), words[-1]]))


def _bad_value(argument: _Argument, message: str) -> str:
    value = _name(argument, with_value=True).removeprefix(_name(argument)).strip()
    typed = re.search(r"'([^']*)'$", message)
    what = _NUMBERS.get(value, value)
    if typed and value in _NUMBERS:
        return f"{_name(argument)} takes {what}, not '{typed[1]}'"
    return f"{_name(argument)} takes {what}, and something else was given"


def _unknown(token: str, parse: Parse, arguments: Sequence[str]) -> str:
    """Say that something is unknown, and what may have been meant."""
    commands = _commands(parse)
    if token == arguments[0] and not token.startswith("-"):
        near = get_close_matches(token, commands, n=1)
        return f"there is no command '{token}'" + (
            f"; did you mean '{near[0]}'?" if near else f": {', '.join(commands)}"
        )
    if arguments[0] not in commands:
        return f"'{token}' stands where a command belongs: {', '.join(commands)}"
    if not token.startswith("-"):
        return f"'{token}' is one argument too many"
    flag = token.split("=")[0].replace("_", "-")
    known = sorted(set(re.findall(r"(?<!\S)--[a-z][a-z.-]*", _help(parse, arguments[0]))))
    near = [other for other in known if flag.strip("-") and other.endswith(flag.lstrip("-"))] or get_close_matches(
        flag, known, n=2
    )
    return f"there is no option {token.split('=')[0]}" + (f"; did you mean {_alternatives(near[:3])}?" if near else "")
