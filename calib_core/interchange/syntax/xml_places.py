"""XML with the place of every element in the text, so that single attributes can be changed; OpenCV's FileStorage as values."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from calib_core.errors import InputError

_DEEPEST = 200


@dataclass(slots=True)
class PlacedElement:
    """An element; names keep their namespace prefix.

    Attributes:
        tag: its name.
        attributes: its attributes, unescaped.
        line: of its start tag, from 1.
        start: index in the text of its start tag.
        end: index after its start tag.
        close: index of its end tag; end of the start tag for an empty element.
        children: the elements in it.
    """

    tag: str
    attributes: Mapping[str, str]
    line: int
    start: int
    end: int = 0
    close: int = 0
    children: list["PlacedElement"] = field(default_factory=list)

    def child(self, tag: str) -> "PlacedElement | None":
        """Return the first element of that name in it."""
        return next((one for one in self.children if one.tag == tag), None)

    def everything(self) -> Iterator["PlacedElement"]:
        """Yield it and all elements in it, in the order of the text."""
        yield self
        for one in self.children:
            yield from one.everything()

    def attribute_span(self, text: str, name: str) -> tuple[int, int] | None:
        """Return where an attribute's value stands in the text, without its quotes; None if it has none."""
        for match in re.finditer(r"""([^\s=<>"']+)\s*=\s*("[^"]*"|'[^']*')""", text[self.start : self.end]):
            if match[1] == name:
                return self.start + match.start(2) + 1, self.start + match.end(2) - 1
        return None


def placed_xml(text: str, *, source: str) -> PlacedElement:
    """Parse XML that has no document type, so no entity in it expands.

    Raises:
        InputError: it is not XML, declares a document type, or is nested too deeply.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(f"{source}: declares a document type; give a plain XML file")
    data = text.encode("utf-8", errors="replace")
    characters = np.concatenate([[0], np.cumsum((np.frombuffer(data, np.uint8) & 0xC0) != 0x80)])
    parser = expat.ParserCreate("utf-8")
    root = PlacedElement("", {}, 0, 0)
    path = [root]

    def opened(tag: str, attributes: dict[str, str]) -> None:
        if len(path) > _DEEPEST:
            raise InputError(f"{source}: the XML is nested too deeply; correct the file")
        at = int(characters[parser.CurrentByteIndex])
        element = PlacedElement(tag, attributes, parser.CurrentLineNumber, at, _tag_end(text, at))
        path[-1].children.append(element)
        path.append(element)

    def closed(_: str) -> None:
        element = path.pop()
        element.close = max(int(characters[parser.CurrentByteIndex]), element.end)

    parser.StartElementHandler, parser.EndElementHandler = opened, closed
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise InputError(f"{source}: not XML ({error}); correct it there") from None
    return root.children[0]


def _tag_end(text: str, start: int) -> int:
    """Return the index after a start tag; a ">" in quotes does not end it."""
    match = re.compile(r"""<(?:[^"'>]|"[^"]*"|'[^']*')*>""").match(text, start)
    return match.end() if match else start


_MAX_CHARACTERS = 32 * 1024 * 1024


def parse_xml(text: str, *, source: str, most_marks: int = 100_000) -> ElementTree.Element:
    """Parse XML that has no document type, so no entity in it expands.

    Args:
        text: the file's content.
        source: the name of the file in error messages.
        most_marks: of its tags and attributes; up to 4 us each.

    Raises:
        InputError: it is not XML, declares entities, or is too large.
    """
    is_large = len(text) > _MAX_CHARACTERS or text.count("<") + text.count("=") > most_marks
    if is_large or "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(
            f"{source}: too large for this kind of file, or declares a document type; give a plain XML file"
        )
    try:
        return ElementTree.fromstring(text.lstrip("\ufeff \t\r\n"))
    except ElementTree.ParseError as error:
        raise InputError(f"{source}: not XML ({error}); correct it there") from None
    except ValueError as error:
        raise InputError(f"{source}: not XML ({error}); save it as UTF-8") from None


def is_file_storage(root: ElementTree.Element) -> bool:
    """Return whether XML is OpenCV's FileStorage."""
    return root.tag == "opencv_storage"


def opencv_values(root: ElementTree.Element) -> dict[str, Any]:
    """Return the values of parsed FileStorage XML.

    Raises:
        InputError: it is nested too deeply.
    """
    try:
        return {child.tag: _value(child) for child in root}
    except RecursionError:
        raise InputError("the XML is nested too deeply; correct the file") from None


def _value(element: ElementTree.Element) -> Any:
    if element.get("type_id") == "opencv-matrix":
        parts = {child.tag: (child.text or "").strip() for child in element}
        return {**parts, "data": parts.get("data", "").split()}
    if len(element):
        return {child.tag: _value(child) for child in element}
    return (element.text or "").strip().strip('"')
