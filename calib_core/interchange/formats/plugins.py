"""Formats of other installed packages (entry points cocalib.formats): checked when loaded, guarded when called."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from calib_core.errors import CalibrationError, InputError
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.imported import ImportedCalibration
from calib_core.interchange.syntax.content import Content
from calib_core.plugins import Plugin, load_plugins, warn_left_out

__all__ = ["GROUP", "plugin_formats"]

GROUP = "cocalib.formats"
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")


@cache
def plugin_formats(reserved: frozenset[str]) -> tuple[Format, ...]:
    """Return the formats that installed packages add; loaded once, when somebody first asks.

    Args:
        reserved: names that are taken.
    """
    taken = set(reserved)
    formats = []
    for plugin in load_plugins(GROUP, Format):
        name = plugin.value.name
        if not _NAME.fullmatch(name):
            warn_left_out(plugin.distribution, f"the name {name!r} of its format is not of a-z, 0-9 and single hyphens")
        elif name in taken:
            warn_left_out(plugin.distribution, f"there is a format {name!r} already; its own needs another name")
        else:
            taken.add(name)
            formats.append(_guarded(plugin))
    return tuple(formats)


def _guarded(plugin: Plugin[Format]) -> Format:
    """Return a format whose functions fail in words that name the package."""
    added = plugin.value
    owner = f"the format {added.name} of the package {plugin.distribution}"

    def guard(call: Any, returns: type | tuple[type, ...]) -> Any:
        return None if call is None else _Guarded(owner, call, returns)

    reads = added.reads
    return replace(
        added,
        write=guard(added.write, (str, bytes)),
        write_in_parent=guard(added.write_in_parent, (str, bytes)),
        reads=reads
        and Reads(_GuardedRecognizer(plugin.distribution, reads.recognizes), guard(reads.read, ImportedCalibration)),
    )


@dataclass(frozen=True, slots=True)
class _Guarded:
    """A function of a package: what it raises and what it returns is made an error in words."""

    owner: str
    call: Callable[..., Any]
    returns: type | tuple[type, ...]

    def __call__(self, *arguments: Any) -> Any:
        try:
            result = self.call(*arguments)
        except CalibrationError:
            raise
        except Exception as error:  # a package's code may raise anything
            raise InputError(f"{self.owner} failed ({type(error).__name__}: {error}); tell its authors") from error
        if not isinstance(result, self.returns):
            raise InputError(f"{self.owner} failed (it returned {type(result).__name__}); tell its authors")
        return result


@dataclass(frozen=True, slots=True)
class _GuardedRecognizer:
    """A package's word on whether a file is its own; where it fails, the file is not."""

    distribution: str
    call: Callable[[Content], bool]

    def __call__(self, content: Content) -> bool:
        try:
            return bool(self.call(content))
        except Exception as error:  # noqa: BLE001  the same
            warn_left_out(self.distribution, f"it cannot tell its files ({type(error).__name__}: {error})")
            return False
