"""Where the program finds its own files and keeps its state, and whether another package overwrites it."""

import importlib.metadata
import os
import sys
from pathlib import Path

from calib_core.errors import CalibrationError

__all__ = [
    "InstallationError",
    "check_installation",
    "installed_app_owners",
    "sample_folder",
    "state_folder",
    "static_folder",
    "version",
]

_DISTRIBUTION = "cocalib"
_PACKAGE_FOLDER = Path(__file__).resolve().parent


class InstallationError(CalibrationError):
    """The program is not installed correctly."""


def static_folder() -> Path:
    """Return the folder of the page's files: inside the installed package, or next to it in a checkout.

    Raises:
        InstallationError: it is in neither place.
    """
    return _folder("static")


def sample_folder() -> Path:
    """Return the folder of the sample recordings: inside the installed package, or next to it in a checkout.

    Raises:
        InstallationError: it is in neither place.
    """
    return _folder("sample_data")


def state_folder() -> Path:
    """Return the folder for this user's program state; it may not exist yet."""
    return _system_state_folder() / _DISTRIBUTION


def version() -> str:
    """Return the version of the installed program; "0+unknown" if it runs from a checkout that is not installed."""
    try:
        return importlib.metadata.version(_DISTRIBUTION)
    except importlib.metadata.PackageNotFoundError:
        return "0+unknown"


def installed_app_owners() -> tuple[str, ...]:
    """Return the names of the installed distributions that contain a top-level package `app`."""
    return tuple(sorted(set(importlib.metadata.packages_distributions().get("app", ()))))


def check_installation() -> None:
    """Refuse to start if another distribution also installs a package `app`.

    Raises:
        InstallationError: more than one distribution owns `app`.
    """
    others = [owner for owner in installed_app_owners() if owner != _DISTRIBUTION]
    if others:
        raise InstallationError(
            f"another package, {' and '.join(others)}, is installed here with the same import name, app, "
            f"so one of them has overwritten the other; install {_DISTRIBUTION} into its own environment "
            f"with `uv tool install {_DISTRIBUTION}` or `pipx install {_DISTRIBUTION}`"
        )


def _folder(name: str) -> Path:
    for folder in (_PACKAGE_FOLDER / name, _PACKAGE_FOLDER.parent / name):
        if folder.is_dir():
            return folder
    raise InstallationError(
        f"the folder {name} is neither in {_PACKAGE_FOLDER} nor next to it; reinstall {_DISTRIBUTION}"
    )


def _system_state_folder() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support"
    stated = Path(os.environ.get("XDG_STATE_HOME") or "")
    return stated if stated.is_absolute() else Path.home() / ".local" / "state"
