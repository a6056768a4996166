"""Read YAML with the safe loader only, OpenCV's dialect too, with the place of every value; write numbers and names."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from calib_core.errors import InputError

_MAX_CHARACTERS = 256 * 1024
"""Half a megabyte of YAML takes ten seconds to parse."""
_MAX_DEPTH = 100
_OPENCV_TAG = "tag:yaml.org,2002:opencv-matrix"


def load_yaml(text: str, *, source: str) -> Any:
    """Parse YAML of plain values; OpenCV's header and matrices (as mappings with rows, cols, data) are supported.

    `topic echo` ends each message with "---": an empty document is left out, and messages of transforms become one.

    Raises:
        InputError: it is not YAML, has several documents, or is too large to be a calibration.
    """
    return joined_documents(load_yaml_documents(text, source=source), source=source)


def load_yaml_documents(text: str, *, source: str) -> tuple[Any, ...]:
    """Parse each document of a YAML text; empty ones are left out, such as after the last --- of `ros2 topic echo`.

    Raises:
        InputError: it is not YAML, or too large to be a calibration.
    """
    _require_small(text, source)
    from ruamel.yaml import YAML
    from ruamel.yaml.composer import Composer
    from ruamel.yaml.constructor import SafeConstructor

    class ShallowComposer(Composer):
        """The composer, which gives up at a depth that no calibration has: its effort grows with the square of it."""

        levels = 0

        def compose_node(self, parent: Any, index: Any) -> Any:
            self.levels += 1
            if self.levels > _MAX_DEPTH:
                raise RecursionError
            node = super().compose_node(parent, index)
            self.levels -= 1
            return node

    class Constructor(SafeConstructor):
        """The safe constructor with OpenCV's matrix tag."""

    Constructor.add_constructor(_OPENCV_TAG, lambda self, node: self.construct_mapping(node, deep=True))
    loader = YAML(typ="safe", pure=True)
    loader.Composer, loader.Constructor = ShallowComposer, Constructor
    # OpenCV before 5 writes "%YAML:1.0", which is not a YAML directive, and may omit the "---" after it.
    plain = re.sub(r"\A\ufeff?%YAML[: ][\d.]+[^\n]*\n(---[^\n]*\n)?", "", text)
    with refuse_bad_yaml(text, plain, source=source):
        return tuple(document for document in loader.load_all(plain) if document is not None)


def _require_small(text: str, source: str) -> None:
    if len(text) > _MAX_CHARACTERS:
        raise InputError(
            f"{source}: {len(text):,} characters, but at most {_MAX_CHARACTERS:,} are read of YAML and of transforms in JSON; is "
            "it the right file? If so, keep only the calibration in it"
        )


@contextmanager
def refuse_bad_yaml(text: str, plain: str, *, source: str) -> Iterator[None]:
    """Turn a parser's errors about a text, from which a header may have been removed, into an InputError with the line."""
    from ruamel.yaml.error import YAMLError

    try:
        yield
    except (YAMLError, ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1 + text.count(chr(10)) - plain.count(chr(10))}: " if mark else ""
        raise InputError(f"{source}: {where}not YAML ({_problem(error)}); correct it there") from None


def joined_documents(documents: tuple[Any, ...], *, source: str) -> Any:
    """Return the only document, or several messages of transforms as one.

    Raises:
        InputError: there are several that are no messages of transforms.
    """
    if len(documents) < 2:
        return documents[0] if documents else None
    listed = [document.get("transforms") if isinstance(document, dict) else None for document in documents]
    if not all(isinstance(transforms, list) for transforms in listed):
        raise InputError(f"{source}: contains {len(documents)} YAML documents; keep only the intended one")
    return {"transforms": [transform for transforms in listed for transform in transforms or ()]}


def _problem(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return "nested too deeply"
    return " ".join(str(getattr(error, "problem", None) or error).split())[:200]


def number_text(value: float) -> str:
    """Write a float so that it reads back bit for bit, also in YAML 1.1 readers, which need a point in 1.0e-05."""
    text = repr(float(value) + 0.0)
    if "e" in text and "." not in text:
        text = text.replace("e", ".0e")
    return text


def numbers_text(values: Any, separator: str = ", ") -> str:
    """Write numbers with a separator between them."""
    return separator.join(number_text(value) for value in values)


def quoted(name: str) -> str:
    """Quote a name for YAML and for comments; JSON's quoting is valid in both."""
    return json.dumps(name)


@dataclass(frozen=True, slots=True, eq=False)
class PlacedValue:
    """A value of a YAML document, looked up as it is needed."""

    node: Any

    @property
    def line(self) -> int:
        """The line it begins in, from 1."""
        return int(self.node.start_mark.line) + 1

    def span_in(self, text: str) -> tuple[int, int] | None:
        """Return where a plain or quoted value stands in the text, without quotes; None if it has an anchor or is an alias."""
        start, end = int(self.node.start_mark.index), int(self.node.end_mark.index)
        if text[start : start + 1] in ("'", '"'):
            start, end = start + 1, end - 1
        return (start, end) if text[start:end] == self.text else None

    @property
    def text(self) -> str:
        """The text of a plain value; "" of a list or a mapping."""
        return self.node.value if isinstance(self.node.value, str) else ""

    def entries(self) -> Iterator[tuple[str, "PlacedValue"]]:
        """Yield the entries of a mapping, nothing of anything else."""
        for entry in self.node.value if not isinstance(self.node.value, str) else ():
            if isinstance(entry, tuple) and isinstance(entry[0].value, str):
                yield entry[0].value, PlacedValue(entry[1])

    def items(self) -> Iterator["PlacedValue"]:
        """Yield the items of a list, nothing of anything else."""
        for item in self.node.value if not isinstance(self.node.value, str) else ():
            if not isinstance(item, tuple):
                yield PlacedValue(item)

    def get(self, *keys: str) -> "PlacedValue | None":
        """Return the value at a path of keys; None if there is none."""
        found: PlacedValue | None = self
        for key in keys:
            found = next((value for name, value in found.entries() if name == key), None) if found else None
        return found


def placed_yaml(text: str, *, source: str) -> tuple[PlacedValue, ...]:
    """Return the documents of a YAML text that `load_yaml` accepts; empty ones are left out.

    Raises:
        InputError: it is not YAML, or too large to be a calibration.
    """
    _require_small(text, source)
    from ruamel.yaml import YAML

    with refuse_bad_yaml(text, text, source=source):
        nodes = list(YAML(typ="safe", pure=True).compose_all(text))
    if any(node is not None and node.start_mark is None for node in nodes):
        raise InputError(f"{source}: the YAML cannot be located; write it without tags")
    return tuple(PlacedValue(node) for node in nodes if node is not None and node.value)
