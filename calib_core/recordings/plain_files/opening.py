"""Open folders of pictures and radar files, CSV and video files, with or without ROS recordings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from calib_core.errors import RecordingError
from calib_core.recordings.plain_files.pictures import PICTURE_SUFFIXES, open_picture_folder
from calib_core.recordings.plain_files.radar_csv import open_radar_csv
from calib_core.recordings.plain_files.radar_scans import open_bin_folder, open_pcd_folder
from calib_core.recordings.plain_files.source import PlainSource
from calib_core.recordings.plain_files.video import VIDEO_SUFFIXES, open_video

__all__ = ["files_behind", "open_plain_sources"]

_FOLDERS: Mapping[str, Callable[[Path, Sequence[Path]], PlainSource]] = {
    **dict.fromkeys(PICTURE_SUFFIXES, open_picture_folder),
    ".pcd": open_pcd_folder,
    ".bin": open_bin_folder,
}


def open_plain_sources(
    paths: Sequence[Path], video_start: str | None = None
) -> tuple[tuple[PlainSource, ...], tuple[Path, ...]]:
    """Open the paths that are not ROS recordings; return their sources and the remaining paths.

    Args:
        paths: as the user gave them.
        video_start: the time of a video's first frame.

    Raises:
        RecordingError: such a file or folder cannot be used.
    """
    opened: list[PlainSource] = []
    left: list[Path] = []
    try:
        for path in (inner for given in paths for inner in _expanded(given)):
            source = _open(path, video_start)
            if source is None:
                left.append(path)
            else:
                opened.append(_with_own_topic(source, [other.channel.topic for other in opened]))
        if video_start is not None and not any(source.path.suffix.lower() in VIDEO_SUFFIXES for source in opened):
            raise RecordingError(
                f"--video-start {video_start}: no video among {', '.join(path.name for path in paths)}; "
                "remove the option, or add the video"
            )
    except RecordingError:
        for source in opened:
            source.close()
        raise
    return tuple(opened), tuple(left)


def _expanded(path: Path) -> list[Path]:
    """Return the contents of a data-set folder: folders of pictures or radar files, CSV files and videos one level down.

    Any other path is returned as it is, and so is a folder that contains a ROS recording, pictures or radar files.
    """
    if not path.is_dir():
        return [path]
    inside = sorted(inner for inner in path.iterdir() if not inner.name.startswith("."))
    if any(_is_ros(inner) or (inner.is_file() and inner.suffix.lower() in _FOLDERS) for inner in inside):
        return [path]
    if any(_is_ros(below) for inner in inside if inner.is_dir() for below in inner.iterdir()):
        return [path]
    files = [inner for inner in inside if inner.is_file() and inner.suffix.lower() in (".csv", *VIDEO_SUFFIXES)]
    folders = [
        inner
        for inner in inside
        if inner.is_dir() and any(below.suffix.lower() in _FOLDERS for below in inner.iterdir())
    ]
    time_tables = {folder.with_suffix(".csv") for folder in folders}  # file times, not radar returns
    return [*folders, *(file for file in files if file not in time_tables)] or [path]


def _is_ros(path: Path) -> bool:
    return path.name == "metadata.yaml" or any(suffix in (".bag", ".mcap", ".db3") for suffix in path.suffixes)


def _open(path: Path, video_start: str | None) -> PlainSource | None:
    suffix = path.suffix.lower()
    if path.is_dir():
        return _open_folder(path)
    if suffix == ".csv":
        return open_radar_csv(path)
    if suffix in VIDEO_SUFFIXES:
        return open_video(path, video_start)
    if suffix in _FOLDERS:
        raise RecordingError(
            f"{path}: a single {suffix} file is not a recording; open the folder with all such files: {path.parent}"
        )
    return None


def _open_folder(folder: Path) -> PlainSource | None:
    """Open a folder of pictures or radar files; None if it contains neither, or contains a ROS recording."""
    kinds: dict[Callable[[Path, Sequence[Path]], PlainSource], list[Path]] = {}
    for file in sorted(folder.iterdir()):
        if _is_ros(file):
            return None
        opener = _FOLDERS.get(file.suffix.lower())
        if opener is not None and file.is_file() and not file.name.startswith("."):
            kinds.setdefault(opener, []).append(file)
    if len(kinds) > 1:
        what = " and ".join(f"{len(files)} {files[0].suffix}" for files in kinds.values())
        raise RecordingError(
            f"{folder}: the folder contains {what} files; put pictures and radar files into separate folders"
        )
    for opener, files in kinds.items():
        return opener(folder, files)
    return None


def _with_own_topic(source: PlainSource, taken: Sequence[str]) -> PlainSource:
    """Distinguish folders of the same name by their parent folder."""
    topic = source.channel.topic
    if topic not in taken:
        return source
    above = "".join(letter if letter.isalnum() else "_" for letter in source.path.parent.name)
    return replace(source, channel=replace(source.channel, topic=f"/{above}{topic}"))


def files_behind(path: Path) -> tuple[Path, ...]:
    """Return the files of a source: the path itself, or the files of a folder sorted by name."""
    return tuple(sorted(file for file in path.iterdir() if file.is_file())) if path.is_dir() else (path,)
