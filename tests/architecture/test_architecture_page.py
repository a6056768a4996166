"""No circle of imports, and ARCHITECTURE.md names folders that exist."""

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="module")
def structure(project_root: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("structure", project_root / ".ci" / "structure.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def graph(structure: ModuleType, project_root: Path) -> dict[str, set[str]]:
    """Return which modules each module imports."""
    return structure.imports(project_root)


@pytest.fixture(scope="module")
def page(project_root: Path) -> str:
    return (project_root / "ARCHITECTURE.md").read_text(encoding="utf-8")


def test_rooms_have_no_circular_imports(structure, graph):
    for folder in {name.rpartition(".")[0] for name in graph} - {""}:
        structure.floors(structure.between_rooms(graph, folder))
    with pytest.raises(ValueError, match="circular imports among a, b"):
        structure.floors({"a": {"b"}, "b": {"a"}, "c": set()})


def test_a_house_that_has_grown_by_a_tenth_is_named(structure, tmp_path):
    for folder in ("app/cocalib", "calib_core", "static", ".ci"):
        (tmp_path / folder).mkdir(parents=True)
    for number in range(10):
        (tmp_path / "calib_core" / f"room_{number}.py").write_text("")
    list(structure.keep(tmp_path))
    assert list(structure.grown(tmp_path)) == []
    (tmp_path / "calib_core" / "one_more.py").write_text("")
    assert [line.split(": ")[1:3] for line in structure.grown(tmp_path)] == [
        ["files", "11, was 10; join, or run"],
        ["calib_core", "11, was 10; join, or run"],
    ]


def test_the_paths_it_names_exist(page, project_root):
    named = set(re.findall(r"`((?:app|calib_core|static|docs|tests|\.ci)/[\w./]+)`", page))
    assert len(named) > 15
    assert {
        path for path in named if not (project_root / path).exists() and not (project_root / f"{path}.py").exists()
    } <= {"calib_core/lens_models/"}
