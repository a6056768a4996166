"""Where the program finds its own files and keeps its state, and whether another package overwrites it."""

import hashlib
import importlib.metadata
import os
import sys
from pathlib import Path

from calib_core.errors import CalibrationError

__all__ = [
    "SESSION_SUFFIX",
    "InstallationError",
    "check_installation",
    "installed_app_owners",
    "sample_folder",
    "state_folder",
    "static_folder",
    "user_session_folder",
    "version",
]

SESSION_SUFFIX = ".cocalib-session"
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


def user_session_folder(name: str, *, key: str = "") -> Path:
    """Return a session folder in the user's state folder.

    Args:
        name: what the session is of.
        key: distinguishes sessions of the same name, such as the recording's path.
    """
    distinct = f"-{hashlib.sha256(os.fsencode(key)).hexdigest()[:8]}" if key else ""
    return state_folder() / "sessions" / f"{name}{distinct}{SESSION_SUFFIX}"


def version() -> str:
    """Return the version of the installed program; "0+unknown" if it runs from a checkout that is not installed."""
    try:
        return importlib.metadata.version(_DISTRIBUTION)
    except importlib.metadata.PackageNotFoundError:
        return "0+unknown"


def installed_app_owners() -> tuple[str, ...]:
    """Return the names of the installed distributions that contain a top-level package `app`."""
    owners = {found.name for found in importlib.metadata.distributions() if _has_app(found)}
    return tuple(sorted(owners))


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


def _has_app(installed: importlib.metadata.Distribution) -> bool:
    """Return whether a distribution installs a package `app`.

    The list of its files is searched as text: parsing all lists of an environment takes as long as starting the program.
    """
    if (top_level := installed.read_text("top_level.txt")) is not None:
        return "app" in top_level.split()
    files = installed.read_text("RECORD") or ""
    return any(f"{before}app/" in files for before in ("\n", '\n"')) or files.startswith(("app/", '"app/'))


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
