"""Read YAML with the place of every value; write numbers and names."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from calib_core.errors import InputError
from calib_core.parsing import yaml_nodes


def joined_documents(documents: tuple[Any, ...], *, source: str) -> Any:
    """Return the only document, or several messages of transforms, as `topic echo` prints them, as one.

    Raises:
        InputError: there are several that are no messages of transforms.
    """
    if len(documents) < 2:
        return documents[0] if documents else None
    listed = [document.get("transforms") if isinstance(document, dict) else None for document in documents]
    if not all(isinstance(transforms, list) for transforms in listed):
        raise InputError(f"{source}: contains {len(documents)} YAML documents; keep only the intended one")
    return {"transforms": [transform for transforms in listed for transform in transforms or ()]}


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
    """Return the documents of a YAML text that `yaml_documents` accepts; empty ones are left out.

    Raises:
        InputError: it is not YAML, or too large to be a calibration.
    """
    nodes = yaml_nodes(text, source=source)
    if any(node is not None and node.start_mark is None for node in nodes):
        raise InputError(f"{source}: the YAML cannot be located; write it without tags")
    return tuple(PlacedValue(node) for node in nodes if node is not None and node.value)
