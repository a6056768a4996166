"""Whether rerun-sdk is installed, and how its programs are kept from the internet."""

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
