"""The command line: reads what was typed, runs it, and turns every refusal into one line and an exit code.

Exit codes: 0 done; 1 the data cannot give a calibration; 2 wrong usage or unreadable input; 130 stopped by
Ctrl+C, 143 by SIGTERM.
"""

import os
import signal
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import tyro

from app.cli.export import Check, Export
from app.cli.import_file import Import
from app.cli.info import Info
from app.cli.open import Demo, Open
from app.cli.output import refuse
from app.cli.simulate import Simulate
from app.cli.solve import Solve
from app.cli.usage import read_command
from app.cli.video import Video
from calib_core.errors import CalibrationError

__all__ = ["run"]

_DESCRIPTION = "Radar-camera calibration: click the corner reflector, get camera_from_radar and how far to trust it."

_Command = (
    Annotated[Demo, tyro.conf.subcommand("demo")]
    | Annotated[Open, tyro.conf.subcommand("open")]
    | Annotated[Info, tyro.conf.subcommand("info")]
    | Annotated[Solve, tyro.conf.subcommand("solve")]
    | Annotated[Export, tyro.conf.subcommand("export")]
    | Annotated[Check, tyro.conf.subcommand("check")]
    | Annotated[Import, tyro.conf.subcommand("import")]
    | Annotated[Video, tyro.conf.subcommand("video")]
    | Annotated[Simulate, tyro.conf.subcommand("simulate")]
)


def _parse(arguments: Sequence[str]) -> Any:
    return tyro.cli(
        _Command,
        prog="cocalib",
        description=_DESCRIPTION,
        args=list(arguments),
        config=(tyro.conf.OmitSubcommandPrefixes, tyro.conf.FlagCreatePairsOff),
    )


def run(arguments: Sequence[str]) -> int:
    """Run one command.

    Args:
        arguments: what was typed after `cocalib`.

    Returns:
        The exit code.
    """
    if list(arguments) == ["--version"]:
        from app.resources import version

        print(f"cocalib {version()}")
        return 0
    try:
        command = read_command(_parse, list(arguments) or ["--help"])
        return int(command.run())
    except CalibrationError as error:
        return refuse(str(error))
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        return refuse(f"{error.filename or 'a file'}: {(error.strerror or str(error)).lower()}")
    except KeyboardInterrupt as stop:  # with the number of the signal, where it was not Ctrl+C
        print(file=sys.stderr)
        return 128 + int(stop.args[0] if stop.args else signal.SIGINT)
