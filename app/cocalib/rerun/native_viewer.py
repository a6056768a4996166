"""Open a file in Rerun's own window."""

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from calib_core.errors import InputError
from cocalib.rerun.sdk import offline_environment, viewer_program

_TO_ONE_MACHINE = ("--bind", "127.0.0.1", "--port", "auto")
"""The viewer also listens for programs that log to it: on all interfaces unless it is told otherwise."""


def require_display(environment: Mapping[str, str], platform: str = sys.platform) -> None:
    """Refuse to go on where no window can be opened.

    Raises:
        InputError: there is no display.
    """
    if platform.startswith("linux") and not (environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY")):
        raise InputError(
            "no window can be opened here: there is no display (DISPLAY and WAYLAND_DISPLAY are not set, as over ssh). Use "
            "--web for a viewer in the browser, or write a file with cocalib record-rrd ... --out FILE.rrd and open it on a "
            "computer with a screen"
        )


def open_window(path: Path) -> int:
    """Show a file in Rerun's window until it is closed; return its exit code.

    Raises:
        InputError: the viewer is missing or cannot be started.
    """
    command = [str(viewer_program()), *_TO_ONE_MACHINE, str(path)]
    try:
        return subprocess.run(command, env=offline_environment(os.environ), check=False).returncode
    except OSError as error:
        raise InputError(f"{command[0]}: cannot be started: {error.strerror or error}") from error
