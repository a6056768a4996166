"""Read recordings of the data port of TI's mmWave radars, such as the AWR1843: .bin or .dat files as the port sent them."""

import os
import re
from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import TimeNs
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch
from calib_core.recordings.plain_files.messages import cloud_channel, cloud_message
from calib_core.recordings.plain_files.source import PlainSource, topic_of
from calib_core.recordings.plain_files.ti_packets import (
    MAGIC,
    MAX_PACKET_BYTES,
    Packet,
    item_name,
    packet_in,
    points_of,
)
from calib_core.recordings.plain_files.ti_times import stamp_packets
from calib_core.results import DataWarning

_SUFFIXES = (".bin", ".dat", ".raw", ".log", "")
_FRAME = "radar"
_LOOK_BYTES = 1 << 20
_PIECE_BYTES = 1 << 16
_DEPTH = 5
_SAMPLED_FILES = 4  # of a folder below the one that was named
_COMMANDS = re.compile(rb"mmwDemo:/>|^(?:sensorStart|sensorStop|profileCfg|frameCfg)\b", re.MULTILINE)
_WORD = re.compile(re.escape(MAGIC))
_ADC_NAME = re.compile(r"adc_?data|_raw_\d+$", re.IGNORECASE)


def open_uart_streams(
    paths: Sequence[Path], radar_start: str | None
) -> tuple[tuple[PlainSource, ...], tuple[Path, ...], frozenset[Path]]:
    """Open the bytes of TI data ports; return their sources, the paths that hold anything else, and the files read.

    Args:
        paths: files, or folders with the chunks of one stream in them or below; judged by their bytes, not by their names.
        radar_start: --radar-start, the time of the first frame, with the time between frames after a comma.

    Raises:
        RecordingError: a path holds other data of such a radar, or --radar-start is given without a stream.
    """
    opened: list[PlainSource] = []
    left: list[Path] = []
    taken: set[Path] = set()
    for path in paths:
        found = _streams_of(path)
        for place, files in found:
            chunks = [file for file in files if not _is_command_log(file)]
            opened.append(_open(place, chunks, radar_start))
            taken.update(files)
        if path.is_file() and not found:
            _refuse_other_data(path)
        if path.is_dir() or not found:
            left.append(path)
    if radar_start is not None and not opened:
        raise RecordingError(
            f"--radar-start {radar_start}: no TI data-port stream among {', '.join(path.name for path in paths)}; "
            "remove the option, or add the stream"
        )
    return tuple(opened), tuple(left), frozenset(taken)


def _streams_of(path: Path) -> list[tuple[Path, list[Path]]]:
    """Return the streams in a file, a folder and the folders below, each with its files."""
    files = _candidates(path)
    found = [(path, files)] if any(map(_is_stream, files)) else []
    for folder in _folders_below(path, _DEPTH):
        files = _candidates(folder)
        if any(map(_is_stream, files[:_SAMPLED_FILES])):
            found.append((folder, files))
    return found


def _folders_below(path: Path, depth: int) -> list[Path]:
    if not (depth and os.access(path, os.R_OK | os.X_OK) and path.is_dir()):
        return []  # what cannot be read is told when the folder is opened
    entries = (entry for entry in path.iterdir() if not entry.name.startswith("."))
    inner = sorted(entry for entry in entries if entry.is_dir() and not entry.is_symlink())
    return [folder for entry in inner for folder in (entry, *_folders_below(entry, depth - 1))]


def _candidates(path: Path) -> list[Path]:
    """Return the files of a path that may be chunks of a stream, in the order of the numbers in their names."""
    readable = path.is_dir() and os.access(path, os.R_OK | os.X_OK)
    inside = [path] if path.is_file() else list(path.iterdir()) if readable else []
    files = [file for file in inside if file.is_file() and file.suffix.lower() in _SUFFIXES]
    return sorted(files, key=lambda file: [int(part) if part.isdigit() else part for part in _parts(file.name)])


def _parts(name: str) -> list[str]:
    return ["", *re.split(r"(\d+)", name)]


def _is_stream(path: Path) -> bool:
    """Return whether a whole packet is near the beginning of a file."""
    data = _head(path)
    return any(packet_in(data[found.start() :]) is not None for found in _WORD.finditer(data))


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(_LOOK_BYTES)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}; check its permissions") from error


def _is_command_log(path: Path) -> bool:
    head = _head(path)
    return head.isascii() and _COMMANDS.search(head) is not None


def _refuse_other_data(path: Path) -> None:
    """Refuse other files of such a radar by their true name.

    Raises:
        RecordingError: it is one.
    """
    if path.suffix.lower() not in _SUFFIXES:
        return
    head = _head(path)
    if _is_command_log(path):
        raise RecordingError(
            f"{path}: a log of a TI radar's configuration port: it holds commands, no detections; open the log of the data port"
        )
    if _ADC_NAME.search(path.stem) and not head.startswith(b"#ROSBAG"):
        raise RecordingError(
            f"{path}: raw ADC samples of a DCA1000 capture card, judging by its name and without a packet of the data port: they "
            "hold no detections; process them to points first, or record the radar's data port"
        )


def _open(path: Path, chunks: Sequence[Path], radar_start: str | None) -> PlainSource:
    stream = _Stream(chunks)
    try:
        scan = _Scan(stream)
        stamped = stamp_packets(path, [packet for _, packet in scan.packets], radar_start, topic_of(path, "radar"))
    except RecordingError:
        stream.close()
        raise
    packets = [scan.packets[row] for row in stamped.rows]
    times = stamped.times_ns

    def message(row: int) -> bytes:
        place, packet = packets[row]
        data = stream.up_to(place, packet.size)
        if packet_in(data) != packet:
            raise MessageError(f"{path.name}: the packet at byte {place} has changed since the file was opened")
        return cloud_message(TimeNs(int(times[row])), _FRAME, points_of(packet, data))

    source = PlainSource(
        path, stream.size, _container(chunks, scan, stamped.clock), cloud_channel(topic_of(path, "radar")), times, message,
        (*_about_damage(path, scan), *stamped.warnings), stream.close, stamped.assumptions,
    )  # fmt: skip
    return source


def _container(chunks: Sequence[Path], scan: "_Scan", clock: str) -> str:
    first = scan.packets[0][1]
    skipped = sorted({item.kind for _, packet in scan.packets for item in packet.items} - {1, 7})
    words = [f"TI data port, xWR{first.platform & 0xFFFF:X}, SDK {first.version}"]
    words += [f"{len(chunks)} files"] * (len(chunks) > 1)
    words += [clock, "x right, y forward, z up turned to x forward, y left, z up"]
    words += [f"without {', '.join(map(item_name, skipped))}"] * bool(skipped)
    return ", ".join(words)


def _about_damage(path: Path, scan: "_Scan") -> list[DataWarning]:
    steps = np.diff([packet.frame for _, packet in scan.packets])
    missing = int((steps[steps > 1] - 1).sum())
    if not (scan.broken or scan.strange_bytes or missing):
        return []
    return [
        DataWarning(
            "damaged-file",
            f"{path.name}: of {scan.broken + len(scan.packets)} packets, {scan.broken} are damaged or cut off and skipped; "
            f"{scan.strange_bytes} bytes belong to no packet; by their numbers, {missing} frames are missing",
            "no action needed for a few: the port drops bytes; if there are many, check its speed and the cable",
        )
    ]


class _Scan:
    """All packets of a stream, and the bytes in between.

    Args:
        stream: the bytes.

    Attributes:
        packets: position and head of each whole packet.
        broken: number of packets that are damaged or cut off.
        strange_bytes: number of other bytes, not counting padding.
    """

    def __init__(self, stream: "_Stream") -> None:
        self.packets: list[tuple[int, Packet]] = []
        self.broken = self.strange_bytes = 0
        after = 0
        place = stream.find(_WORD, 0)
        while place >= 0:
            self._note_between(stream, after, place)
            following = stream.find(_WORD, place + len(MAGIC))
            end = min(following if following >= 0 else stream.size, place + MAX_PACKET_BYTES)
            packet = packet_in(stream.up_to(place, end - place))
            if packet is None:
                self.broken += 1
                after = max(after, end)
            else:
                self.packets.append((place, packet))
                after = max(after, place + packet.size)
            place = following
        self._note_between(stream, after, stream.size)

    def _note_between(self, stream: "_Stream", begin: int, end: int) -> None:
        """Count the bytes between two packets, unless all of them are zero."""
        pieces = (stream.up_to(place, min(_PIECE_BYTES, end - place)) for place in range(begin, end, _PIECE_BYTES))
        if any(map(any, pieces)):
            self.strange_bytes += end - begin


class _Stream:
    """The bytes of one or more files, one after the other.

    Args:
        paths: the files.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._files = [FileBytes(path) for path in paths]
        self._stretches = [FileStretch(file, 0, file.size_bytes) for file in self._files]
        self._starts = np.cumsum([0, *(file.size_bytes for file in self._files)]).tolist()
        self.size: int = self._starts[-1]

    def up_to(self, offset: int, size: int) -> bytes:
        """Return at most size bytes from offset."""
        parts = []
        while size > 0 and offset < self.size:
            number = bisect_right(self._starts, offset) - 1
            part = self._stretches[number].up_to(offset - self._starts[number], size)
            parts.append(part)
            offset, size = offset + len(part), size - len(part)
            if not part:
                break
        return b"".join(parts)

    def find(self, pattern: "re.Pattern[bytes]", start: int) -> int:
        """Return where the pattern is found next, also across two files; -1 where it is not."""
        reach = len(MAGIC) - 1
        while start < self.size:
            number = bisect_right(self._starts, start) - 1
            begin, end = self._starts[number], self._starts[number + 1]
            inside = self._stretches[number].find(pattern, start - begin)
            if inside >= 0:
                return int(begin + inside)
            first = max(start, end - reach)
            across = pattern.search(self.up_to(first, 2 * reach))
            if across:
                return int(first + across.start())
            start = end
        return -1

    def close(self) -> None:
        """Close the files."""
        for file in self._files:
            file.close()
