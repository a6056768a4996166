"""What a file holds, its syntax parsed once: every format looks at this, none at bytes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal
from xml.etree.ElementTree import Element

from calib_core.errors import InputError
from calib_core.interchange.syntax.mat_file import load_mat
from calib_core.interchange.syntax.opencv_xml import is_file_storage, opencv_values, parse_xml
from calib_core.interchange.syntax.strict_json import json_value
from calib_core.interchange.syntax.yaml_text import load_yaml
from calib_core.interchange.syntax.zip_archives import unpack

__all__ = ["Content", "Syntax", "decoded", "readings"]

Syntax = Literal["archive", "mat", "bytes", "json", "xml", "lines", "yaml"]
"""zip archive, MATLAB's mat, other bytes that are no text, JSON, XML, text by its lines, text as YAML."""

_NO_XML = Element("")


@dataclass(frozen=True, slots=True, eq=False)
class Content:
    """A file's content, parsed; what the syntax does not have is empty.

    Attributes:
        syntax: how it was parsed.
        text: all of it, unless it is binary; lines end with a line feed.
        data: all of it, where the syntax is "bytes".
        members: of an archive, by their names.
        variables: of a mat file, by their names: arrays, str, and dicts of them.
        value: of JSON, of YAML, or of OpenCV's FileStorage XML.
        root: of XML.
        lines: of text, without comments (#) and empty lines.
    """

    syntax: Syntax
    text: str = ""
    data: bytes = b""
    members: Mapping[str, bytes] = field(default_factory=dict)
    variables: Mapping[str, Any] = field(default_factory=dict)
    value: Any = None
    root: Element = _NO_XML
    lines: tuple[str, ...] = ()

    @property
    def mapping(self) -> Mapping[str, Any]:
        """The value, where it is one of keys; else an empty one."""
        return self.value if isinstance(self.value, dict) else {}

    @property
    def json_mapping(self) -> Mapping[str, Any]:
        """The same of JSON only, for formats that exist in no other syntax."""
        return self.mapping if self.syntax == "json" else {}


def readings(content: str | bytes, *, source: str) -> Iterator[Content]:
    """Yield what a file holds, parsed. Text without a syntax of its own comes twice: by its lines, and then as YAML.

    Args:
        content: of the file.
        source: what to call it in an error.

    Raises:
        InputError: its beginning promises a syntax that the rest does not follow.
    """
    if isinstance(content, bytes) and content.startswith(b"PK"):
        yield Content("archive", members=unpack(content, source=source))
    elif isinstance(content, bytes) and content.startswith(b"MATLAB"):
        yield Content("mat", variables=load_mat(content, source=source))
    else:
        try:
            text = decoded(content, source=source)
        except InputError:
            yield Content("bytes", data=content if isinstance(content, bytes) else b"")
            return
        yield from _text_readings(text.replace("\r\n", "\n"), source=source)


def decoded(content: str | bytes, *, source: str) -> str:
    """Return text of UTF-8, or of UTF-16 as Windows' shell writes what is sent to a file.

    Raises:
        InputError: it is neither.
    """
    if isinstance(content, str):
        return content
    try:
        return content.decode("utf-16" if content.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{source}: not text (byte {error.start} is not UTF-8); save it as UTF-8") from None


def _text_readings(text: str, *, source: str) -> Iterator[Content]:
    start = text.lstrip()[:1]
    if start in ("{", "["):
        yield Content("json", text=text, value=json_value(text, source=source))
    elif start == "<":
        root = parse_xml(text, source=source)
        yield Content("xml", text=text, root=root, value=opencv_values(root) if is_file_storage(root) else None)
    else:
        lines = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
        yield Content("lines", text=text, lines=tuple(lines))
        yield Content("yaml", text=text, value=load_yaml(text, source=source))
