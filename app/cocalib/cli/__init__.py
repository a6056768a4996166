"""The command line: parses the arguments, runs the command, and turns each error into one line and an exit code.

`exit_codes` has the law. A signal that ends `open` or `demo` after the page was served is no failure: 0.
A command imports only what it needs: `--version` and `--help` need neither NumPy nor tyro.
"""

import contextlib
import os
import signal
import sys
from collections.abc import Sequence

from calib_core.errors import CalibrationError, InputError, NoAnswerError, meant
from cocalib.cli.commands import COMMANDS, PROGRAM, Command, overview
from cocalib.cli.exit_codes import NO_ANSWER
from cocalib.platform.error_boundary import INTERNAL_ERROR, error_boundary
from cocalib.platform.terminal import escaped_output

__all__ = ["refuse", "run"]


def run(arguments: Sequence[str]) -> int:
    """Run one command.

    Args:
        arguments: the command-line arguments after `cocalib`.

    Returns:
        The exit code.
    """
    codes: list[int] = []
    with escaped_output():
        with error_boundary(f"{PROGRAM} {' '.join(arguments[:1])}".rstrip(), lambda line: codes.append(_fail(line))):
            codes.append(_ended(arguments))
        return codes[0]


def _ended(arguments: Sequence[str]) -> int:
    """Run one command; turn its expected errors and its end by a signal into an exit code."""
    try:
        return _run(*arguments)
    except NoAnswerError as error:
        refuse(str(error))
        return NO_ANSWER
    except CalibrationError as error:
        return refuse(str(error))
    except BrokenPipeError:  # the reader of our output has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        return refuse(f"{error.filename or 'a file'}: {error.strerror or error}")
    except KeyboardInterrupt as stop:  # carries the signal number if it was not Ctrl+C
        with contextlib.suppress(OSError):  # the terminal may be gone
            print(f"\n{_STOPPED[arguments[0]]}" if arguments and arguments[0] in _STOPPED else "", file=sys.stderr)
        return 128 + int(stop.args[0] if stop.args else signal.SIGINT)


_STOPPED = {"batch": "stopped: what is done is kept; the same command goes on from there"}


def refuse(reason: str) -> int:
    """Print one line to stderr that says why a command cannot run; return exit code 2."""
    print(f"{PROGRAM}: {' '.join(reason.split())}", file=sys.stderr)
    return 2


def _fail(line: str) -> int:
    """Print the line about an internal error; return its exit code."""
    refuse(line)
    return INTERNAL_ERROR


def _run(first: str = "--help", *others: str) -> int:
    if first in ("-h", "--help", "help"):
        print(overview())
        return 0
    if first == "--version":
        from cocalib.platform.resources import version

        print(f"{PROGRAM} {version()}")
        return 0
    if first not in COMMANDS:
        raise InputError(f"{_unknown(first)}; see {PROGRAM} --help")
    if "-h" in others or "--help" in others:
        return _help(COMMANDS[first], everything=others[-1] == "all")
    from cocalib.cli.output import kept_inputs
    from cocalib.cli.usage import read_command

    command = read_command(COMMANDS[first], others)
    with kept_inputs(command):
        return command.run()


def _help(command: Command, *, everything: bool) -> int:
    from cocalib.cli.help import named_options_help, short_help

    if not everything:
        print(short_help(command), end="")
        return 0
    from cocalib.cli.usage import read_command

    with contextlib.suppress(SystemExit):  # tyro's, once it has printed
        read_command(command, ("--help",))
    print(named_options_help(command.load()), end="")
    return 0


_MEANT = {"calibrate": "solve", "convert": "export", "gui": "open", "run": "open", "view": "show", "verify": "check"}
"""What people call a command, and its name."""


def _unknown(first: str) -> str:
    """Say that the first argument is not a command, and suggest one."""
    if first.startswith("-"):
        return f"unknown option {first.split('=')[0]}; give a command first: {', '.join(COMMANDS)}"
    return f"unknown command '{first}'; {meant(_MEANT.get(first, first), COMMANDS)}"
