"""Every warning of a calibration is explained in docs/warnings.md, and has a message and a hint."""

import ast
import re
from pathlib import Path


def _warnings(project_root: Path) -> dict[str, list[ast.Call]]:
    found: dict[str, list[ast.Call]] = {}
    core = project_root / "calib_core"
    rooms = [path for room in ("diagnostics", "paper", "results") for path in (core / room).rglob("*.py")]
    for path in sorted([*rooms, core / "estimation" / "plausibility.py"]):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "DataWarning":
                code = node.args[0]
                assert isinstance(code, ast.Constant)
                found.setdefault(str(code.value), []).append(node)
    return found


def test_the_page_explains_every_code_and_no_other(project_root):
    page = (project_root / "docs" / "warnings.md").read_text(encoding="utf-8")
    explained = set(re.findall(r"^\| `([a-z-]+)` \|", page, re.MULTILINE))
    assert explained == set(_warnings(project_root))


def test_every_warning_has_a_code_a_message_and_a_hint(project_root):
    warnings = _warnings(project_root)
    assert len(warnings) > 10
    assert [code for code, calls in warnings.items() if any(len(call.args) != 3 for call in calls)] == []
