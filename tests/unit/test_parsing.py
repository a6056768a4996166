"""JSON, TOML and YAML of strangers: whatever a text holds, parsing it ends soon, in values or in words."""

import ast
import json
from pathlib import Path

import pytest

from calib_core.errors import InputError
from calib_core.parsing import json_form, json_rows, json_value, python_tree, toml_table, yaml_documents, yaml_nodes

MERGES = "a0: &a0 {x: 1}\n" + "".join(f"a{n}: &a{n} {{<<: [*a{n - 1}, *a{n - 1}]}}\n" for n in range(1, 36))
ALIASES = "a0: &a0 [1, 1]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 40))
DIGITS = "9" * 101


@pytest.mark.slow
@pytest.mark.parametrize("parse", [yaml_documents, yaml_nodes])
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (MERGES, "line 2: .* write the keys out"),
        ("a: &a {x: 1}\nb: {!!merge k: *a}\n", "line 2: .* write the keys out"),
        (ALIASES, "line 12: more than 10,000 values"),
        ("a: &a [*a]\n", "line 1: more than 10,000 values"),
        ("--- &a 1\n--- &a [*a]\n", "line 2: more than 10,000 values"),
        ("- 1\n" * 10_001, "line 10000: more than 10,000 values"),
        (f"a: 1\nb: {DIGITS}\n", "line 2: an integer of more than 100 digits"),
        (f"a: 0x{'f' * 200}\n", "line 1: an integer of more than 100 digits"),
        ("[" * 100_000, "nested too deeply"),
        ("a: " + "x" * 256 * 1024, "at most 262,144 are read of YAML"),
    ],
)
def test_yaml_that_grows_or_nests_without_end_is_refused(parse, text, reason):
    with pytest.raises(InputError, match=f"^a.yaml: {reason}|^a.yaml: .*{reason}"):
        parse(text, source="a.yaml")


@pytest.mark.parametrize("text", ["a: !!timestamp x\n", "a: !!int x\n", "a: !!bool x\n", "a: !!python/none x\n"])
def test_yaml_that_its_constructors_cannot_take_is_not_yaml(text):
    with pytest.raises(InputError, match="not YAML"):
        yaml_documents(text, source="a.yaml")


def test_aliases_are_read_as_what_they_stand_for():
    assert yaml_documents("a: &a [1, 2]\nb: *a\nc: &a 3\nd: *a\n", source="") == (
        {"a": [1, 2], "b": [1, 2], "c": 3, "d": 3},
    )
    assert yaml_documents('"<<": 1\n', source="") == ({"<<": 1},)


def test_a_header_of_opencv_moves_no_place():
    text = "%YAML:1.0\n---\nrows: 3\n"
    (node,) = yaml_nodes(text, source="")
    (value,) = (value for _, value in node.value)
    assert text[value.start_mark.index : value.end_mark.index] == "3"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (f'{{"a": 1,\n"b": {DIGITS}}}', "line 2: an integer of more than 100 digits"),
        (f"[{'9' * 5000}]", "line 1: an integer of more than 100 digits"),
        ("[" * 100_000, "nested too deeply"),
        ("[" * 101 + "]" * 101, "nested too deeply"),
        ("[" + "[]," * 1_000_000 + "1]", "characters are too many"),
        ('{"a": 1, "a": 2}', "'a' appears twice"),
    ],
)
def test_json_that_is_too_large_or_too_deep_is_refused(text, reason):
    with pytest.raises(InputError, match=f"^a.json: .*{reason}"):
        json_value(text, source="a.json")


@pytest.mark.parametrize(
    "row", ["[" * 100_000, "[" * 101 + "]" * 101, f"[{DIGITS}]", f"[{'9' * 5000}]", '{"a": 1, "a": 2}']
)
def test_a_row_of_json_that_exceeds_a_limit_is_refused(row, tmp_path):
    (tmp_path / "a.json").write_text(f"[[1], {row}]")
    with pytest.raises(InputError, match=r"^a\.json: row 2: "):
        list(json_rows(tmp_path / "a.json", source="a.json"))


def test_json_of_our_own_has_the_same_limits():
    for text in ("[" * 100_000, "[" + "[]," * 1_000_000, f"[{'9' * 5000}]", '["\\ud800"]', b"\xff", "[null]", "\ud800"):
        with pytest.raises(InputError):
            json_form(text, list[object] if text == "\ud800" else list[int])


@pytest.mark.slow
def test_rows_of_any_size_are_read_one_by_one(tmp_path):
    path = tmp_path / "rows.json"
    path.write_text(json.dumps([{"n": number, "of": [1.5]} for number in range(80_000)]))
    rows = list(json_rows(path, source="", numbers_as_text=True))
    assert (len(rows), rows[-1]) == (80_000, {"n": "79999", "of": ["1.5"]})


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (f"a = 1\nb = {'9' * 5000}", "line 2: an integer of more than 100 digits"),
        (f"a = 0x{'f' * 5000}", "an integer of more than 100 digits"),
        ("a = " + "[" * 30_000, "nested too deeply"),
        ("a." * 30_000 + "a = 1", "nested too deeply"),
        ("a." * 200 + "a = 1", "nested too deeply"),
        ("[" + "a." * 100 + "a]\n", "nested too deeply"),
        ("a = 1\n" * 200_001, "too many for TOML"),
        ("a = = 1", "line 1"),
    ],
)
def test_toml_that_is_too_large_or_too_deep_is_refused(text, reason):
    with pytest.raises(InputError, match=f"^a.toml: .*{reason}"):
        toml_table(text, source="a.toml")


@pytest.mark.parametrize(
    "text", ["-" * 50_000 + "1", "[" * 5000, "1" * 5000, "0x" + "f" * 5000, "f'" + "{a}" * 30_000 + "'", "a\0b", "{"]
)
def test_python_that_is_too_large_or_too_deep_is_refused(text):
    for mode in ("exec", "eval"):
        with pytest.raises(InputError, match=r"^a\.py: "):
            python_tree(text, source="a.py", mode=mode)


def test_a_literal_may_hold_long_bytes():
    tree = python_tree(f"{{'inputs': b'{'A' * 100_000}'}}", source="", mode="eval")
    assert len(ast.literal_eval(tree)["inputs"]) == 100_000


def test_only_one_module_calls_the_parsers_of_these_languages():
    """A second loader would have limits of its own, or none."""
    root = Path(__file__).parents[2]
    calls = ("tomllib", "json.loads(", "json.load(", "JSONDecoder", "msgspec.json.decode", "ruamel")
    found = {
        path.relative_to(root).as_posix()
        for package in ("calib_core", "app")
        for path in (root / package).rglob("*.py")
        if any(call in path.read_text(encoding="utf-8") for call in calls)
    }
    assert found == {"calib_core/parsing.py"}
