"""Rerun's own viewer: whether it is installed, its window, and how it is kept from the internet."""

import os
import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

from calib_core.errors import InputError

_NOWHERE = "http://127.0.0.1:9"
_OFFLINE: Mapping[str, str] = {
    "CI": "1",
    **dict.fromkeys(("ALL_PROXY", "HTTPS_PROXY", "HTTP_PROXY", "all_proxy", "https_proxy", "http_proxy"), _NOWHERE),
    **dict.fromkeys(("NO_PROXY", "no_proxy"), "127.0.0.1,localhost"),
}
"""Rerun collects no usage data where CI is set; its requests to the internet (newest version, examples) end at a closed port."""
_FORCED = "FORCE_RERUN_ANALYTICS"
_TO_ONE_MACHINE = ("--bind", "127.0.0.1", "--port", "auto")
"""The viewer also listens for programs that log to it: on all interfaces unless it is told otherwise."""


def is_installed() -> bool:
    """Return whether rerun-sdk is."""
    return find_spec("rerun") is not None


def require_sdk() -> None:
    """Refuse to go on without rerun-sdk.

    Raises:
        InputError: it is not installed.
    """
    if not is_installed():
        raise InputError(
            "this command needs rerun-sdk, which is not installed (there is none for Intel Macs): pip install 'cocalib[rerun]'; "
            "cocalib export --to mcap does without it. A video of the overlay needs none either: cocalib show --out FILE.mp4"
        )


def viewer_program() -> Path:
    """Return the viewer that comes with rerun-sdk.

    Raises:
        InputError: rerun-sdk is not installed, or without its viewer.
    """
    require_sdk()
    spec = find_spec("rerun_cli")
    folder = Path(spec.origin).parent if spec is not None and spec.origin else Path()
    for name in ("rerun", "rerun.exe"):
        if (folder / name).is_file():
            return folder / name
    raise InputError(
        "rerun-sdk is installed without its viewer; write a file with cocalib show --out FILE.rrd, and open it elsewhere"
    )


def offline_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Return an environment in which a program of Rerun's reaches nothing but this machine."""
    return {name: value for name, value in environment.items() if name != _FORCED} | dict(_OFFLINE)


def has_display(environment: Mapping[str, str], platform: str = sys.platform) -> bool:
    """Return whether a window can be opened."""
    return not platform.startswith("linux") or bool(environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY"))


def require_display(environment: Mapping[str, str], platform: str = sys.platform) -> None:
    """Refuse to go on where no window can be opened.

    Raises:
        InputError: there is no display.
    """
    if not has_display(environment, platform):
        raise InputError(
            "no window can be opened here: there is no display (DISPLAY and WAYLAND_DISPLAY are not set, as over ssh). "
            "Write a file with cocalib show ... --out FILE.rrd and open it on a computer with a screen"
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
