"""The notebook in docs/ matches the script that writes it, and its cells still print the output it shows."""

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType

import pytest

_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


@pytest.fixture(scope="module")
def maker(project_root: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_notebook", project_root / "docs" / "make_notebook.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_notebook_holds_the_scripts_cells_and_prints_the_same_today(maker):
    kept, today = json.loads(maker.NOTEBOOK.read_text(encoding="utf-8")), json.loads(maker.notebook())
    assert [cell["source"] for cell in kept["cells"]] == [cell["source"] for cell in today["cells"]]
    for before, now in zip(kept["cells"], today["cells"], strict=True):
        shown, printed = (
            "".join(line for out in one.get("outputs", []) for line in out["text"]) for one in (before, now)
        )
        assert _NUMBER.sub("#", printed) == _NUMBER.sub("#", shown)
        numbers = [[float(number) for number in _NUMBER.findall(text)] for text in (shown, printed)]
        assert numbers[1] == pytest.approx(numbers[0], rel=1e-2, abs=2e-3)
