"""Every imported dependency is declared, and every declared one is imported."""

import ast
import importlib.metadata
import re
import sys
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

AWAITED: dict[str, str] = {}
"""Dependencies that are declared but not imported yet, and why."""

OWN = {"calib_core", "cocalib"}


def imported_modules(root: Path) -> dict[str, set[str]]:
    """Return every third-party module that our packages import, and the files that import it."""
    found: dict[str, set[str]] = {}
    for path in sorted(file for folder in ("app", "calib_core") for file in (root / folder).rglob("*.py")):
        for name in imported_names(ast.parse(path.read_text(encoding="utf-8"))):
            top = name.split(".")[0]
            # compression is new in Python 3.14; before that, backports-zstd replaces it
            if top not in OWN | {"compression"} | sys.stdlib_module_names:
                found.setdefault(top, set()).add(str(path.relative_to(root)))
    return found


def imported_names(tree: ast.Module) -> Iterator[str]:
    """Yield the modules that a file imports when it runs."""
    only_for_types = {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        for statement in node.body
        for inner in ast.walk(statement)
    }
    for node in ast.walk(tree):
        if node in only_for_types:
            continue
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module


@pytest.fixture(scope="module")
def modules(project_root: Path) -> dict[str, set[str]]:
    return imported_modules(project_root)


@pytest.fixture(scope="module")
def distributions() -> defaultdict[str, set[str]]:
    """Return the normalised names of the installed distributions that contain a top-level module, by the module."""
    installed = importlib.metadata.packages_distributions().items()
    return defaultdict(
        set, {module: {re.sub(r"[-_.]+", "-", name).lower() for name in names} for module, names in installed}
    )


@pytest.fixture(scope="module")
def declared(project_root: Path) -> set[str]:
    """Return the names of the dependencies that the program declares, extras included; the extra `all` names only the others."""
    project = tomllib.loads((project_root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = [*project["dependencies"], *(line for extra in project["optional-dependencies"].values() for line in extra)]
    lines.remove("cocalib[rerun,video,cluster]")
    return {re.split(r"[^\w-]", line)[0].lower() for line in lines}


def test_every_module_that_is_imported_comes_with_a_declared_dependency(modules, distributions, declared):
    assert {"numpy", "cv2", "lz4", "backports"} <= set(modules)
    undeclared = {
        module: sorted(files) for module, files in modules.items() if distributions[module].isdisjoint(declared)
    }
    assert undeclared == {}, "declare the dependencies of these modules in pyproject.toml, or do not import them"


def test_every_declared_dependency_is_imported(modules, distributions, declared):
    imported = {name for module in modules for name in distributions[module]}
    assert declared - imported == set(AWAITED), "remove unused dependencies from pyproject.toml"


def test_every_dependency_has_a_lowest_and_an_upper_bound(project_root):
    project = tomllib.loads((project_root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    pattern = re.compile(r"[a-z][a-z0-9-]*>=\d[\d.]*,<\d[\d.]*(; .+)?")
    assert [line for line in project["dependencies"] if not pattern.fullmatch(line)] == []
