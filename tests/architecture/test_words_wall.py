"""What people read is made in `calib_core/words`, and nothing reads it back."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from calib_core.words.text import Words

_READS = {
    "startswith",
    "endswith",
    "removeprefix",
    "removesuffix",
    "partition",
    "rpartition",
    "split",
    "rsplit",
    "replace",
}
_READS |= {"strip", "lstrip", "rstrip", "find", "index", "count", "splitlines"}
_TEXTS = {"message", "hint", "reason", "label", "action", "note", "answer"}
"""Fields that hold what a person reads."""
_MAY_READ = ("calib_core/words/", "calib_core/recordings/")
_JS = re.compile(
    r"\b(?:message|hint|reason|label|action|note|answer|assumes)\??"
    r"\.(?:startsWith|endsWith|includes|match|matchAll|replace|replaceAll|search|split|slice|substring|indexOf|test)\("
    r"|\.test\([\w.]*\.(?:message|hint|reason|label|action|note|answer)\)"
    r"|new RegExp\("
)
_OF_USERS = {
    "static/base/searching.js": "what the user types in the palette",
}


def _sources(root: Path, folders: tuple[str, ...], suffix: str) -> Iterator[tuple[str, str]]:
    for folder in folders:
        for path in sorted((root / folder).rglob(f"*{suffix}")):
            name = path.relative_to(root).as_posix()
            if not name.startswith(_MAY_READ):
                yield name, path.read_text(encoding="utf-8")


def _reads(node: ast.AST) -> bool:
    """Return whether a node looks into a text that people read."""

    def is_text(value: ast.expr) -> bool:
        return isinstance(value, ast.Attribute) and value.attr in _TEXTS

    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in _READS:
        return is_text(node.func.value)
    if isinstance(node, ast.Compare) and any(isinstance(operator, ast.In | ast.NotIn) for operator in node.ops):
        return any(is_text(value) for value in node.comparators)
    return isinstance(node, ast.Subscript) and is_text(node.value)


def test_no_python_reads_what_people_read(project_root: Path):
    found = [
        f"{name}:{node.lineno}: {ast.unparse(node)[:60]}"
        for name, text in _sources(project_root, ("app", "calib_core"), ".py")
        for node in ast.walk(ast.parse(text))
        if _reads(node)
    ]
    assert found == []


def test_no_script_of_the_page_reads_what_people_read(project_root: Path):
    found = [
        f"{name}:{number}: {line.strip()[:80]}"
        for name, text in _sources(project_root, ("static",), ".js")
        if name not in _OF_USERS
        for number, line in enumerate(text.splitlines(), 1)
        if _JS.search(line)
    ]
    assert found == []


def test_words_are_no_string():
    assert not issubclass(Words, str)
    assert not [name for name in ("__contains__", "__getitem__", "__iter__", *_READS) if hasattr(Words, name)]
