"""Load what other installed packages add to our registries through entry points.

A package that cannot be loaded is skipped with one warning in the log, which goes to stderr unless the program sets up
logging.
"""

import logging
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from importlib.metadata import Distribution, EntryPoint

_log = logging.getLogger(__name__)

Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Plugin(Generic[Value]):
    """One value added by an installed package.

    Attributes:
        distribution: the package's name and version.
        value: what it adds.
    """

    distribution: str
    value: Value


def load_plugins(group: str, kind: type[Value]) -> tuple[Plugin[Value], ...]:
    """Load what every installed package adds in a group of entry points.

    Nothing is loaded from the current folder, which Python may also search: a folder of recordings must not be able to run code.

    Args:
        group: name of the group; each entry point names a value of the kind, or a tuple of them.
        kind: the type of the values.
    """
    found: list[Plugin[Value]] = []
    for distribution, entry in _entries(group):
        try:
            if _is_in_current_folder(entry.module):
                here = f"{entry.module} is in the current folder, from which nothing is loaded"
                warn_skipped(distribution, here, "start the program in a different folder")
                continue
            loaded: Any = entry.load()
        except (Exception, SystemExit) as error:  # noqa: BLE001  a package's code may raise anything
            warn_skipped(distribution, f"{entry.value} cannot be loaded ({type(error).__name__}: {error})")
            continue
        values = loaded if isinstance(loaded, tuple) else (loaded,)
        if all(isinstance(value, kind) for value in values):
            found.extend(Plugin(distribution, value) for value in values)
        else:
            warn_skipped(distribution, f"{entry.value} is neither a {kind.__name__} nor a tuple of them")
    return tuple(found)


def warn_skipped(distribution: str, fault: str, hint: str = "update or uninstall it") -> None:
    """Log in one line that something from an installed package is skipped, why, and what to do."""
    _log.warning("cocalib: skipped a plug-in of the package %s: %s; %s", distribution, " ".join(fault.split()), hint)


def _entries(group: str) -> Iterator[tuple[str, "EntryPoint"]]:
    """Yield the entry points of a group with their distribution's name and version; of two with the same name, the first."""
    from importlib.metadata import distributions

    seen = set()
    for distribution in distributions(path=_folders()):
        try:
            entries = [entry for entry in distribution.entry_points if entry.group == group]
        except (OSError, ValueError, LookupError, TypeError) as error:
            warn_skipped(_name(distribution), f"its entry points cannot be read ({error})")
            continue
        name = _name(distribution) if entries else ""
        if entries and name.partition(" ")[0] not in seen:
            seen.add(name.partition(" ")[0])
            yield from ((name, entry) for entry in entries)


def _is_in_current_folder(module: str) -> bool:
    """Return whether Python would find a module in the current folder, without importing it."""
    from importlib.util import find_spec

    spec = find_spec(module.partition(".")[0])
    places = (spec.submodule_search_locations or (spec.origin,)) if spec is not None else ()
    return any(_current_folder() == Path(place).resolve().parent for place in places if place is not None)


def _folders() -> list[str]:
    """Return the folders of installed packages, without the current folder, which `python -m` or an empty PYTHONPATH may add."""
    return [folder for folder in sys.path if folder and Path(folder).resolve() != _current_folder()]


def _current_folder() -> Path | None:
    """Return the current folder; None if it has been deleted."""
    try:
        return Path.cwd()
    except OSError:
        return None


def _name(distribution: "Distribution") -> str:
    metadata = distribution.metadata
    return f"{metadata['Name'] or 'without a name'} {metadata['Version'] or ''}".strip()
