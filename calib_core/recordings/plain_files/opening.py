"""Open folders of images and radar files, tables and videos, with or without ROS recordings; what is not used is named."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from calib_core.errors import RecordingError
from calib_core.measurements import DataWarning
from calib_core.recordings.containers.sources import Assumption
from calib_core.recordings.plain_files.images import IMAGE_SUFFIXES, open_image_folder
from calib_core.recordings.plain_files.radar_scans import (
    is_lidar_bin,
    is_lidar_pcd,
    is_named_lidar,
    open_bin_folder,
    open_pcd_folder,
)
from calib_core.recordings.plain_files.source import PlainOptions, PlainSource
from calib_core.recordings.plain_files.tables.opening import (
    TABLE_SUFFIXES,
    is_one_scan_each,
    open_radar_table,
    open_table_folder,
    table_fault,
)
from calib_core.recordings.plain_files.video import VIDEO_SUFFIXES, open_video

_Opener = Callable[[Path, Sequence[Path], PlainOptions, PlainSource | None], PlainSource]
_FOLDERS: Mapping[str, _Opener] = {
    **dict.fromkeys(IMAGE_SUFFIXES, open_image_folder),
    ".pcd": open_pcd_folder,
    ".bin": open_bin_folder,
}
_MOST_NAMED = 6
_DEPTH = 5
_LIDAR = "lidar clouds, which this program does not use"
_ARRAY_SUFFIXES = (".npy", ".npz", ".h5", ".hdf5", ".mat")
_ECHOES = re.compile(r"radar|navtech|polar", re.I)
_CAMERA = re.compile(r"cam|ima?ge?|rgb", re.I)
_KNOWN_TABLES = re.compile(
    r"timestamps?|times?|calib.*|.*calibration.*|intrinsics|extrinsics|readme.*|licen[cs]e.*|notes.*", re.I
)
_CALIBRATIONS = frozenset({"calib", "calibration", "oxts", "pose", "poses"})
_SUMS = re.compile(
    r"_\d+_?(?:frames|scans|sweeps)$", re.I
)  # View-of-Delft: radar_3frames and radar_5frames beside radar
_ROS_SUFFIXES = (".bag", ".mcap", ".db3")


def open_plain_sources(
    paths: Sequence[Path], options: PlainOptions, streams: Sequence[PlainSource] = ()
) -> tuple[tuple[PlainSource, ...], tuple[Path, ...]]:
    """Open the paths that are not ROS recordings; return the streams and their sources, and the remaining paths.

    Args:
        paths: as the user gave them.
        options: the user's.
        streams: what was found in these paths already; paths that hold nothing else are no error.

    Raises:
        RecordingError: such a file or folder cannot be used.
    """
    opening = _Opening(options, tuple(streams))
    try:
        for path in paths:
            opening.add(path)
        sources, left = opening.finish()
        _require_use(paths, sources, left, options)
    except RecordingError:
        opening.close()
        raise
    return sources, left


def _require_use(
    paths: Sequence[Path], sources: Sequence[PlainSource], left: Sequence[Path], options: PlainOptions
) -> None:
    """Refuse options that apply to none of the files rather than ignore them."""
    videos = any(source.path.suffix.lower() in VIDEO_SUFFIXES for source in sources)
    if options.video_start is not None and not videos:
        raise RecordingError(
            f"--video-start {options.video_start}: no video among {', '.join(path.name for path in paths)}; "
            "remove the option, or add the video"
        )


class _Opening:
    """The sources opened so far, and what was looked at and not used."""

    def __init__(self, options: PlainOptions, streams: tuple[PlainSource, ...]) -> None:
        self.options = options
        self.streams = streams
        self.left: list[Path] = []
        self.found: list[tuple[Path, tuple[Path, ...], bool]] = []
        self.refused: list[tuple[Path, str]] = []
        self.sources: list[PlainSource] = []
        self.calibrations: list[Path] = []

    def add(self, path: Path) -> None:
        """Add a path as the user gave it; a data-set folder becomes its contents.

        Raises:
            RecordingError: nothing in a folder can be used.
        """
        contents = contents_of(path, self.options) if path.is_dir() else Contents([(path, ())], inside=False)
        self.found.extend((inner, files, contents.inside) for inner, files in contents.sources)
        self.refused.extend(contents.refused)
        self.calibrations.extend(contents.calibrations)
        has_stream = any(file.is_relative_to(path) for file in self.options.taken)
        if not contents.sources and contents.refused and not has_stream:
            raise RecordingError(f"{path}: nothing in it can be used: {_reasons(contents.refused)}")
        if contents.is_ros or not (contents.sources or has_stream):
            self.left.append(path)

    def finish(self) -> tuple[tuple[PlainSource, ...], tuple[Path, ...]]:
        """Open everything, images first, since files without times have those of the files of their names or numbers.

        Raises:
            RecordingError: what the user named, or all that was found, cannot be used.
        """
        known: PlainSource | None = None
        opened: dict[int, PlainSource] = {}
        for place in sorted(range(len(self.found)), key=lambda place: not _has_images(self.found[place][1])):
            path, files, inside = self.found[place]
            source = self._open(path, files, known, inside=inside)
            if source is not None:
                opened[place] = source
                self.sources.append(source)
                known = known or (source if _tells_times(source) else None)
        for place, source in opened.items() if known is not None else ():
            if source.counted and source.names:
                opened[place] = self._opened(*self.found[place][:2], known) or source
        if not (opened or self.left or self.streams):
            raise RecordingError(f"{self.found[0][0].parent}: nothing in it can be used: {_reasons(self.refused)}")
        named = list(self.streams)
        for place in sorted(opened):
            named.append(_with_own_topic(opened[place], [other.channel.topic for other in named]))
        cameras = [source.camera.file for source in named if source.camera is not None]
        unused = [one for one in self.calibrations if not any(file.is_relative_to(one) for file in cameras)]
        self.refused += [(one, "calibrations of no images found; to read one: cocalib import FILE") for one in unused]
        return self._with_refusals(_with_open_times(named, ros=bool(self.left))), tuple(self.left)

    def _open(
        self, path: Path, files: Sequence[Path], known: PlainSource | None, *, inside: bool
    ) -> PlainSource | None:
        """Open one file or folder; what was found inside a folder and cannot be used is only remembered.

        Raises:
            RecordingError: the user named it, and it cannot be used.
        """
        try:
            source = self._opened(path, files, known)
        except RecordingError as error:
            if not inside:
                raise
            self.refused.append((path, str(error).removeprefix(f"{path}: ")))
            return None
        if source is None:
            self.left.append(path)
        return source

    def _opened(self, path: Path, files: Sequence[Path], known: PlainSource | None) -> PlainSource | None:
        suffix = path.suffix.lower()
        if files:
            if files[0].suffix.lower() in TABLE_SUFFIXES:
                return open_table_folder(path, files, self.options, known)
            return _FOLDERS[files[0].suffix.lower()](path, files, self.options, known)
        if suffix in TABLE_SUFFIXES:
            return open_radar_table(path, self.options)
        if suffix in VIDEO_SUFFIXES:
            return open_video(path, self.options.video_start)
        if suffix in _FOLDERS:
            raise RecordingError(
                f"{path}: a single {suffix} file is not a recording; open the folder with all such files: {path.parent}"
            )
        return None

    def _with_refusals(self, sources: Sequence[PlainSource]) -> tuple[PlainSource, ...]:
        if not self.refused or not sources:
            return tuple(sources)
        count = len(self.refused)
        warning = DataWarning.reported(
            "unused-files",
            f"{count} {'file or folder was' if count == 1 else 'files and folders were'} looked at and not used: "
            f"{_reasons(self.refused)}",
            "no action needed if none of them holds the radar or the camera; otherwise open the one that does by its own path",
        )
        first = replace(sources[0], warnings=(*sources[0].warnings, warning))
        return (first, *sources[1:])

    def close(self) -> None:
        """Close what was opened."""
        for source in self.sources:
            source.close()


def _tells_times(source: PlainSource) -> bool:
    """Return whether the times of a folder's files are theirs and tell them apart."""
    return bool(source.names) and not source.counted and bool((np.diff(source.times_ns) > 0).all())


def _has_images(files: Sequence[Path]) -> bool:
    return bool(files) and files[0].suffix.lower() in IMAGE_SUFFIXES


def _reasons(refused: Sequence[tuple[Path, str]]) -> str:
    shown = "; ".join(f"{path.name} ({reason})" for path, reason in refused[:_MOST_NAMED])
    more = len(refused) - _MOST_NAMED
    return f"{shown}; and {more} more" if more > 0 else shown


def _with_open_times(sources: Sequence[PlainSource], *, ros: bool) -> list[PlainSource]:
    """Assume what the times leave open where it matters: where other files have times that do not."""
    found = []
    for source in sources:
        others = [other for other in sources if other is not source]
        added = []
        if source.zoneless and (ros or not all(other.zoneless for other in others)):
            text = "its dates have no time zone; read as UTC"
            added.append(Assumption("time-zone", source.channel.topic, text, "--time-zone UTC"))
        if source.counted and (ros or not all(other.counted for other in others)):
            text = "its files or scans are numbered and have no times; read as 0.1 s apart, number 0 at 1 s"
            added.append(Assumption("frame-interval", source.channel.topic, text, "--confirm-assumptions"))
        found.append(replace(source, assumptions=(*source.assumptions, *added)))
    return found


def _with_own_topic(source: PlainSource, taken: Sequence[str]) -> PlainSource:
    """Distinguish folders of the same name by their parent folder."""
    topic = source.channel.topic
    if topic not in taken:
        return source
    above = "".join(letter if letter.isalnum() else "_" for letter in source.path.parent.name)
    own = f"/{above}{topic}"
    assumptions = tuple(replace(assumption, topic=own) for assumption in source.assumptions)
    return replace(source, channel=replace(source.channel, topic=own), assumptions=assumptions)


def files_behind(path: Path) -> tuple[Path, ...]:
    """Return the files of a source: the path itself, or the files of a folder sorted by name."""
    return tuple(sorted(file for file in path.iterdir() if file.is_file())) if path.is_dir() else (path,)


@dataclass(slots=True)
class Contents:
    """What a folder holds.

    Attributes:
        sources: folders with their files, and single files with none.
        refused: what was looked at and not used, with the reason.
        calibrations: folders of calibrations, which are read with the images beside them.
        is_ros: whether it is, or directly contains, a ROS recording.
        inside: whether the sources stand below the folder rather than being it.
    """

    sources: list[tuple[Path, tuple[Path, ...]]] = field(default_factory=list)
    refused: list[tuple[Path, str]] = field(default_factory=list)
    calibrations: list[Path] = field(default_factory=list)
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
            contents.refused += _no_files([entry for entry in entries if not entry.is_dir()])
            contents.sources.append((folder, _one_kind(folder, kinds)))
            _add_radar_tables(entries, contents, options)
            below_images = "a folder below images or radar files; open it by its own path"
            contents.refused += [(entry, below_images) for entry in entries if entry.is_dir()]
        else:
            _walk(folder, contents, options, 0)
        contents.inside = [path for path, _ in contents.sources] != [folder]
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be read: {error.strerror}") from error
    return contents


def _entries(folder: Path, options: PlainOptions) -> list[Path]:
    return sorted(inner for inner in folder.iterdir() if not inner.name.startswith(".") and inner not in options.taken)


def _kind(file: Path) -> str:
    """Return "images", ".pcd" or ".bin"; "" for any other file."""
    suffix = file.suffix.lower()
    return "images" if suffix in IMAGE_SUFFIXES else suffix if suffix in (".pcd", ".bin") else ""


def _no_files(entries: Sequence[Path]) -> list[tuple[Path, str]]:
    """Name what has the name of an image, a scan or a table and is no file, so that it is not lost in silence."""
    what = "a broken link, a pipe or a folder"
    tables = [entry for entry in entries if entry.suffix.lower() in TABLE_SUFFIXES and not entry.is_dir()]
    return [(one, what) for one in (*filter(_kind, entries), *tables) if not one.is_file()]


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
            f"{folder}: the folder contains {what} files; put images and radar files into separate folders"
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
    contents.refused += _no_files(entries)
    if kinds:
        _add_leaf(folder, kinds, contents)
        _add_radar_tables(files, contents, options)
    else:
        _add_files(folder, files, folders, contents, options)
    for inner in folders:
        if inner.name.lower() in _CALIBRATIONS:
            contents.calibrations += [inner] if inner.name.lower().startswith("calib") else []
            continue
        reason = _unwalked(folder, inner, depth)
        if reason:
            contents.refused.append((inner, reason))
        else:
            _walk(inner, contents, options, depth + 1)


def _unwalked(folder: Path, inner: Path, depth: int) -> str:
    """Say why a folder in a data set is not looked into; "" if it is."""
    if inner.is_symlink() and inner.resolve() in (folder.resolve(), *folder.resolve().parents):
        return "a link to a folder above it"
    single = _SUMS.sub("", inner.name)
    if single != inner.name and (folder / single).is_dir():
        return f"sums of several scans of {single}, which are used one by one"
    if inner.name == "sweeps" and (folder / "samples").is_dir():
        return "frames between the annotated ones; open its folders by their own paths"
    return "too many folders deep: give its path instead" if depth >= _DEPTH else ""


def _add_leaf(folder: Path, kinds: dict[str, list[Path]], contents: Contents) -> None:
    try:
        files = _one_kind(folder, kinds)
    except RecordingError as error:
        contents.refused.append((folder, str(error).removeprefix(f"{folder}: ")))
        return
    if _has_images(files) and _ECHOES.search(folder.name) and not _CAMERA.search(folder.name):
        contents.refused.append(
            (folder, f"{len(files)} images of a radar's echoes by its name; open it by its own path")
        )
        return
    lidar = {".bin": is_lidar_bin, ".pcd": is_lidar_pcd}.get(files[0].suffix.lower(), lambda _: False)
    if files[0].name.endswith(".pcd.bin") or lidar(files):
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
    of_folders = {folder.parent / f"{folder.stem}{suffix}" for folder in folders for suffix in (".csv", ".txt")}
    tables = [
        file
        for file in files
        if file.suffix.lower() in TABLE_SUFFIXES and file not in of_folders and not _KNOWN_TABLES.fullmatch(file.stem)
    ]
    is_nuscenes = folder.name.startswith("v1.0-")
    alike: dict[str, list[Path]] = {}
    used = not is_nuscenes and not _is_refused(folder, files, tables, contents)
    for file in tables if used else []:
        alike.setdefault(re.sub(r"\d+", "#", file.name), []).append(file)
    for group in alike.values():
        fault = table_fault(group[0], options) if len(group) > 1 else ""
        if fault:
            contents.refused.append((group[0], f"and {len(group) - 1} like it: {fault}"))
        elif len(group) > 1 and is_one_scan_each(group, options):
            contents.sources.append((folder, tuple(group)))
        else:
            _add_tables(group, contents, options)
    contents.sources += [(file, ()) for file in files if file.suffix.lower() in VIDEO_SUFFIXES]
    arrays = [file for file in files if file.suffix.lower() in _ARRAY_SUFFIXES]
    if arrays and used:
        what = f"{len(arrays)} {arrays[0].suffix} files, which are not read"
        contents.refused.append((folder, f"{what}; write the returns of each scan as a table, .pcd or .bin"))


def _is_refused(folder: Path, files: Sequence[Path], tables: Sequence[Path], contents: Contents) -> bool:
    """Return whether a folder's name says that its tables are a lidar's, or its other files a radar's; it is named then."""
    if tables and is_named_lidar(folder):
        contents.refused.append((folder, f"{len(tables)} {_LIDAR}"))
    elif files and not tables and "radar" in folder.name.lower():
        what = f"{len(files)} {files[0].suffix} files, of no form that is read"
        contents.refused.append((folder, f"{what}; give a table, .pcd or .bin of returns for each scan"))
    else:
        return False
    return True


def _add_tables(group: Sequence[Path], contents: Contents, options: PlainOptions) -> None:
    for file in group:
        fault = table_fault(file, options)
        if fault:
            contents.refused.append((file, fault))
        else:
            contents.sources.append((file, ()))


def _add_radar_tables(entries: Sequence[Path], contents: Contents, options: PlainOptions) -> None:
    """Add the tables beside images that are a radar's; others give the times of the images."""
    for entry in entries:
        if entry.is_file() and entry.suffix.lower() in TABLE_SUFFIXES and not table_fault(entry, options):
            contents.sources.append((entry, ()))
