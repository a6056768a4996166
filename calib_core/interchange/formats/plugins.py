"""Formats of other installed packages (entry points cocalib.formats), checked when loaded and guarded when called."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from calib_core.errors import CalibrationError, InputError
from calib_core.interchange.format import Format, ImportedCalibration, Reads
from calib_core.interchange.syntax.content import Content
from calib_core.plugins import Plugin, load_plugins, warn_skipped

GROUP = "cocalib.formats"
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")


@cache
def plugin_formats(reserved: frozenset[str]) -> tuple[Format, ...]:
    """Return the formats that installed packages add, loaded once, on first use.

    Args:
        reserved: names that are already taken.
    """
    taken = set(reserved)
    formats = []
    for plugin in load_plugins(GROUP, Format):
        name = plugin.value.name
        if not _NAME.fullmatch(name):
            warn_skipped(plugin.distribution, f"the format name {name!r} may contain only a-z, 0-9 and single hyphens")
        elif name in taken:
            warn_skipped(plugin.distribution, f"the format name {name!r} is already taken")
        else:
            taken.add(name)
            formats.append(_guarded(plugin))
    return tuple(formats)


def _guarded(plugin: Plugin[Format]) -> Format:
    """Return a format whose functions fail with an error that names the package."""
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
        and Reads(
            _GuardedRecognizer(plugin.distribution, reads.recognizes),
            guard(reads.read, ImportedCalibration),
            reads.beside,
        ),
    )


@dataclass(frozen=True, slots=True)
class _Guarded:
    """A function of a package; what it raises, or returns with the wrong type, becomes an InputError."""

    owner: str
    call: Callable[..., Any]
    returns: type | tuple[type, ...]

    def __call__(self, *arguments: Any) -> Any:
        try:
            result = self.call(*arguments)
        except CalibrationError:
            raise
        except Exception as error:  # a package's code may raise anything
            raise InputError(
                f"{self.owner} failed ({type(error).__name__}: {error}); report it to its authors"
            ) from error
        if not isinstance(result, self.returns):
            raise InputError(f"{self.owner} failed (it returned {type(result).__name__}); report it to its authors")
        return result


@dataclass(frozen=True, slots=True)
class _GuardedRecognizer:
    """A package's recognizer; if it fails, the file counts as not recognized."""

    distribution: str
    call: Callable[[Content], bool]

    def __call__(self, content: Content) -> bool:
        try:
            return bool(self.call(content))
        except Exception as error:  # noqa: BLE001  the same
            warn_skipped(self.distribution, f"its recognizer failed ({type(error).__name__}: {error})")
            return False
