"""The command line: parses the arguments, runs the command, and turns each error into one line and an exit code.

Exit codes: 0 done; 1 no calibration possible from the data; 2 wrong usage or unreadable input; 130 stopped by
Ctrl+C, 143 by SIGTERM.
A command imports only what it needs: `--version` and `--help` need neither NumPy nor tyro.
"""

import os
import signal
import sys
from collections.abc import Sequence
from difflib import get_close_matches

from app.cli.commands import COMMANDS, PROGRAM, overview
from calib_core.errors import CalibrationError, InputError

__all__ = ["refuse", "run"]


def run(arguments: Sequence[str]) -> int:
    """Run one command.

    Args:
        arguments: the command-line arguments after `cocalib`.

    Returns:
        The exit code.
    """
    try:
        return _run(*arguments)
    except CalibrationError as error:
        return refuse(str(error))
    except BrokenPipeError:  # the reader of our output has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        return refuse(f"{error.filename or 'a file'}: {(error.strerror or str(error)).lower()}")
    except KeyboardInterrupt as stop:  # carries the signal number if it was not Ctrl+C
        print(file=sys.stderr)
        return 128 + int(stop.args[0] if stop.args else signal.SIGINT)


def refuse(reason: str) -> int:
    """Print one line to stderr that says why a command cannot run; return exit code 2."""
    print(f"{PROGRAM}: {' '.join(reason.split())}", file=sys.stderr)
    return 2


def _run(first: str = "--help", *others: str) -> int:
    if first in ("-h", "--help", "help"):
        print(overview())
        return 0
    if first == "--version":
        from app.resources import version

        print(f"{PROGRAM} {version()}")
        return 0
    if first not in COMMANDS:
        raise InputError(f"{_unknown(first)}; see {PROGRAM} --help")
    from app.cli.usage import read_command

    return read_command(COMMANDS[first], others).run()


def _unknown(first: str) -> str:
    """Say that the first argument is not a command, and suggest one."""
    if first.startswith("-"):
        return f"unknown option {first.split('=')[0]}; give a command first: {', '.join(COMMANDS)}"
    near = get_close_matches(first, COMMANDS, n=1)
    return f"unknown command '{first}'; " + (f"did you mean '{near[0]}'?" if near else f"known: {', '.join(COMMANDS)}")
