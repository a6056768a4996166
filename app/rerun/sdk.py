"""Whether rerun-sdk is installed, and how its programs are kept from sending usage data."""

from collections.abc import Mapping
from importlib.util import find_spec

from calib_core.errors import InputError

__all__ = ["NO_NETWORK", "quiet_environment", "require_sdk"]

NO_NETWORK: Mapping[str, str] = {"CI": "1"}
"""Environment variables with which Rerun's programs neither collect nor send usage data: it never does where CI is set."""
_FORCED = "FORCE_RERUN_ANALYTICS"


def require_sdk() -> None:
    """Refuse to go on without rerun-sdk.

    Raises:
        InputError: it is not installed.
    """
    if find_spec("rerun") is None:
        raise InputError(
            "this command needs rerun-sdk, which is not installed (there is none for Intel Macs): pip install rerun-sdk; "
            "cocalib video --overlay and cocalib export --to mcap need no Rerun"
        )


def quiet_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Return an environment in which a program of Rerun's sends no usage data."""
    return {name: value for name, value in environment.items() if name != _FORCED} | dict(NO_NETWORK)
