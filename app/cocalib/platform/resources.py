"""Where the program finds its own files and keeps its state."""

import hashlib
import importlib.metadata
import os
import sys
from pathlib import Path

from calib_core.errors import CalibrationError

SESSION_SUFFIX = ".cocalib-session"
_DISTRIBUTION = "cocalib"
_PACKAGE_FOLDER = Path(__file__).resolve().parents[1]


class InstallationError(CalibrationError):
    """The program is not installed correctly."""


def static_folder() -> Path:
    """Return the folder of the page's files: inside the installed package, or at the top of a checkout.

    Raises:
        InstallationError: it is in neither place.
    """
    return _folder("static")


def site_folder() -> Path | None:
    """Return the folder of the documentation, as `make docs` writes it into the package; None if it is not there or not whole."""
    folder = _PACKAGE_FOLDER / "site"
    return folder if (folder / "index.html").is_file() else None


def sample_folder() -> Path:
    """Return the folder of the sample recordings: inside the installed package, or at the top of a checkout.

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


def _folder(name: str) -> Path:
    checkout = _PACKAGE_FOLDER.parents[1]
    for folder in (_PACKAGE_FOLDER / name, checkout / name):
        if folder.is_dir():
            return folder
    raise InstallationError(
        f"the folder {name} is neither in {_PACKAGE_FOLDER} nor in {checkout}; reinstall {_DISTRIBUTION}"
    )


def _system_state_folder() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support"
    stated = Path(os.environ.get("XDG_STATE_HOME") or "")
    return stated if stated.is_absolute() else Path.home() / ".local" / "state"
