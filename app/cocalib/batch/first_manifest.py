"""A first manifest from a folder of recordings: what belongs together by where it lies, for a person to complete."""

import json
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from calib_core.errors import InputError
from calib_core.interchange.own.documents import CLICKS_SCHEMA, names_schema
from cocalib.batch.manifest import ManifestRow
from cocalib.solving.solving import intrinsics_near

_SUFFIXES = (".bag", ".mcap", ".db3")
_PLAIN_SUFFIXES = (".avi", ".csv", ".jpeg", ".jpg", ".jsonl", ".mp4", ".pcd", ".png")
"""Of recordings without ROS: what belongs to one is not to be seen from the names."""
_MOST_LEFT_OUT = 20
_BAG_FOLDER = "metadata.yaml"
_SENSORS = ("radar", "camera", "cam", "image", "images", "video")
"""Words of file names that tell the recordings of one session apart."""
_ONLY_SESSION = "1"
_BETWEEN = "-_. "
_MOST_CLICKS_BYTES = 16 * 1024 * 1024
_HEAD = """# Which sessions are calibrated, and how: complete it, then run cocalib batch on this file.
# Paths are relative to this file. Keys of a session, beside those used below: vehicle_type (vehicles of a type are mounted
# alike), radar_serial, camera_serial, boxes, exports = ["tf2"], camera_position_m = [forward, left, up] of the lens in the
# radar frame with camera_position_sigma_m, [session.options] and [session.topics] as cocalib solve has them.
# What all sessions share stands once, under [defaults].

[defaults]
# vehicle_type = "..."
"""
_NOT_CLICKED = (
    "# auto = true  # nobody clicked the reflector in it; this lets the machine, or name a file: clicks = ..."
)


def first_manifest(folder: Path, manifest: Path) -> tuple[str, int]:
    """Return the text of a TOML manifest and the number of its sessions.

    A recording is a .bag, .mcap or .db3 file or a bag folder. Recordings of one folder whose names differ only in the
    sensor (radar.bag and camera.bag) are one session. The vehicle is the first folder below `folder`, the session what follows.

    Args:
        folder: with recordings, at any depth.
        manifest: where the text will be written: its paths are relative to that.

    Raises:
        InputError: the folder cannot be read, or has no recording.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the one that has the recordings")
    rows = sorted(_sessions(folder), key=lambda session: (session.vehicle, session.session))
    if not rows:
        raise InputError(
            f"{folder}: no recording in it: no file that ends in {', '.join(_SUFFIXES)}, and no bag folder; write the manifest "
            "yourself if the recordings are images and tables"
        )
    home = manifest.absolute().parent
    left_out = list(_left_out(folder, rows))
    if len(left_out) > _MOST_LEFT_OUT:
        left_out = [*left_out[:_MOST_LEFT_OUT], f"# and {len(left_out) - _MOST_LEFT_OUT} more folders"]
    return "\n".join([_HEAD, *(_text(row, home) for row in rows), *left_out, *[""] * bool(left_out)]), len(rows)


def _left_out(folder: Path, rows: Sequence[ManifestRow]) -> Iterator[str]:
    """Yield a comment for each folder of images, tables or videos beside which there is no recording."""
    taken = {path.parent for row in rows for path in row.recording} - {folder}
    for where, inside, names in os.walk(folder):
        inside[:] = sorted(name for name in inside if not name.startswith(".") and Path(where, name) not in taken)
        kinds = Counter(suffix for name in names if (suffix := Path(name).suffix.lower()) in _PLAIN_SUFFIXES)
        if kinds:
            counts = ", ".join(f"{count} {suffix}" for suffix, count in sorted(kinds.items()))
            yield f"# left out: {_as_comment(Path(where))} ({counts}); if it is a recording, give it a [[session]] of its own"


def _as_comment(path: Path) -> str:
    return "".join(one if one.isprintable() else "_" for one in path.as_posix())


def _sessions(folder: Path) -> Iterator[ManifestRow]:
    recordings: dict[tuple[Path, str], list[Path]] = {}
    for path in _recordings(folder, {folder.resolve()}):
        recordings.setdefault((path.parent, _without_sensor(path)), []).append(path)
    several = {where for where in {where for where, _ in recordings} if sum(one == where for one, _ in recordings) > 1}
    for (where, rest), paths in recordings.items():
        parts = [*where.relative_to(folder).parts]
        if not parts or where in several:
            parts.append(rest or paths[0].stem)
        only_sensors = _without_sensor(paths[0]) == ""
        session = "-".join(parts[1:]) or (_ONLY_SESSION if only_sensors else paths[0].stem)
        yield ManifestRow(_as_name(parts[0]), _as_name(session), tuple(sorted(paths)))


def _as_name(text: str) -> str:
    """Return a name that a manifest takes: slashes and what cannot be printed are replaced."""
    return "".join("_" if one in "/\\" or not one.isprintable() else one for one in text).strip() or "_"


def _recordings(folder: Path, seen: set[Path] | None = None) -> Iterator[Path]:
    """Yield the recordings below a folder, each real one once; hidden folders and the inside of bag folders are left out.

    Args:
        folder: to look in.
        seen: real folders and files that were looked at already.
    """
    seen = set() if seen is None else seen
    try:
        inside = sorted(folder.iterdir(), key=lambda path: (path.is_symlink(), path))
    except OSError as error:
        raise InputError(f"{folder}: cannot be read: {error.strerror or error}") from error
    for path in inside:
        real = path.resolve()
        if path.name.startswith(".") or real in seen:
            continue
        seen.add(real)
        if path.is_file() and path.suffix.lower() in _SUFFIXES:
            yield path
        elif path.is_dir():
            if (path / _BAG_FOLDER).is_file():
                yield path
            else:
                yield from _recordings(path, seen)


def _without_sensor(path: Path) -> str:
    """Return a file's name without the words that say which sensor it is of."""
    stem = path.stem if path.is_file() else path.name
    for mark in _BETWEEN:
        stem = stem.replace(mark, " ")
    return "-".join(word for word in stem.split() if word.lower() not in _SENSORS)


def _text(row: ManifestRow, home: Path) -> str:
    where = row.recording[0].parent
    clicks = [path for path in sorted(where.glob("*.json")) if _has_clicks(path)]
    alone = len([*_recordings(where)]) <= len(row.recording)
    camera = intrinsics_near(row.recording)
    lines = [
        "[[session]]",
        f"vehicle = {_quoted(row.vehicle)}",
        f"session = {_quoted(row.session)}",
        f"recording = {_quoted_paths(row.recording, home)}",
        f"clicks = {_quoted(_relative(clicks[0], home))}" if len(clicks) == 1 and alone else _NOT_CLICKED,
    ]
    if len(clicks) > 1 or (clicks and not alone):
        lines.append(f"# files with clicks: {', '.join(_relative(click, home) for click in clicks)}")
    if camera is not None:
        lines.append(
            f"# camera = {_quoted(_relative(camera, home))}  # only where the recording has no intrinsics of its own"
        )
    return "\n".join([*lines, ""])


def _has_clicks(path: Path) -> bool:
    try:
        return path.stat().st_size <= _MOST_CLICKS_BYTES and names_schema(
            path.read_text(encoding="utf-8"), CLICKS_SCHEMA
        )
    except (OSError, UnicodeDecodeError):
        return False


def _relative(path: Path, home: Path) -> str:
    """Return a path as the manifest names it: with slashes, relative where that does not lead out of every common folder."""
    try:
        return path.absolute().relative_to(home).as_posix()
    except ValueError:
        return path.absolute().as_posix()


def _quoted_paths(paths: Sequence[Path], home: Path) -> str:
    names = [_quoted(_relative(path, home)) for path in paths]
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def _quoted(text: str) -> str:
    """Return a TOML string; JSON escapes what TOML does, DEL apart."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")
