"""The page's modules, named in its head: the browser asks for all of them at once, not for each after the one that imports it."""

import posixpath
import re
from collections.abc import Iterator
from pathlib import Path

_IMPORT = re.compile(r"""^(?:import|export)\b[^'"();]*?["'](\.\.?/[a-z0-9_./]+\.js)["']""", re.MULTILINE)
_SCRIPT = re.compile(r'<script type="module" src="([a-z0-9_/]+\.js)">')


def with_preloaded_modules(page: str, folder: Path) -> str:
    """Return the page with a `modulepreload` link for each module that its scripts import, directly or not.

    Args:
        page: HTML with a head.
        folder: where the modules are.
    """
    names: dict[str, None] = {}
    for script in _SCRIPT.findall(page):
        _collect(script, folder, names)
    links = "".join(f'<link rel="modulepreload" href="{name}">' for name in names)
    return page.replace("</head>", f"{links}</head>", 1)


def _collect(name: str, folder: Path, names: dict[str, None]) -> None:
    """Add a module and all that it imports, each once."""
    if name in names:
        return
    names[name] = None
    for imported in _imports(folder / name):
        _collect(posixpath.normpath(posixpath.join(posixpath.dirname(name), imported)), folder, names)


def _imports(module: Path) -> Iterator[str]:
    """Yield the paths that a module names, as it writes them."""
    yield from _IMPORT.findall(module.read_text(encoding="utf-8"))
