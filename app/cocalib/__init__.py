"""The front door: every public name of `calib_core`, loaded on first use; neither viser nor the command line is loaded."""

from typing import TYPE_CHECKING, Any

import calib_core

if TYPE_CHECKING:
    from calib_core import *  # noqa: F403  (for type checkers and editors)
    from calib_core.recordings import Recording

__all__ = sorted([*calib_core.__all__, "sample_recording"])


def sample_recording() -> "Recording":
    """Open the simulated recording that comes with cocalib; its clicks are in `clicks.json` beside its files, `.paths`."""
    from calib_core.recordings import open_recording
    from cocalib.platform.resources import sample_folder

    folder = sample_folder() / "rooftop"
    return open_recording([folder / "radar.bag", folder / "camera.bag"])


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'cocalib' has no attribute {name!r}; its public names are in cocalib.__all__")
    return getattr(calib_core, name)


def __dir__() -> list[str]:
    return __all__
