"""Find what a folder holds: pictures, radar files, tables and videos, in it or in the folders of a data set below it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from calib_core.errors import RecordingError
from calib_core.recordings.plain_files.pictures import PICTURE_SUFFIXES
from calib_core.recordings.plain_files.radar_scans import is_lidar_bin
from calib_core.recordings.plain_files.reading_options import PlainOptions
from calib_core.recordings.plain_files.tables.opening import TABLE_SUFFIXES, is_one_scan_each, table_fault
from calib_core.recordings.plain_files.video import VIDEO_SUFFIXES

_DEPTH = 5
_LIDAR = "lidar clouds, which this program does not use"
_KNOWN_TABLES = re.compile(
    r"timestamps?|times?|calib.*|.*calibration.*|intrinsics|extrinsics|readme.*|licen[cs]e.*|notes.*", re.I
)
_CALIBRATIONS = frozenset({"calib", "calibration", "oxts", "pose", "poses"})
_SUMS = re.compile(
    r"_\d+_?(?:frames|scans|sweeps)$", re.I
)  # View-of-Delft: radar_3frames and radar_5frames beside radar
_ROS_SUFFIXES = (".bag", ".mcap", ".db3")
_SAMPLED_FILES = 50


@dataclass(slots=True)
class Contents:
    """What a folder holds.

    Attributes:
        sources: folders with their files, and single files with none.
        refused: what was looked at and not used, with the reason.
        is_ros: whether it is, or directly contains, a ROS recording.
        inside: whether the sources stand below the folder rather than being it.
    """

    sources: list[tuple[Path, tuple[Path, ...]]] = field(default_factory=list)
    refused: list[tuple[Path, str]] = field(default_factory=list)
    is_ros: bool = False
    inside: bool = True


def is_ros(path: Path) -> bool:
    """Return whether a file is, or belongs to, a ROS recording."""
    return path.name == "metadata.yaml" or any(suffix in _ROS_SUFFIXES for suffix in path.suffixes)


def contents_of(folder: Path, options: PlainOptions) -> Contents:
    """Find what a folder holds. A ROS recording in it, or one level below, takes precedence.

    Args:
        folder: as the user gave it.
        options: the user's.

    Raises:
        RecordingError: it cannot be read, or holds files of several kinds side by side.
    """
    try:
        entries = _entries(folder, options)
        below = [inner for entry in entries if entry.is_dir() for inner in entry.iterdir()]
        if any(map(is_ros, (*entries, *below))):
            return Contents(is_ros=True)
        kinds = _kinds(entries)
        contents = Contents()
        if kinds:
            contents.sources.append((folder, _one_kind(folder, kinds)))
            _add_radar_tables(entries, contents, options)
            below_pictures = "a folder below pictures or radar files; open it by its own path"
            contents.refused += [(entry, below_pictures) for entry in entries if entry.is_dir()]
        else:
            _walk(folder, contents, options, 0)
        contents.inside = [path for path, _ in contents.sources] != [folder]
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be read: {error.strerror}") from error
    return contents


def _entries(folder: Path, options: PlainOptions) -> list[Path]:
    return sorted(inner for inner in folder.iterdir() if not inner.name.startswith(".") and inner not in options.taken)


def _kind(file: Path) -> str:
    """Return "pictures", ".pcd" or ".bin"; "" for any other file."""
    suffix = file.suffix.lower()
    return "pictures" if suffix in PICTURE_SUFFIXES else suffix if suffix in (".pcd", ".bin") else ""


def _kinds(entries: Sequence[Path]) -> dict[str, list[Path]]:
    kinds: dict[str, list[Path]] = {}
    for entry in entries:
        if (kind := _kind(entry)) and entry.is_file():
            kinds.setdefault(kind, []).append(entry)
    return kinds


def _one_kind(folder: Path, kinds: dict[str, list[Path]]) -> tuple[Path, ...]:
    """Return the files of a folder.

    Raises:
        RecordingError: they are of several kinds.
    """
    if len(kinds) > 1:
        what = " and ".join(f"{len(files)} {files[0].suffix}" for files in kinds.values())
        raise RecordingError(
            f"{folder}: the folder contains {what} files; put pictures and radar files into separate folders"
        )
    return tuple(next(iter(kinds.values())))


def _walk(folder: Path, contents: Contents, options: PlainOptions, depth: int) -> None:
    """Add what is below a data-set folder."""
    entries = _entries(folder, options)
    folders = [entry for entry in entries if entry.is_dir()]
    files = [entry for entry in entries if entry.is_file()]
    if any(map(is_ros, files)):
        contents.refused.append((folder, "a ROS recording; open it by its own path"))
        return
    kinds = _kinds(files)
    if kinds:
        _add_leaf(folder, kinds, contents)
        _add_radar_tables(files, contents, options)
    else:
        _add_files(folder, files, folders, contents, options)
    for inner in folders:
        if inner.name.lower() in _CALIBRATIONS:
            continue  # read with the pictures beside it
        single = _SUMS.sub("", inner.name)
        if single != inner.name and (folder / single).is_dir():
            contents.refused.append((inner, f"sums of several scans of {single}, which are used one by one"))
            continue
        if inner.name == "sweeps" and (folder / "samples").is_dir():
            contents.refused.append((inner, "frames between the annotated ones; open its folders by their own paths"))
        elif depth >= _DEPTH:
            contents.refused.append((inner, "too many folders deep: give its path instead"))
        else:
            _walk(inner, contents, options, depth + 1)


def _add_leaf(folder: Path, kinds: dict[str, list[Path]], contents: Contents) -> None:
    try:
        files = _one_kind(folder, kinds)
    except RecordingError as error:
        contents.refused.append((folder, str(error).removeprefix(f"{folder}: ")))
        return
    lidar = files[0].name.endswith(".pcd.bin") or (
        files[0].suffix.lower() == ".bin" and is_lidar_bin(files[:_SAMPLED_FILES])
    )
    if lidar:
        contents.refused.append((folder, f"{len(files)} {_LIDAR}"))
    else:
        contents.sources.append((folder, files))


def _add_files(
    folder: Path,
    files: Sequence[Path],
    folders: Sequence[Path],
    contents: Contents,
    options: PlainOptions,
) -> None:
    """Add tables and videos; tables of times and calibrations belong to the folders beside them."""
    of_folders = {folder.with_suffix(suffix) for folder in folders for suffix in (".csv", ".txt")}
    tables = [
        file
        for file in files
        if file.suffix.lower() in TABLE_SUFFIXES and file not in of_folders and not _KNOWN_TABLES.fullmatch(file.stem)
    ]
    is_nuscenes = folder.name.startswith("v1.0-")
    alike: dict[str, list[Path]] = {}
    for file in tables if not is_nuscenes else []:
        alike.setdefault(re.sub(r"\d+", "#", file.name), []).append(file)
    for group in alike.values():
        fault = table_fault(group[0], options) if len(group) > 1 else ""
        if fault:
            contents.refused.append((group[0], f"and {len(group) - 1} like it: {fault}"))
        elif len(group) > 1 and is_one_scan_each(group, options):
            contents.sources.append((folder, tuple(group)))
        else:
            _add_tables(group, contents, options)
    for file in files:
        suffix = file.suffix.lower()
        if suffix in VIDEO_SUFFIXES:
            contents.sources.append((file, ()))


def _add_tables(group: Sequence[Path], contents: Contents, options: PlainOptions) -> None:
    for file in group:
        fault = table_fault(file, options)
        if fault:
            contents.refused.append((file, fault))
        else:
            contents.sources.append((file, ()))


def _add_radar_tables(entries: Sequence[Path], contents: Contents, options: PlainOptions) -> None:
    """Add the tables beside pictures that are a radar's; others give the times of the pictures."""
    for entry in entries:
        if entry.is_file() and entry.suffix.lower() in TABLE_SUFFIXES and not table_fault(entry, options):
            contents.sources.append((entry, ()))
