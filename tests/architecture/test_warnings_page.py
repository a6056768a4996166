"""Every warning and outcome that the program finds has a row of words with the facts it states, and a row in the docs."""

import ast
import inspect
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from calib_core.words import evaluation, intrinsics
from calib_core.words.outcomes import OUTCOMES
from calib_core.words.remark import Row
from calib_core.words.unpaired import UNPAIRED
from calib_core.words.warnings import ROWS, SOLVER
from docs.make_warnings_table import PAGE, with_tables


def _stated(root: Path, kind: str) -> Iterator[tuple[str, ast.Call]]:
    """Yield the code and the call of each value of a kind that states facts."""
    for path in sorted([*(root / "calib_core").rglob("*.py"), *(root / "app").rglob("*.py")]):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if f"{kind}(" in text else ():
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == kind:
                yield from ((code, node) for code in _codes(node.args[0], path))


def _codes(argument: ast.expr, path: Path) -> list[str]:
    if isinstance(argument, ast.Constant):
        return [str(argument.value)]
    if isinstance(argument, ast.IfExp):
        return [*_codes(argument.body, path), *_codes(argument.orelse, path)]
    assert isinstance(argument, ast.Name), ast.unparse(argument)
    names = {node.targets[0].id: node.value for node in ast.parse(path.read_text(encoding="utf-8")).body
             if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)}  # fmt: skip
    return _codes(names[argument.id], path)


def _facts(call: ast.Call) -> set[str]:
    """Return the facts that a call states by name; those that come from elsewhere (`**away`, a variable) are not seen."""
    given = call.args[1] if len(call.args) > 1 else ast.Dict([], [])
    keys = given.keys if isinstance(given, ast.Dict) else []
    return {str(key.value) for key in keys if isinstance(key, ast.Constant)}


@pytest.mark.parametrize(("kind", "rows"), [("DataWarning", ROWS), ("Unsolvable", OUTCOMES), ("Unpaired", UNPAIRED)])
def test_every_code_has_a_row_whose_parameters_are_its_facts(project_root: Path, kind: str, rows: Mapping[str, Row]):
    calls = list(_stated(project_root, kind))
    assert {code for code, _ in calls} == set(rows)
    for code, call in calls:
        known = inspect.signature(rows[code]).parameters
        assert _facts(call) <= set(known), code
        whole = len(call.args) < 2 or (isinstance(call.args[1], ast.Dict) and None not in call.args[1].keys)
        needed = {name for name, parameter in known.items() if parameter.default is inspect.Parameter.empty}
        assert not whole or needed <= _facts(call), code


def test_the_page_has_the_rows_and_consequences_of_the_program():
    page = PAGE.read_text(encoding="utf-8")
    assert with_tables(page) == page, "run: python docs/make_warnings_table.py"
    assert all(row.__doc__ for row in SOLVER.values())


@pytest.mark.parametrize(
    ("page", "codes"),
    [
        ("intrinsics", {*intrinsics.WARNINGS}),
        ("evaluation", {*evaluation.WARNINGS, "other-lens"}),
    ],
)
def test_a_page_explains_every_code_of_its_subject_and_no_other(project_root: Path, page: str, codes: set[str]):
    text = (project_root / "docs" / f"{page}.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `([a-z]+-[a-z-]+)` \|", text, re.MULTILINE)) == codes


_MAY_REPORT = (
    *("calib_core/recordings/", "calib_core/interchange/importing.py", "calib_core/words/outcomes.py"),
    *("app/cocalib/session/file/", "app/cocalib/opening/opened.py", "app/cocalib/report/"),
    "app/cocalib/evaluation/recording_check.py",
)
"""What reads recordings and files, and repeats what those say."""


def test_only_what_reads_recordings_and_files_repeats_the_words_of_others(project_root: Path):
    for path in (*(project_root / "calib_core").rglob("*.py"), *(project_root / "app").rglob("*.py")):
        name = path.relative_to(project_root).as_posix()
        assert name.startswith(_MAY_REPORT) or ".reported(" not in path.read_text(encoding="utf-8"), name
