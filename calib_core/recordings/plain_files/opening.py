"""Folders of pictures and radar files, CSV and video files: opened beside the recordings of ROS, or without any."""

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
    """Open what is no ROS recording; return it with the paths that are left.

    Args:
        paths: as a person gave them.
        video_start: the time of a video's first frame.

    Raises:
        RecordingError: a file or folder of these kinds cannot be used.
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
                f"--video-start {video_start}: there is no video among {', '.join(path.name for path in paths)}; "
                "leave it away, or give the video too"
            )
    except RecordingError:
        for source in opened:
            source.close()
        raise
    return tuple(opened), tuple(left)


def _expanded(path: Path) -> list[Path]:
    """Return what a data set's folder holds one level down: folders of pictures or radar files, CSV files, videos.

    Any other path stands for itself, so does a folder that holds a ROS recording or is one of pictures or radar files.
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
    beside = {folder.with_suffix(".csv") for folder in folders}  # times of a folder's files, not returns
    return [*folders, *(file for file in files if file not in beside)] or [path]


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
            f"{path}: a single file of its kind is no recording; give the folder that holds them all: {path.parent}"
        )
    return None


def _open_folder(folder: Path) -> PlainSource | None:
    """Open a folder of pictures or radar files; None where it holds neither, or a ROS recording."""
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
            f"{folder}: the folder holds {what} files; put pictures and radar files into folders of their own"
        )
    for opener, files in kinds.items():
        return opener(folder, files)
    return None


def _with_own_topic(source: PlainSource, taken: Sequence[str]) -> PlainSource:
    """Tell folders of the same name apart by the folder above."""
    topic = source.channel.topic
    if topic not in taken:
        return source
    above = "".join(letter if letter.isalnum() else "_" for letter in source.path.parent.name)
    return replace(source, channel=replace(source.channel, topic=f"/{above}{topic}"))


def files_behind(path: Path) -> tuple[Path, ...]:
    """Return the files of a source's path: itself, or those of a folder in order of their names."""
    return tuple(sorted(file for file in path.iterdir() if file.is_file())) if path.is_dir() else (path,)
