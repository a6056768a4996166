"""Load a file of boxes, or the text files of a folder or zip archive, with limits, and parse its syntax."""

import io
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from calib_core.boxes.formats.box_format import BoxFile
from calib_core.errors import InputError
from calib_core.input_files import file_text, name_text, read_input
from calib_core.interchange.syntax.strict_json import json_value

_MAX_BYTES = 256 * 1024 * 1024
_MAX_XML_BYTES = 64 * 1024 * 1024
_MOST_MEMBERS = 200_000
_IS_WHAT = "a file of boxes"
_SUFFIXES = (".txt", ".yaml", ".yml", ".json", ".xml", ".names")
_DAMAGED = (
    EOFError,
    LookupError,
    NotImplementedError,
    OSError,
    RuntimeError,
    ValueError,
    zlib.error,
    zipfile.BadZipFile,
)


def load_box_file(path: Path, *, image_size_px: tuple[int, int] | None) -> BoxFile:
    """Load what a user names.

    Args:
        path: of a file, a folder or a zip archive.
        image_size_px: width and height of the recorded pictures; None if unknown.

    Raises:
        InputError: it cannot be read, is damaged, or is too large.
    """
    source = name_text(path.name or path)
    try:
        if path.is_dir():
            members = _folder(path)
        else:
            data = read_input(path, max_bytes=_MAX_BYTES, is_what=_IS_WHAT)
            members = _archive(data, source) if data.startswith(b"PK") else {path.name: data}
    except OSError as error:
        raise InputError(f"{name_text(path)}: cannot be read: {error.strerror}; check the path") from None
    alone = next(iter(members.items())) if len(members) == 1 else None
    text = _text(alone[1], source) if alone else ""
    start = text.lstrip()[:1]
    if start in ("{", "["):
        return BoxFile(source, value=json_value(text, source=source), image_size_px=image_size_px)
    if start == "<":
        return BoxFile(source, root=_xml(text, source), image_size_px=image_size_px)
    texts = {name_text(name): _text(data, f"{source}/{name_text(name)}") for name, data in members.items()}
    return BoxFile(source, members=texts, image_size_px=image_size_px)


def _folder(path: Path) -> dict[str, bytes]:
    """Read the text files of a folder and its subfolders."""
    members: dict[str, bytes] = {}
    total = 0
    for inner in _text_files(path):
        data = read_input(inner, max_bytes=_MAX_BYTES - total, is_what=_IS_WHAT)
        total += len(data)
        members[inner.relative_to(path).as_posix()] = data
        if len(members) > _MOST_MEMBERS:
            raise InputError(
                f"{name_text(path)}: has more than {_MOST_MEMBERS} files; give the folder of one recording"
            )
    if not members:
        raise InputError(f"{name_text(path)}: has no file of boxes ({', '.join(_SUFFIXES)}); is it the right folder?")
    return members


def _text_files(path: Path) -> Iterator[Path]:
    """Yield the text files of a folder, sorted, at most two folders down."""
    for pattern in ("*", "*/*", "*/*/*"):
        yield from sorted(
            inner for inner in path.glob(pattern) if inner.suffix.lower() in _SUFFIXES and inner.is_file()
        )


def _archive(data: bytes, source: str) -> dict[str, bytes]:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            wanted = [
                member
                for member in archive.infolist()
                if member.filename.lower().endswith(_SUFFIXES) and not member.filename.startswith("__MACOSX")
            ]
            if len(wanted) > _MOST_MEMBERS or sum(member.file_size for member in wanted) > _MAX_BYTES:
                raise InputError(
                    f"{source}: unpacks to more than {_MAX_BYTES >> 20} MB; give the boxes without pictures"
                )
            members = {member.filename: archive.open(member).read(member.file_size) for member in wanted}
    except _DAMAGED as error:
        raise InputError(f"{source}: a damaged zip archive ({error}); export it again") from None
    if not members:
        raise InputError(f"{source}: contains no file of boxes ({', '.join(_SUFFIXES)}); is it the right archive?")
    return members


def _text(data: bytes, source: str) -> str:
    try:
        return file_text(data)
    except UnicodeDecodeError as error:
        raise InputError(f"{source}: not text (byte {error.start} is not UTF-8); give {_IS_WHAT}") from None


def _xml(text: str, source: str) -> ElementTree.Element:
    """Parse XML that has no document type, so no entity in it expands."""
    if len(text) > _MAX_XML_BYTES or "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(
            f"{source}: larger than {_MAX_XML_BYTES >> 20} MB, or declares a document type; give plain XML"
        )
    try:
        return ElementTree.fromstring(text.lstrip("\ufeff \t\r\n"))
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError(f"{source}: not XML ({error}); correct it there") from None
