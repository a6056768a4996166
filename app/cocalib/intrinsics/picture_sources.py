"""Open what pictures of a board are given in: a recording, a video, a folder of pictures or several picture files."""

import glob
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from calib_core.errors import InputError
from calib_core.recordings import RecordingOptions, holds_recording, open_recording, require_files
from cocalib.intrinsics.picture_files import PICTURE_SUFFIXES, FilePictures, pictures_in, refuse_two_series
from cocalib.intrinsics.recorded_pictures import RecordedPictures
from cocalib.intrinsics.video_pictures import VIDEO_SUFFIXES, VideoPictures

OpenPictures = RecordedPictures | VideoPictures | FilePictures


@contextmanager
def open_pictures(paths: Sequence[Path], options: RecordingOptions | None = None) -> Iterator[OpenPictures]:
    """Open a source of pictures of one camera; one picture at a time is read.

    Args:
        paths: a recording's files, one video, one folder of pictures, or several pictures; "*" in a name is spelled out.
        options: topics and clock of a recording.

    Raises:
        CalibrationError: there are no pictures, or those of several sources or cameras.
    """
    found = require_files(spelled_out(paths))
    kinds = {_kind(path) for path in found}
    if len(kinds) > 1:
        named = ", ".join(f"{path.name}: {_kind(path)}" for path in (found[0], _first_of_another_kind(found)))
        raise InputError(
            f"{len(found)} sources of different kinds ({named}); give either a recording, one video, one folder of pictures, or "
            "picture files"
        )
    (kind,) = kinds
    if kind == "a recording":
        with open_recording(found, options, require=("image",)) as recording:
            yield RecordedPictures(recording)
        return
    if options is not None and options.image_topic is not None:
        raise InputError(f"{found[0].name} is {kind}; --image-topic {options.image_topic} applies to a recording")
    if kind == "a video":
        if len(found) > 1:
            raise InputError(f"{len(found)} videos; a calibration is of one camera in one video: give one of them")
        video = VideoPictures(found[0])
        try:
            yield video
        finally:
            video.close()
        return
    yield FilePictures(_files(found, kind))


def spelled_out(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Return the paths with those of a pattern such as left*.jpg in place of it.

    Raises:
        InputError: nothing has such a name.
    """
    found: list[Path] = []
    for path in paths:
        if path.exists() or not glob.has_magic(str(path)):
            found.append(path)
            continue
        named = sorted(Path(name) for name in glob.glob(str(path)))  # noqa: PTH207 - the pattern may be absolute
        if not named:
            raise InputError(f"{path}: nothing has such a name; check the folder and the pattern")
        found += named
    return tuple(found)


def _files(paths: Sequence[Path], kind: str) -> tuple[Path, ...]:
    """Return the picture files that are meant.

    Raises:
        InputError: there are several folders, or pictures of several cameras in one.
    """
    if kind == "a picture":
        return tuple(dict.fromkeys(paths))
    if len(paths) > 1:
        raise InputError(f"{len(paths)} folders of pictures; a calibration is of one camera: give one folder")
    files = pictures_in(paths[0])
    refuse_two_series(paths[0], files)
    return files


def _kind(path: Path) -> str:
    suffix = path.suffix.lower()
    if path.is_dir():
        return "a folder of pictures" if pictures_in(path) and not holds_recording(path) else "a recording"
    if suffix in PICTURE_SUFFIXES:
        return "a picture"
    return "a video" if suffix in VIDEO_SUFFIXES else "a recording"


def _first_of_another_kind(paths: Sequence[Path]) -> Path:
    return next(path for path in paths if _kind(path) != _kind(paths[0]))
