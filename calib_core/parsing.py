"""Parse JSON, TOML, YAML and Python: the one loader of each, with limits of size, depth, number of values and digits.

Whatever a text holds, parsing it ends within 2 s of processor time and takes memory in proportion to the text. What walks the
values afterwards may recurse, print every integer and make a float of it.
"""

import ast
import json
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from calib_core.errors import InputError
from calib_core.json_forms import from_json

Form = TypeVar("Form")

_MAX_DEPTH = 100
_MAX_DIGITS = 100
_MAX_JSON_CHARACTERS = 64 * 1024 * 1024
_MAX_JSON_COST = 3_000_000
"""A list, an object and a key cost 4, a number costs 1: up to 0.5 us each."""
_MAX_TOML_CHARACTERS = 2 * 1024 * 1024
_MAX_TOML_MARKS = 200_000
"""Up to 8 us each."""
_MAX_TOML_DOTS, _MAX_TOML_HEADER_DOTS = 1e7, 10
"""Of each line the dots squared, together, as the effort of a dotted key grows with the square of its parts; and the dots of a
table's name, which is read again with each of its keys."""
_MAX_YAML_CHARACTERS = 256 * 1024
_MAX_YAML_VALUES = 10_000
"""With aliases written out; up to 0.17 ms each."""
_MAX_PYTHON_CHARACTERS = 64 * 1024
"""Without bytes in quotes; formatted strings take time that grows with the square of their length."""
_BYTES_LITERAL = re.compile(r"\bb'[^'\n\\]*'")
_OPENCV_TAG = "tag:yaml.org,2002:opencv-matrix"
_MERGE_TAG = "tag:yaml.org,2002:merge"
_TOO_MANY_DIGITS = f"an integer of more than {_MAX_DIGITS} digits; correct it"
_TOO_DEEP = "nested too deeply; correct the file"
_LARGEST = 10**_MAX_DIGITS
_LONG_INTEGER = re.compile(rf"(?<![\d.])[\d_]{{{_MAX_DIGITS + 1}}}")
_RIGHT_FILE = "is it the right file? If so, keep only the part of it that is needed"


class _RefusedError(ValueError):
    """What is wrong with a text, where, and what to do, as found while it is parsed."""


def json_value(text: str, *, source: str, numbers_as_text: bool = False) -> Any:
    """Parse JSON text; keys may not repeat within an object.

    Args:
        text: the file's content.
        source: the name of the file in error messages.
        numbers_as_text: leave numbers as they are written: a float rounds nanoseconds.

    Raises:
        InputError: it is not JSON, or exceeds a limit.
    """
    try:
        _require_cheap(text)
        content = _json_decoder(numbers_as_text=numbers_as_text).decode(text.removeprefix("\ufeff"))
        _require_plain(content, text)
        return content
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        if not error.doc.strip():
            raise InputError(f"{source}: the file is empty; was it copied completely?") from None
        if error.pos >= len(error.doc.rstrip()):
            raise InputError(
                f"{source}: {where}: not JSON: the file ends too early; was it copied completely?"
            ) from None
        if not error.doc[: error.pos].strip():
            begins = error.doc.strip().splitlines()[0][:20]
            raise InputError(f"{source}: not a JSON file, it begins with {begins!r}; give another file") from None
        raise InputError(f"{source}: {where}: not JSON ({error.msg}); correct it there") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: {_reason(error, text)}") from None


def json_form(data: str | bytes, form: type[Form]) -> Form:
    """Parse JSON of the program's own as a type; whoever knows the file's name adds it to the error.

    Raises:
        InputError: it is not JSON, or not of this type.
    """
    try:
        _require_cheap(data)
        return msgspec.json.decode(data, type=form, dec_hook=from_json)
    except (msgspec.DecodeError, UnicodeError) as error:
        raise InputError(str(error)) from None
    except (ValueError, RecursionError) as error:
        raise InputError(_reason(error)) from None


_FIRST_ROW, _NEXT_ROW, _NO_ROW = (
    re.compile(rf"\s*{mark}\s*") for mark in (r"\[\s*(?=[{\[])", r",\s*(?=[{\[])", r"(\[\s*)?\]")
)
_LONGEST_ROW = 1 << 20


def json_rows(path: Path, *, source: str, numbers_as_text: bool = False) -> Iterator[Any]:
    """Yield the objects or lists in a JSON list one by one, of a file of any size.

    Args:
        path: of the file.
        source: its name in error messages.
        numbers_as_text: leave numbers as they are written.

    Raises:
        InputError: it cannot be read, is no list of objects, or one of them is longer than a megabyte or exceeds a limit.
    """
    decoder, text, count = _json_decoder(numbers_as_text=numbers_as_text), "", 0
    try:
        with path.open(encoding="utf-8-sig") as file:
            while len(text) <= 2 * _LONGEST_ROW and (more := file.read(_LONGEST_ROW)):
                text, at = text + more, 0
                while start := (_NEXT_ROW if count else _FIRST_ROW).match(text, at):
                    try:
                        row, end = decoder.raw_decode(text, start.end())
                    except json.JSONDecodeError:  # as it is where the text read so far ends
                        break
                    _require_plain(row, "")
                    at, count = end, count + 1
                    yield row
                text = text[at:]
    except OSError as error:
        raise InputError(f"{source}: cannot be read: {error.strerror or error}; check its permissions") from None
    except UnicodeDecodeError:
        raise InputError(f"{source}: row {count + 1:,} is not text in UTF-8; copy it again") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: row {count + 1:,}: {_reason(error)}") from None
    if not (_NO_ROW.fullmatch(text) and bool(count) != ("[" in text)):
        raise InputError(
            f"{source}: expected a list of rows in braces, and found something else after {count:,} of them; "
            "is it the right file, and was it copied completely?"
        )


def toml_table(text: str, *, source: str) -> dict[str, Any]:
    """Parse TOML text.

    Raises:
        InputError: it is not TOML, or exceeds a limit.
    """
    try:
        if len(text) > _MAX_TOML_CHARACTERS or sum(map(text.count, "\n=,[{")) > _MAX_TOML_MARKS:
            raise _RefusedError(f"{len(text):,} characters are too many for TOML; {_RIGHT_FILE}")
        lines = text.split("\n")
        headers = (line for line in lines if line.lstrip().startswith("["))
        dotted = sum(line.count(".") ** 2 for line in lines) > _MAX_TOML_DOTS
        if dotted or any(line.count(".") > _MAX_TOML_HEADER_DOTS for line in headers):
            raise RecursionError
        content = tomllib.loads(text)
        _require_plain(content, text)
        return content
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{source}: not valid TOML: {str(error)[:1].lower()}{str(error)[1:]}; correct it") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: {_reason(error, text)}") from None


def yaml_documents(text: str, *, source: str) -> tuple[Any, ...]:
    """Parse each document of a YAML text; empty ones are left out, such as after the last --- of `ros2 topic echo`.

    OpenCV's dialect is YAML here, too: a matrix is a mapping with rows, cols and data.

    Raises:
        InputError: it is not YAML, merges keys (<<), or exceeds a limit.
    """
    values = _of_yaml(text, lambda loader, node: loader.constructor.construct_document(node), source)
    return tuple(value for value in values if value is not None)


def yaml_nodes(text: str, *, source: str) -> tuple[Any, ...]:
    """Return the root node of each document of a YAML text, whose marks say where in the text each value stands.

    Raises:
        InputError: as `yaml_documents`.
    """
    return _of_yaml(text, lambda _, node: node, source)


def _of_yaml(text: str, take: Callable[[Any, Any], Any], source: str) -> tuple[Any, ...]:
    """Return what is taken of each document, given the loader and the document's node."""
    if len(text) > _MAX_YAML_CHARACTERS:
        raise InputError(
            f"{source}: {len(text):,} characters, but at most {_MAX_YAML_CHARACTERS:,} are read of YAML and of transforms in "
            f"JSON; {_RIGHT_FILE}"
        )
    from ruamel.yaml.error import YAMLError

    # OpenCV before 5 writes "%YAML:1.0", which is not a YAML directive, and may omit the "---" after it.
    header = re.match(r"\ufeff?%YAML[: ][\d.]+[^\n]*\n(---[^\n]*\n)?", text)
    plain = re.sub(r"[^\n]", " ", header[0]) + text[header.end() :] if header else text
    loader = _yaml_loader()
    try:
        return tuple(take(loader, node) for node in loader.compose_all(plain))
    except _RefusedError as error:
        raise InputError(f"{source}: {error}") from None
    except (YAMLError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError) as error:
        # ruamel's constructors raise the builtin ones for values that are not what their tags say
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}: " if mark else ""
        problem = " ".join(str(getattr(error, "problem", None) or error).split())[:200]
        reason = "nested too deeply" if isinstance(error, RecursionError) else problem
        raise InputError(f"{source}: {where}not YAML ({reason}); correct it there") from None


def _yaml_loader() -> Any:
    from ruamel.yaml import YAML
    from ruamel.yaml.composer import Composer
    from ruamel.yaml.constructor import SafeConstructor
    from ruamel.yaml.events import AliasEvent

    class BoundedComposer(Composer):
        """The composer, which counts values, those of an alias each time, and gives up where there are too many."""

        def __init__(self, loader: Any = None) -> None:
            super().__init__(loader)
            self.warn_double_anchors = False
            self.levels = self.count = 0
            self.counts: dict[int, int] = {}

        def compose_node(self, parent: Any, index: Any) -> Any:
            if parent is None:
                self.counts = {}
            event, before = self.parser.peek_event(), self.count
            self.count, self.levels = self.count + 1, self.levels + 1
            if self.levels > _MAX_DEPTH:  # the effort of composing grows with the square of the depth
                raise RecursionError
            node = super().compose_node(parent, index)
            if isinstance(event, AliasEvent):
                self.count = before + self.counts.get(
                    id(node), _MAX_YAML_VALUES
                )  # within what it stands for, it has no end
            self.counts[id(node)] = self.count - before
            self.levels -= 1
            if refused := _refusal(node, self.count):
                raise _RefusedError(f"line {event.start_mark.line + 1}: {refused}")
            return node

    class Constructor(SafeConstructor):
        """The safe constructor with OpenCV's matrix tag."""

    Constructor.add_constructor(_OPENCV_TAG, lambda self, node: self.construct_mapping(node, deep=True))
    loader = YAML(typ="safe", pure=True)
    loader.Composer, loader.Constructor = BoundedComposer, Constructor
    return loader


def _refusal(node: Any, count: int) -> str:
    """Return why a node of YAML is not read, given the number of values so far; "" if it is."""
    if node.tag == _MERGE_TAG:
        return "merges keys (<<), which is not read; write the keys out"
    if node.tag.endswith(":int") and len(node.value) > _MAX_DIGITS:
        return _TOO_MANY_DIGITS
    if count > _MAX_YAML_VALUES:
        return f"more than {_MAX_YAML_VALUES:,} values, with aliases (*) written out; {_RIGHT_FILE}"
    return ""


def python_tree(text: str, *, source: str, mode: Literal["exec", "eval"] = "exec") -> ast.AST:
    """Parse a program or, to evaluate it, a literal of Python; nothing in it is run.

    Raises:
        InputError: it is not Python, or exceeds a limit.
    """
    try:
        if len(text) > _MAX_PYTHON_CHARACTERS and len(_BYTES_LITERAL.sub("", text)) > _MAX_PYTHON_CHARACTERS:
            raise _RefusedError(f"{len(text):,} characters are too many for Python; {_RIGHT_FILE}")
        tree = ast.parse(text, mode=mode)
        _require_plain([node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)], text)
        return tree
    except _RefusedError as error:
        raise InputError(f"{source}: {error}") from None
    except (SyntaxError, ValueError) as error:
        raise InputError(f"{source}: not Python ({error}); correct it there") from None
    except (RecursionError, MemoryError):
        raise InputError(f"{source}: {_TOO_DEEP}") from None


def _json_decoder(*, numbers_as_text: bool) -> json.JSONDecoder:
    number = str if numbers_as_text else None
    return json.JSONDecoder(
        parse_float=number, parse_int=number, parse_constant=number, object_pairs_hook=_without_repeats
    )


def _without_repeats(items: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of these items.

    Raises:
        _RefusedError: a key appears twice.
    """
    content = dict(items)
    if len(content) != len(items):
        twice = next(key for key, count in Counter(key for key, _ in items).items() if count > 1)
        raise _RefusedError(f"the key {twice!r} appears twice in one object; keep one")
    return content


def _require_cheap(json_text: str | bytes) -> None:
    """Refuse JSON that takes long to parse, before it is parsed."""
    text = json_text if isinstance(json_text, str) else json_text.decode("latin-1")
    if len(text) > _MAX_JSON_CHARACTERS or text.count(",") + 4 * sum(map(text.count, ":[{")) > _MAX_JSON_COST:
        raise _RefusedError(f"{len(text):,} characters are too many for this kind of file; {_RIGHT_FILE}")


def _require_plain(content: Any, text: str) -> None:
    """Refuse values that are nested deeper than in any of our files, and integers that no float holds."""
    level: list[Any] = [[content]]
    for _ in range(_MAX_DEPTH + 1):
        inner = [item for value in level for item in (value.values() if type(value) is dict else value)]
        if any(type(item) is int and not -_LARGEST < item < _LARGEST for item in inner):
            raise _RefusedError(_digits_in(text))
        level = [item for item in inner if type(item) is list or type(item) is dict]
        if not level:
            return
    raise RecursionError


def _reason(error: Exception, text: str = "") -> str:
    """Say what is wrong with a text: the parsers' only other ValueError is that of Python's limit of digits."""
    if isinstance(error, RecursionError):
        return _TOO_DEEP
    return str(error) if isinstance(error, _RefusedError) else _digits_in(text)


def _digits_in(text: str) -> str:
    """Say that an integer has too many digits, with its line if it is decimal."""
    number = _LONG_INTEGER.search(text)
    return f"line {text.count(chr(10), 0, number.start()) + 1}: {_TOO_MANY_DIGITS}" if number else _TOO_MANY_DIGITS
