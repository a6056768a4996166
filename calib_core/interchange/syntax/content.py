"""The content of a file, its syntax parsed once; every format reads this instead of bytes."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal
from xml.etree.ElementTree import Element

from calib_core.errors import InputError
from calib_core.interchange.syntax.mat_file import load_mat
from calib_core.interchange.syntax.xml_places import is_file_storage, opencv_values, parse_xml
from calib_core.interchange.syntax.yaml_text import joined_documents
from calib_core.interchange.syntax.zip_archives import unpack
from calib_core.parsing import json_value, yaml_documents

Syntax = Literal["archive", "mat", "bytes", "json", "xml", "lines", "yaml"]
"""zip archive, MATLAB's mat, other bytes, JSON, XML, text by its lines, text as YAML."""

_NO_XML = Element("")
_BLOCK = re.compile(r"^\s*([A-Za-z]\w*)\s*[:=]((?:[\s\[\](),;]*[-+]?\.?\d[\d.eE+-]*)+)", re.MULTILINE)
_SIZES_OF_POSES = (9, 12, 16)
_NO_JSON = re.compile(
    r"\s*(\[(DEBUG|INFO|WARN|ERROR|FATAL)\]|\{\s*')"
)  # ROS's log, which tf2_echo prints first; a dict of Python


@dataclass(frozen=True, slots=True, eq=False)
class Content:
    """A file's parsed content; fields that the syntax does not have are empty.

    Attributes:
        syntax: how it was parsed.
        text: the whole text, unless the file is binary; lines end with a line feed.
        data: all bytes, if the syntax is "bytes".
        members: of an archive, by name.
        variables: of a mat file, by name: arrays, str, and dicts of them.
        value: of JSON, of YAML with one document, or of OpenCV's FileStorage XML.
        documents: of YAML, such as the messages that `ros2 topic echo` prints.
        root: of XML.
        lines: of text, without comments (#) and empty lines.
        beside: files in the same folder that complete it, by name.
    """

    syntax: Syntax
    text: str = ""
    data: bytes = b""
    members: Mapping[str, bytes] = field(default_factory=dict)
    variables: Mapping[str, Any] = field(default_factory=dict)
    value: Any = None
    documents: tuple[Any, ...] = ()
    root: Element = _NO_XML
    lines: tuple[str, ...] = ()
    beside: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def mapping(self) -> Mapping[str, Any]:
        """The value if it is a mapping, otherwise an empty mapping."""
        return self.value if isinstance(self.value, dict) else {}

    @property
    def json_mapping(self) -> Mapping[str, Any]:
        """The same for JSON only, for formats that exist in no other syntax."""
        return self.mapping if self.syntax == "json" else {}


def readings(content: str | bytes, *, source: str) -> Iterator[Content]:
    """Yield the parsed content of a file. Text in no other syntax is yielded twice: as lines, then as YAML.

    Args:
        content: of the file.
        source: the name of the file in error messages.

    Raises:
        InputError: it starts like one of the syntaxes but does not follow it.
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
    """Decode UTF-8, or UTF-16 as written by output redirection in the Windows shell.

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
    if start in ("{", "[") and not _NO_JSON.match(text):
        yield Content("json", text=text, value=json_value(text, source=source))
    elif start == "<":
        root = parse_xml(text, source=source)
        yield Content("xml", text=text, root=root, value=opencv_values(root) if is_file_storage(root) else None)
    else:
        lines = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
        yield Content("lines", text=text, lines=tuple(lines))
        try:
            documents = yaml_documents(text, source=source)
        except InputError as error:
            if source.lower().endswith((".yaml", ".yml")):
                raise
            blocks = _labeled_numbers(text)
            if any(len(numbers) in _SIZES_OF_POSES for numbers in blocks.values()):
                yield Content("yaml", text=text, value=blocks)
                return
            why = str(error).removeprefix(f"{source}: ")
            raise InputError(f"{source}: is in no format that is read here; if it is meant to be YAML: {why}") from None
        yield Content("yaml", text=text, value=joined_documents(documents, source=source), documents=documents)


def _labeled_numbers(text: str) -> dict[str, list[str]]:
    """Return the numbers beside and below each name, as MATLAB and terminals print R and t; the first of a name."""
    blocks: dict[str, list[str]] = {}
    for name, numbers in _BLOCK.findall(text.replace("...", "")):
        blocks.setdefault(name, re.sub(r"[\[\](),;]", " ", numbers).split())
    return blocks
