"""Open the recording files of the given paths: expand folders, and detect formats by the first bytes."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from calib_core.errors import InputError, RecordingError
from calib_core.input_files import read_text
from calib_core.measurements import DataWarning
from calib_core.parsing import yaml_documents
from calib_core.recordings.containers import sqlite as sqlite
from calib_core.recordings.containers.chunks import ChannelFilter
from calib_core.recordings.containers.compression import packing_of, unpacked_file
from calib_core.recordings.containers.mcap import reader as mcap
from calib_core.recordings.containers.mcap import records as mcap_records
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.rosbag1.reader import Rosbag1Source
from calib_core.recordings.containers.sources import Source

_SUFFIXES = (".bag", ".mcap", ".db3")
_MORE_SUFFIXES = (".active", ".zstd", ".zst", ".gz", ".bz2", ".lz4")
_METADATA = "metadata.yaml"
_FIRST_ROWS = 500
_FIRST_BYTES = 1 << 19  # usually enough for the first image
_LAST_BYTES = 1 << 16  # most of a file's metadata
_KINDS = (
    "supported: ROS 1 .bag, ROS 2 .mcap and .db3 files and their folders, folders of images or radar files, "
    "radar CSV and videos"
)
_PACKED_MESSAGES = re.compile(r"^\s*compression_mode:\s*['\"]?message", re.IGNORECASE | re.MULTILINE)
_PACKED = {b"PK\x03\x04": ("zip", "unzip"), b"\xfd7zXZ": ("xz", "unxz")}


@dataclass(frozen=True, slots=True)
class _Found:
    """A file to open.

    Attributes:
        path: its path.
        packed: each of its messages is compressed separately.
        expendable: it is one of several in a folder; the others can be opened without it.
        count: expected number of messages; None if the folder's metadata does not give it.
        warnings: found in its folder's metadata.
    """

    path: Path
    packed: bool = False
    expendable: bool = False
    count: int | None = None
    warnings: tuple[DataWarning, ...] = ()


_AnySource: TypeAlias = Rosbag1Source | mcap.McapSource | sqlite.SqliteSource


def holds_recording(path: Path) -> bool:
    """Return whether a path is, by its names, a recording of ROS messages or a folder that contains one."""
    if not path.is_dir():
        return _is_recording(path)
    folders = [path, *(folder for folder in path.iterdir() if folder.is_dir())]
    return any((folder / _METADATA).is_file() for folder in folders) or any(map(_is_recording, path.iterdir()))


def begins_recording(head: bytes) -> bool:
    """Return whether a file that begins so is a recording of ROS messages."""
    return head.startswith((b"#ROSBAG V", mcap_records.MAGIC, sqlite.MAGIC))


def open_sources(paths: Sequence[Path]) -> tuple[Source, ...]:
    """Open every recording file named by the paths or contained in them.

    Raises:
        RecordingError: a path contains nothing readable.
    """
    files: dict[Path, _Found] = {}
    for path in paths:
        for found in _files(path):
            files.setdefault(found.path.resolve(), found)
    sources: list[_AnySource] = []
    refused: list[RecordingError] = []
    try:
        for found in files.values():
            opened = _open_or_refusal(found)
            if isinstance(opened, RecordingError):
                refused.append(opened)
            else:
                sources.append(opened)
        if not sources:
            raise refused[0]
    except RecordingError:
        for source in sources:
            source.close()
        raise
    sources[0].warnings = (*sources[0].warnings, *map(_left_out, refused))
    return tuple(sources)


def open_beginnings(paths: Sequence[Path], first_of: ChannelFilter) -> Iterator[Source]:
    """Open recording files one after another, reading only their beginnings; the caller closes each.

    Files that are compressed as a whole or are not ROS recordings are skipped.

    Args:
        paths: as for open_sources.
        first_of: the channels whose first messages are wanted.

    Raises:
        RecordingError: a file is damaged, or has no index.
    """
    for path in paths:
        for found in _files(path):
            file = FileBytes(found.path)
            try:
                source = _beginning(file, first_of, packed=found.packed)
            except RecordingError:
                file.close()
                raise
            if source is None:
                file.close()
            else:
                yield source


def _beginning(file: FileBytes, first_of: ChannelFilter, *, packed: bool) -> "_AnySource | None":
    file.expect([(0, _FIRST_BYTES), (max(0, file.size_bytes - _LAST_BYTES), file.size_bytes)])
    head = file.up_to(0, 16)
    if head.startswith(b"#ROSBAG V"):
        return Rosbag1Source(file, first_of=first_of)
    if head.startswith(mcap_records.MAGIC):
        return mcap.McapSource(file, first_of=first_of)
    if head == sqlite.MAGIC:
        return sqlite.SqliteSource(file, packed=packed, first_rows=_FIRST_ROWS)
    return None


def _open_or_refusal(found: _Found) -> "_AnySource | RecordingError":
    """Open a file; if an expendable one cannot be opened, return the error."""
    try:
        return _open(found)
    except RecordingError as error:
        if not found.expendable:
            raise
        return error


def _left_out(error: RecordingError) -> DataWarning:
    return DataWarning.reported(
        "file-left-out",
        f"one file of the folder cannot be opened and is skipped: {error}",
        "the other files of the folder are used; copy this one again if you need that part of the recording",
    )


def _files(path: Path) -> list[_Found]:
    """Return the recording files of a path."""
    if not path.is_dir():
        return [_Found(path, _packed_messages(path.parent / _METADATA, path))]
    if (path / _METADATA).is_file():
        return _from_metadata(path)
    found = [_Found(file) for file in sorted(path.iterdir()) if _is_recording(file)]
    for folder in sorted(path.iterdir()):
        if folder.is_dir() and (folder / _METADATA).is_file():
            found.extend(_from_metadata(folder))
    if not found:
        raise RecordingError(f"{path}: the folder contains no recording (.bag, .mcap, .db3 or metadata.yaml); {_KINDS}")
    return [replace(file, expendable=True) for file in found] if len(found) > 1 else found


def _is_recording(file: Path) -> bool:
    """Return whether a file is a recording, judging by its name: x.bag, x.bag.active, x_0.db3.zstd."""
    *_, inner, last = ("", "", *file.suffixes)
    return file.is_file() and (last in _SUFFIXES or (last in _MORE_SUFFIXES and inner in _SUFFIXES))


def _metadata(path: Path) -> dict[str, object]:
    """Read the relevant part of a metadata.yaml; empty if it is damaged or another kind of file."""
    try:
        (content,) = yaml_documents(read_text(path, is_what="a metadata.yaml"), source=str(path))
    except (InputError, ValueError):
        return {}
    information = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
    return information if isinstance(information, dict) else {}


def _from_metadata(folder: Path) -> list[_Found]:
    """Return the files that a folder's metadata.yaml lists, or all recordings in it if it lists none."""
    information = _metadata(folder / _METADATA)
    listed = information.get("relative_file_paths")
    names = [Path(str(name)).name for name in listed] if isinstance(listed, list) else []
    there = {name: other for name in names if (other := _under_any_name(folder, name)) is not None}
    missing = [name for name in names if name not in there]
    if missing and not there:
        raise RecordingError(
            f"{folder}: metadata.yaml lists {missing[0]}, which does not exist; copy the whole folder, or open the files you have"
        )
    paths = list(there.values()) or sorted(file for file in folder.iterdir() if _is_recording(file))
    if not paths:
        raise RecordingError(
            f"{folder}: metadata.yaml lists no files, and the folder contains none; copy the whole folder"
        )
    packed = str(information.get("compression_mode", "")).upper() == "MESSAGE"
    found = [_Found(path, packed, expendable=len(paths) > 1) for path in paths]
    counts = _counts(information, names)
    found = [replace(file, count=counts.get(name)) for file, name in zip(found, there, strict=True)] if there else found
    if missing:
        found[0] = replace(found[0], warnings=(_missing(folder, missing, counts),))
    return found


def _missing(folder: Path, missing: list[str], counts: dict[str, int]) -> DataWarning:
    lost = sum(counts.get(name, 0) for name in missing)
    return DataWarning.reported(
        "missing-file",
        f"{folder.name}: metadata.yaml lists {', '.join(missing)}, which {'does' if len(missing) == 1 else 'do'} not exist"
        + (f": {lost} messages are missing" if lost else ""),
        "copy the whole folder if you need that part of the recording",
    )


def _under_any_name(folder: Path, name: str) -> Path | None:
    """Find a listed file, even if it has been decompressed or compressed since."""
    names = [name, *(name.removesuffix(suffix) for suffix in _MORE_SUFFIXES), *(name + s for s in _MORE_SUFFIXES)]
    return next((folder / other for other in names if (folder / other).is_file()), None)


def _counts(information: dict[str, object], names: list[str]) -> dict[str, int]:
    """Return the expected number of messages of each file, as far as the metadata gives it."""
    files = information.get("files")
    counts = {}
    for file in files if isinstance(files, list) else []:
        if isinstance(file, dict) and type(count := file.get("message_count")) is int:
            counts[Path(str(file.get("path", ""))).name] = count
    total = information.get("message_count")
    if len(names) == 1 and type(total) is int:
        counts.setdefault(names[0], total)
    return counts


def _packed_messages(metadata: Path, path: Path) -> bool:
    if path.suffix != ".db3" or not metadata.is_file():
        return False
    try:
        return bool(_PACKED_MESSAGES.search(read_text(metadata, is_what="a metadata.yaml")))
    except InputError:
        return False


def _open(found: _Found) -> "_AnySource":
    file = FileBytes(found.path, warnings=found.warnings)
    try:
        head = file.up_to(0, 16)
        if (kind := packing_of(head)) is not None:
            file = unpacked_file(file, kind)
            head = file.up_to(0, 16)
        source = _source(file, head, packed=found.packed)
    except RecordingError:
        file.close()
        raise
    count = sum(len(source.index(channel.id)) for channel in source.channels) if found.count else 0
    if found.count and count < found.count:
        source.warnings = (*source.warnings, _too_few(found, count))
    return source


def _source(file: FileBytes, head: bytes, *, packed: bool) -> "_AnySource":
    if head.startswith(b"#ROSBAG V"):
        return Rosbag1Source(file)
    if head.startswith(mcap_records.MAGIC):
        return mcap.McapSource(file)
    if head == sqlite.MAGIC:
        return sqlite.SqliteSource(file, packed=packed)
    raise RecordingError(f"{file.path}: {_what_is_it(head)}")


def _too_few(found: _Found, count: int) -> DataWarning:
    return DataWarning.reported(
        "messages-missing",
        f"metadata.yaml lists {found.count} messages in {found.path.name}, but it contains {count}",
        "check that the data you need is there, or copy the file again from its source",
    )


def _what_is_it(head: bytes) -> str:
    if not head:
        return (
            "the file is empty (0 bytes): the recorder was killed or the disk was full; copy it again or record again"
        )
    for magic, (name, command) in _PACKED.items():
        if head.startswith(magic):
            return f"the file is compressed with {name}; decompress it first: {command}"
    text = head[:8].decode("latin-1")
    begins = f"'{text}'" if text.isascii() and text.isprintable() else head[:8].hex()
    return f"not a recording (it begins with {begins}); {_KINDS}"
