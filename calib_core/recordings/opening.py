"""From paths to open files: folders expanded, contents told by their first bytes."""

import re
from collections.abc import Sequence
from pathlib import Path

from calib_core.errors import RecordingError
from calib_core.recordings import mcap, sqlite_bag
from calib_core.recordings.files import FileBytes
from calib_core.recordings.rosbag1 import Rosbag1Source
from calib_core.recordings.sources import Source

__all__ = ["open_sources"]

_SUFFIXES = (".bag", ".mcap", ".db3")
_METADATA = "metadata.yaml"
_KINDS = "ROS 1 .bag, ROS 2 .mcap and .db3 files and their folders can be opened"
_PACKED_MESSAGES = re.compile(r"^\s*compression_mode:\s*['\"]?message", re.IGNORECASE | re.MULTILINE)
_PACKED = {
    b"\x28\xb5\x2f\xfd": ("Zstandard", "zstd -d"),
    b"\x1f\x8b": ("gzip", "gunzip"),
    b"BZh": ("bzip2", "bunzip2"),
    b"PK\x03\x04": ("zip", "unzip"),
    b"\xfd7zXZ": ("xz", "unxz"),
}


def open_sources(paths: Sequence[Path]) -> tuple[Source, ...]:
    """Open every recording file that the paths name or hold.

    Raises:
        RecordingError: a path holds nothing that can be read.
    """
    files: dict[Path, bool] = {}
    for path in paths:
        for file, packed in _files(path):
            files.setdefault(file.resolve(), packed)
    sources: list[Source] = []
    try:
        for file, packed in files.items():
            sources.append(_open(file, packed))
    except RecordingError:
        for source in sources:
            source.close()
        raise
    return tuple(sources)


def _files(path: Path) -> list[tuple[Path, bool]]:
    """Return the files a path stands for, each with whether its messages are compressed one by one."""
    if not path.is_dir():
        return [(path, _packed_messages(path.parent / _METADATA, path))]
    if (path / _METADATA).is_file():
        return _from_metadata(path)
    found = [(file, False) for file in sorted(path.iterdir()) if file.suffix in _SUFFIXES and file.is_file()]
    for folder in sorted(path.iterdir()):
        if folder.is_dir() and (folder / _METADATA).is_file():
            found.extend(_from_metadata(folder))
    if not found:
        raise RecordingError(f"{path}: the folder holds no recording (.bag, .mcap, .db3 or metadata.yaml); {_KINDS}")
    return found


def _metadata(path: Path) -> dict[str, object]:
    """Read the part of a metadata.yaml that matters; empty where it is damaged or something else."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        content = YAML(typ="safe", pure=True).load(path)
    except (YAMLError, OSError, UnicodeDecodeError):
        return {}
    information = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
    return information if isinstance(information, dict) else {}


def _from_metadata(folder: Path) -> list[tuple[Path, bool]]:
    information = _metadata(folder / _METADATA)
    listed = information.get("relative_file_paths")
    names = [Path(str(name)).name for name in listed] if isinstance(listed, list) else []
    missing = [name for name in names if not (folder / name).is_file()]
    if missing:
        raise RecordingError(
            f"{folder}: metadata.yaml lists {missing[0]}, which is not there; copy the whole folder, or give the files that are"
        )
    if not names:
        names = sorted(file.name for file in folder.iterdir() if file.suffix in _SUFFIXES)
    if not names:
        raise RecordingError(f"{folder}: metadata.yaml lists no files and there are none; copy the whole folder")
    packed = str(information.get("compression_mode", "")).upper() == "MESSAGE"
    return [(folder / name, packed) for name in names]


def _packed_messages(metadata: Path, path: Path) -> bool:
    if path.suffix != ".db3" or not metadata.is_file():
        return False
    return bool(_PACKED_MESSAGES.search(metadata.read_text(encoding="utf-8", errors="replace")))


def _open(path: Path, packed: bool) -> Source:
    file = FileBytes(path)
    try:
        head = file.up_to(0, 16)
        if head.startswith(b"#ROSBAG V"):
            return Rosbag1Source(file)
        if head.startswith(mcap.MAGIC):
            return mcap.McapSource(file)
        if head == sqlite_bag.MAGIC:
            return sqlite_bag.SqliteSource(file, packed=packed)
        raise RecordingError(f"{path}: {_what_is_it(head)}")
    except RecordingError:
        file.close()
        raise


def _what_is_it(head: bytes) -> str:
    if not head:
        return (
            "the file is empty (0 bytes): the recorder was killed or the disk was full; record again or copy it again"
        )
    for magic, (name, command) in _PACKED.items():
        if head.startswith(magic):
            return f"the file is compressed as a whole with {name}; unpack it first: {command}"
    return f"not a recording (it begins with {head[:8]!r}); {_KINDS}"
