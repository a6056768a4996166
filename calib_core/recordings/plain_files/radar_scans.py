"""Read radar returns from one file per scan: nuScenes .pcd and View-of-Delft .bin."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import TimeNs
from calib_core.recordings.plain_files.file_stamps import StampedFiles, stamp_files
from calib_core.recordings.plain_files.source import PlainOptions, PlainSource, cloud_channel, cloud_message, topic_of

_FRAME = "radar"
_MAX_BYTES = 1 << 28
_HEAD_BYTES = 1 << 16
_MAX_POINT_BYTES = 1 << 16
_DELFT = np.dtype([(name, "<f4") for name in ("x", "y", "z", "rcs", "v_r", "v_r_compensated", "time")])
_KINDS = {"F": "f", "I": "i", "U": "u"}


def open_pcd_folder(
    folder: Path, files: Sequence[Path], options: PlainOptions, numbered: Mapping[int, TimeNs]
) -> PlainSource:
    """Open a folder of .pcd files, one scan each.

    Raises:
        RecordingError: the files have no times.
    """
    return _open(folder, stamp_files(folder, files, options, numbered), "folder of .pcd", points_of_pcd)


def open_bin_folder(
    folder: Path, files: Sequence[Path], options: PlainOptions, numbered: Mapping[int, TimeNs]
) -> PlainSource:
    """Open a folder of View-of-Delft .bin files, one scan each.

    Raises:
        RecordingError: the files have no times.
    """
    return _open(folder, stamp_files(folder, files, options, numbered), "folder of View-of-Delft .bin", points_of_bin)


def _open(folder: Path, stamped: StampedFiles, what: str, points: Callable[[Path], np.ndarray]) -> PlainSource:
    topic = topic_of(folder, "radar")

    def message(row: int) -> bytes:
        return cloud_message(TimeNs(int(stamped.times_ns[row])), _FRAME, points(stamped.files[row]))

    return PlainSource(
        folder,
        sum(file.stat().st_size for file in stamped.files),
        f"{what}, {len(stamped.files)} files",
        cloud_channel(topic),
        stamped.times_ns,
        message,
        stamped.warnings,
        assumptions=stamped.assumptions(topic),
        zoneless=stamped.zoneless,
        counted=stamped.counted,
    )


def is_lidar_bin(files: Sequence[Path]) -> bool:
    """Return whether .bin files are a lidar's: four floats a point as KITTI has them, not seven as View-of-Delft's radar."""
    sizes = [file.stat().st_size for file in files]
    return all(size % 16 == 0 for size in sizes) and any(size % _DELFT.itemsize for size in sizes)


def _content(path: Path) -> bytes:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise MessageError(f"{path.name} has {path.stat().st_size} bytes, which is too large for a radar scan")
        return path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}; is it still there?") from error


def points_of_bin(path: Path) -> np.ndarray:
    """Read a View-of-Delft scan: 7 float32 per return.

    Raises:
        MessageError: the size does not fit.
    """
    data = _content(path)
    if len(data) % _DELFT.itemsize:
        raise MessageError(
            f"{path.name} has {len(data)} bytes, not a multiple of {_DELFT.itemsize}: not a View-of-Delft radar file "
            "(7 float32 per return: x y z RCS v_r v_r_compensated time)"
        )
    return np.frombuffer(data, dtype=_DELFT)


def points_of_pcd(path: Path) -> np.ndarray:
    """Read a scan in PCD version 0.7, binary or ascii.

    Raises:
        MessageError: the header is damaged, the points are compressed, or there are fewer than the header says.
    """
    data = _content(path)
    head, body = _head(path, data)
    dtype = _dtype(path, head)
    count = _whole(path, head, "POINTS", "WIDTH")
    kind = " ".join(head.get("DATA", ["?"]))
    if kind == "ascii":
        rows = body.decode("ascii", "replace").split()
        fields = len(dtype.names or ())
        if len(rows) < count * fields or any(dtype[name].subdtype for name in dtype.names or ()):
            raise MessageError(
                f"{path.name} has {len(rows)} numbers, but {count * fields} are required: the file is damaged"
            )
        return _table(path, rows[: count * fields], count, dtype)
    if kind != "binary":
        raise MessageError(
            f"{path.name} has '{kind}' data, but only binary and ascii are supported; "
            "convert it with pcl_convert_pcd_ascii_binary"
        )
    if len(body) < count * dtype.itemsize:
        raise MessageError(
            f"{path.name} has {len(body)} bytes of points, but {count * dtype.itemsize} are required: the file is truncated"
        )
    return np.frombuffer(body, dtype=dtype, count=count)


def _table(path: Path, words: Sequence[str], count: int, dtype: "np.dtype[np.void]") -> np.ndarray:
    """Convert the numbers of an ascii file, row by row.

    Raises:
        MessageError: a word is not a number, or does not fit the type of its field.
    """
    names = dtype.names or ()
    points = np.zeros(count, dtype=dtype)
    try:
        table = np.array(words, dtype=np.float64).reshape(count, len(names))
        with np.errstate(over="raise", invalid="raise"):
            for number, name in enumerate(names):
                points[name] = table[:, number]
    except (ValueError, OverflowError, FloatingPointError) as error:
        raise MessageError(f"{path.name} has points that are not numbers of their fields' types ({error})") from error
    return points


def _head(path: Path, data: bytes) -> tuple[dict[str, list[str]], bytes]:
    head: dict[str, list[str]] = {}
    place = 0
    while "DATA" not in head:
        end = data.find(b"\n", place, _HEAD_BYTES)
        if end < 0:
            raise MessageError(f"{path.name} has no PCD header (no DATA line); it is damaged or not a PCD file")
        words = data[place:end].decode("ascii", "replace").split("#")[0].split()
        if words:
            head[words[0].upper()] = words[1:]
        place = end + 1
    return head, data[place:]


def _dtype(path: Path, head: dict[str, list[str]]) -> "np.dtype[np.void]":
    names, sizes, kinds = (head.get(word, []) for word in ("FIELDS", "SIZE", "TYPE"))
    counts = head.get("COUNT", ["1"] * len(names))
    try:
        described = [
            (
                f"{name}{number}" if name == "_" else name,
                f"<{_KINDS[kind]}{int(size)}",
                (int(count),) if count != "1" else (),
            )
            for number, (name, size, kind, count) in enumerate(zip(names, sizes, kinds, counts, strict=True))
        ]
        dtype = np.dtype(described)
        if not 0 < dtype.itemsize <= _MAX_POINT_BYTES:
            raise ValueError(f"a point has {dtype.itemsize} bytes")
        return dtype
    except (KeyError, ValueError, TypeError, OverflowError, MemoryError) as error:
        raise MessageError(
            f"{path.name} has a PCD header with inconsistent FIELDS, SIZE, TYPE and COUNT ({error})"
        ) from error


def _whole(path: Path, head: dict[str, list[str]], *names: str) -> int:
    words = next((head[name] for name in names if head.get(name)), ["none"])
    if not words[0].isdigit():
        raise MessageError(f"{path.name} has a PCD header without the number of points")
    return int(words[0])
