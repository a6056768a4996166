"""Parse a command's arguments; report wrong usage in one line that suggests a correction."""

from collections.abc import Sequence
from difflib import get_close_matches
from typing import NoReturn

from calib_core.errors import InputError, word_list
from cocalib.cli.commands import PROGRAM, Command, Runnable
from cocalib.cli.tyro_hook import Argument, Fault, flags_of, parse
from cocalib.platform.terminal import with_colours

_MEANT = {"format": "--to", "o": "--out", "file": "--out", "intrinsics": "--camera", "extrinsics": "--calibration"}
"""What people call an option, and its name."""
_UNASKED = {"Demo": "; for your own recording: cocalib open {}", "Simulate": "; did you mean --out {}?"}
"""What a word may mean that a command, by its class, does not take."""
_NUMBERS = {"INT": "a whole number", "FLOAT": "a number"}


def read_command(command: Command, arguments: Sequence[str]) -> Runnable:
    """Parse the arguments of a command.

    Args:
        command: from the table of commands.
        arguments: the command-line arguments after it.

    Raises:
        InputError: they are invalid.
        SystemExit: the help was requested and printed.
    """
    kind, program = command.load(), f"{PROGRAM} {command.name}"

    def refuse(fault: Fault) -> NoReturn:
        raise InputError(f"{_reason(fault, kind)}; see {program} --help")

    with with_colours():  # of the help
        return parse(kind, arguments, program=program, refuse=refuse)


def _reason(fault: Fault, kind: type[Runnable]) -> str:
    """Return what is wrong."""
    named, typed = " and ".join(map(_argument_text, fault.arguments)), fault.typed
    if fault.kind == "unknown":
        return _unknown(typed or "", kind)
    if fault.kind == "missing":
        return f"{named} {'is' if len(fault.arguments) == 1 else 'are'} missing"
    (argument,) = fault.arguments
    if fault.kind == "no value":
        return f"{argument.name} needs a value: {named}"
    if fault.choices:
        near = get_close_matches((typed or "").lower(), fault.choices, n=1)
        wanted = f"{argument.name} takes {word_list(fault.choices, 'or')}, not '{typed}'"
        return f"{argument.name} {typed}: did you mean {near[0]}?" if near else wanted
    what = _NUMBERS.get(argument.value, argument.value)
    only = "" if argument.value in _NUMBERS else ", as numbers like 0.5, without units"
    return f"{argument.name} takes {what}{only}" + (f", not '{typed}'" if typed else "; the given value is invalid")


def _argument_text(argument: Argument) -> str:
    """Return an argument as typed: `--out FILE`, or `RECORDING...`."""
    return f"{argument.name} {argument.value}".rstrip()


def _unknown(token: str, kind: type[Runnable]) -> str:
    """Return a message about an unknown argument, with suggestions."""
    if not token.startswith("-"):
        return f"unexpected argument '{token}'" + _UNASKED.get(kind.__name__, "").format(token)
    flag = token.split("=")[0].replace("_", "-")
    known = sorted({"--help", *flags_of(kind)})
    near = [other for other in known if other == _MEANT.get(flag.lstrip("-"))]
    near = near or [other for other in known if flag.strip("-") and other.endswith(flag.lstrip("-"))]
    near = near or get_close_matches(flag, known, n=2)
    return f"unknown option {token.split('=')[0]}" + (f"; did you mean {word_list(near[:3], 'or')}?" if near else "")
