"""An installed package that is not there: a module and its *.dist-info in a folder on sys.path."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest


def installing(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, group: str, found: Any, module: str, value: str
) -> Iterator[Callable[..., Path]]:
    """Yield what installs a package with one module and one entry point; afterwards it is as if it had never been there.

    Args:
        folder: for the packages; created, and put on sys.path.
        monkeypatch: of the test.
        name: of the package and, with underscores, of its module.
        group: of the entry point.
        found: the cached function that finds what packages add.
        module: the source of the module, unless another is given.
        value: the name in it that the entry point names, unless another is given.
    """
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    found.cache_clear()
    importable = name.replace("-", "_")

    def install(module: str = module, value: str = value) -> Path:
        (folder / f"{importable}.py").write_text(dedent(module), encoding="utf-8")
        info = folder / f"{importable}-1.2.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n", encoding="utf-8")
        (info / "entry_points.txt").write_text(f"[{group}]\nany = {importable}:{value}\n", encoding="utf-8")
        return info

    yield install
    found.cache_clear()
    sys.modules.pop(importable, None)
