"""Read radar returns from one file per scan: .pcd as nuScenes has them, and the .bin files of data sets."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import TimeNs
from calib_core.recordings.field_words import names_a_speed
from calib_core.recordings.plain_files.file_stamps import StampedFiles, stamp_files
from calib_core.recordings.plain_files.source import PlainOptions, PlainSource, cloud_channel, cloud_message, topic_of

_FRAME = "radar"
_MAX_BYTES = 1 << 28
_HEAD_BYTES = 1 << 16
_MAX_POINT_BYTES = 1 << 16
_KINDS = {"F": "f", "I": "i", "U": "u"}
_FARTHEST_M, _FASTEST_MPS, _LOUDEST_DB = 500.0, 150.0, 200.0
_SAMPLED_FILES, _SAMPLED_BYTES = 20, 7 * 8 * 4 * 256  # whole returns of every layout
_ENOUGH = 0.95
_LIDAR_NAME = re.compile(r"(?:^|[_-])(?:lidar|ouster|os[0-2]|vlp|hdl|hesai|pandar|livox)(?:[_-]|\d|$)")


@dataclass(frozen=True, slots=True)
class BinLayout:
    """The columns of a return in files of bare numbers.

    Attributes:
        name: of the data set.
        columns: float32 each.
        fits: which returns (n,) of a table of columns can be a radar's.
    """

    name: str
    columns: tuple[str, ...]
    fits: Callable[[np.ndarray], np.ndarray]

    @property
    def dtype(self) -> "np.dtype[np.void]":
        """Of a return."""
        return np.dtype([(name, "<f4") for name in self.columns])

    @property
    def words(self) -> str:
        """Describe it."""
        return f"{self.name} ({len(self.columns)} float32 a return: {' '.join(self.columns)})"


def _ranges_m(points: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):  # of what turns out to be no returns
        return np.sqrt(sum(points[axis].astype(np.float64) ** 2 for axis in "xyz"))


def _is_ahead(points: np.ndarray, *, amplitude: str) -> np.ndarray:
    """Return which returns lie ahead within a radar's reach, and have a speed and an amplitude that it can measure."""
    range_m = _ranges_m(points)
    sound = (points["x"] >= 0) & (range_m <= _FARTHEST_M) & (np.abs(points["v_r"]) <= _FASTEST_MPS)
    return np.asarray(sound & (np.abs(points[amplitude]) <= _LOUDEST_DB))


def _is_delft(points: np.ndarray) -> np.ndarray:
    """Return which returns can be View-of-Delft's: the time counts scans back from 0."""
    ages = -points["time"]
    whole = (ages >= 0) & (ages <= 100) & (ages == np.round(ages)) & (np.abs(points["v_r_compensated"]) <= _FASTEST_MPS)
    return _is_ahead(points, amplitude="rcs") & whole


def _is_tj4d(points: np.ndarray) -> np.ndarray:
    """Return which returns can be TJ4DRadSet's: the range is the length of the position, the angles are angles."""
    range_m = _ranges_m(points)
    angles = (np.abs(points["alpha"]) <= 180) & (np.abs(points["beta"]) <= 90)
    return _is_ahead(points, amplitude="power") & angles & (np.abs(points["range"] - range_m) <= 0.1 + 0.01 * range_m)


BIN_LAYOUTS = (
    BinLayout("View-of-Delft", ("x", "y", "z", "rcs", "v_r", "v_r_compensated", "time"), _is_delft),
    BinLayout("TJ4DRadSet", ("x", "y", "z", "v_r", "range", "power", "alpha", "beta"), _is_tj4d),
)


def open_pcd_folder(
    folder: Path, files: Sequence[Path], options: PlainOptions, known: PlainSource | None = None
) -> PlainSource:
    """Open a folder of .pcd files, one scan each.

    Raises:
        RecordingError: the files have no times.
    """
    return _open(folder, stamp_files(folder, files, options, known), "folder of .pcd", points_of_pcd)


def open_bin_folder(
    folder: Path, files: Sequence[Path], options: PlainOptions, known: PlainSource | None = None
) -> PlainSource:
    """Open a folder of .bin files of a data set, one scan each.

    Raises:
        RecordingError: the files fit no layout, or have no times.
    """
    layout, faults = bin_layout(files)
    if layout is None:
        raise RecordingError(
            f"{folder}: its {len(files)} .bin files fit no layout of radar returns: {'; '.join(faults)}; write them as one CSV "
            "per scan and say which column is which: --map x=1:m --map y=2:m --map z=3:m --map doppler=4:mps"
        )
    points = partial(points_of_bin, layout=layout)
    return _open(folder, stamp_files(folder, files, options, known), f"folder of {layout.name} .bin", points)


def bin_layout(files: Sequence[Path]) -> tuple[BinLayout | None, list[str]]:
    """Return the layout that the sizes of all files and the values of a sample fit, or why none does."""
    sizes = [file.stat().st_size for file in files]
    faults = []
    for layout in BIN_LAYOUTS:
        others = sum(size % layout.dtype.itemsize > 0 for size in sizes)
        if others:
            faults.append(f"{layout.words}: {others} of {len(files)} files have another size")
            continue
        points = _sample_returns(files, layout.dtype)
        fitting = float(np.mean(layout.fits(points))) if len(points) else 0.0
        if fitting >= _ENOUGH:
            return layout, []
        why = f"only {100 * fitting:.0f} % of the returns could be a radar's" if len(points) else "the files are empty"
        faults.append(f"{layout.words}: {why}")
    return None, faults


def _sample_returns(files: Sequence[Path], dtype: "np.dtype[np.void]") -> np.ndarray:
    """Return the first returns of some files spread over a folder."""
    filled = [file for file in files if file.stat().st_size]
    places = np.unique(np.linspace(0, len(filled) - 1, min(len(filled), _SAMPLED_FILES)).astype(np.int64))
    parts = [np.frombuffer(_content(filled[place], _SAMPLED_BYTES), dtype=dtype) for place in places.tolist()]
    return np.concatenate([np.zeros(0, dtype=dtype), *parts])


def _open(folder: Path, stamped: StampedFiles, what: str, points: Callable[[Path], np.ndarray]) -> PlainSource:
    def message(row: int) -> bytes:
        return cloud_message(TimeNs(int(stamped.times_ns[row])), _FRAME, points(stamped.files[row]))

    empty = sum(not file.stat().st_size for file in stamped.files)
    text = f"{what}, {len(stamped.files)} files" + (f", {empty} of them empty" if empty else "")
    return stamped.source(folder, text, cloud_channel(topic_of(folder, "radar")), message)


def is_named_lidar(folder: Path) -> bool:
    """Return whether the name of a folder is that of a lidar; velodyne is not, since data sets put radars there, too."""
    return _LIDAR_NAME.search(folder.name.lower()) is not None


def is_lidar_pcd(files: Sequence[Path]) -> bool:
    """Return whether .pcd files are a lidar's: no speed, and numbers of its lasers, or a folder of its name."""
    with files[0].open("rb") as file:
        fields = next(
            (line.split()[1:] for line in file.read(_HEAD_BYTES).split(b"\n") if line.startswith(b"FIELDS")), []
        )
    names = [name.decode("utf-8", "replace") for name in fields]
    return not names_a_speed(names) and ("ring" in names or is_named_lidar(files[0].parent))


def is_lidar_bin(files: Sequence[Path]) -> bool:
    """Return whether .bin files are a lidar's: x, y, z and an intensity as KITTI has them, and of no radar's layout."""
    if any(file.stat().st_size % 16 for file in files) or bin_layout(files)[0] is not None:
        return False
    points = _sample_returns(files, np.dtype([(name, "<f4") for name in ("x", "y", "z", "intensity")]))
    sound = [*(np.abs(points[axis]) <= _FARTHEST_M for axis in "xyz"), points["intensity"] >= 0]
    return bool(np.mean(np.logical_and.reduce(sound)) >= _ENOUGH) if len(points) else False


def _content(path: Path, size: int = -1) -> bytes:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise MessageError(f"{path.name} has {path.stat().st_size} bytes, which is too large for a radar scan")
        with path.open("rb") as file:
            return file.read(size)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}; is it still there?") from error


def points_of_bin(path: Path, layout: BinLayout) -> np.ndarray:
    """Read a scan of bare numbers.

    Raises:
        MessageError: the size does not fit: the file has changed.
    """
    data = _content(path)
    if len(data) % layout.dtype.itemsize:
        raise MessageError(
            f"{path.name} has {len(data)} bytes, not a multiple of {layout.dtype.itemsize}: {layout.words}"
        )
    return np.frombuffer(data, dtype=layout.dtype)


def points_of_pcd(path: Path) -> np.ndarray:
    """Read a scan in PCD version 0.7, binary or ascii.

    Raises:
        MessageError: the header is damaged, the points are compressed, or there are not as many as the header says.
    """
    data = _content(path)
    head, body = _head(path, data)
    dtype = _dtype(path, head)
    count = _whole(path, head, "POINTS", "WIDTH")
    kind = " ".join(head.get("DATA", ["?"]))
    if kind == "ascii":
        rows = body.decode("ascii", "replace").split()
        fields = len(dtype.names or ())
        if len(rows) != count * fields or any(dtype[name].subdtype for name in dtype.names or ()):
            raise MessageError(
                f"{path.name} has {len(rows)} numbers, but {count * fields} are required: the file is damaged"
            )
        return _table(path, rows, count, dtype)
    if kind != "binary":
        raise MessageError(
            f"{path.name} has '{kind}' data, but only binary and ascii are supported; "
            "convert it with pcl_convert_pcd_ascii_binary"
        )
    size = count * dtype.itemsize
    if len(body) < size or len(body) >= size + dtype.itemsize:
        fault = "the file is truncated" if len(body) < size else "its header states too few points"
        raise MessageError(f"{path.name} has {len(body)} bytes of points, but {size} are required: {fault}")
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
