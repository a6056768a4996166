"""Every module has an `__all__` that is sorted and names only what exists."""

import ast
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MODULES = sorted(
    ".".join(path.relative_to(home).with_suffix("").parts).removesuffix(".__init__")
    for home, package in ((ROOT / "app", "cocalib"), (ROOT, "calib_core"))
    for path in (home / package).rglob("*.py")
    if not path.stem.startswith("_") or path.stem == "__init__"
)


def defined_by(module: str) -> list[str]:
    """Return the public classes and functions that a module itself defines."""
    path = (ROOT / "app" if module.startswith("cocalib") else ROOT).joinpath(*module.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    body = ast.parse(file.read_text(encoding="utf-8")).body
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    return [node.name for node in body if isinstance(node, kinds) and not node.name.startswith("_")]


@pytest.mark.parametrize("module", MODULES)
def test_a_module_lists_its_public_names_sorted(module: str) -> None:
    loaded = importlib.import_module(module)
    names = getattr(loaded, "__all__", None)
    if names is None:
        assert defined_by(module) == [], "public names, but no __all__"
        return
    assert all(hasattr(loaded, name) for name in names)
    assert len(set(names)) == len(names)
    upper_case, classes, others = (
        sorted(name for name in names if name.isupper()),
        sorted(name for name in names if not name.isupper() and name.lstrip("_")[:1].isupper()),
        sorted(name for name in names if not name.lstrip("_")[:1].isupper()),
    )
    assert list(names) == upper_case + classes + others


def test_the_list_of_modules_is_not_empty() -> None:
    assert len(MODULES) > 30
