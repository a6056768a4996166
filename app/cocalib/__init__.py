"""The front door: every public name of `calib_core`, loaded on first use; neither viser nor the command line is loaded."""

from typing import TYPE_CHECKING, Any

import calib_core

if TYPE_CHECKING:
    from calib_core import *  # noqa: F403  (for type checkers and editors)

__all__ = calib_core.__all__


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'cocalib' has no attribute {name!r}; its public names are in cocalib.__all__")
    return getattr(calib_core, name)


def __dir__() -> list[str]:
    return __all__
