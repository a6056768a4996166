"""The list of constants: what counts, what is said of each, and what doubling one changes."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

SOURCE = '''
"""A room."""
_LEAST_M = 0.3  # as the bins of the radar
# Pairs that a test needs (Fisher).
_LEAST_PAIRS = 7
_TABLE = {"near": 4.5, "far": 9.0}
"""Standard deviations, from the data sheet."""


def solve(values, limit=0.05):
    return values[5, :3] * 1.25 + limit * 2.0
'''


@pytest.fixture(scope="module")
def listing(project_root: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("constants", project_root / ".ci" / "constants.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["constants"] = module
    spec.loader.exec_module(module)
    return module


def test_tables_and_functions_count_alike_with_what_is_said_beside(listing, tmp_path):
    path = tmp_path / "calib_core" / "estimation" / "room.py"
    path.parent.mkdir(parents=True)
    path.write_text(SOURCE)
    every = {one.name.partition(":")[2]: one for one in listing.constants(path, tmp_path)}
    assert list(every) == ["_LEAST_M.0", "_LEAST_PAIRS.0", "_TABLE.0", "_TABLE.1", "solve.0", "solve.1"]
    assert [one.has_unit for one in every.values()] == [True, True, True, True, False, False]
    assert [bool(one.said) for one in every.values()] == [True, True, True, True, False, False]


def test_the_doubled_source_differs_in_one_number(listing, tmp_path, monkeypatch):
    path = tmp_path / "calib_core" / "estimation" / "room.py"
    path.parent.mkdir(parents=True)
    path.write_text(SOURCE)
    seen: list[str] = []

    def run(command, *, env, **_):
        copy = Path(env["PYTHONPATH"].split(":")[0]) / "calib_core" / "estimation" / "room.py"
        seen.append(copy.read_text())
        return type("Done", (), {"returncode": 0})

    monkeypatch.setattr(listing.subprocess, "run", run)
    (doubled,) = [one for one in listing.constants(path, tmp_path) if one.name.endswith("_TABLE.1")]
    assert listing.run_doubled(doubled, tmp_path) == 0
    assert seen == [SOURCE.replace("9.0", "(2 * 9.0)")]
