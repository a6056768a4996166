"""Read recordings of the data port of TI's mmWave radars, such as the AWR1843: .bin or .dat files as the port sent them."""

import os
import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, DataWarning, TimeNs
from calib_core.recordings.containers.sources import Assumption
from calib_core.recordings.plain_files.source import PlainSource, cloud_channel, cloud_message, topic_of
from calib_core.recordings.time.written_times import read_time

MAGIC = b"\x02\x01\x04\x03\x06\x05\x08\x07"
MAX_PACKET_BYTES = 1 << 20
_HEADER = struct.Struct("<8s7I")
_HEADER_SIZES = (_HEADER.size + 4, _HEADER.size)
"""With the number of the subframe, and without it (SDK 1 and xWR14xx)."""
_TLV = struct.Struct("<II")
_MAX_ITEMS = 64
_POINTS, _SIDE_INFO = 1, 7
_PAD_BYTES = 32
_NAMES: Mapping[int, str] = {
    1: "points", 2: "range profile", 3: "noise profile", 4: "azimuth heat map", 5: "range-Doppler heat map", 6: "statistics",
    7: "SNR and noise", 8: "azimuth-elevation heat map", 9: "temperature",
}  # fmt: skip
_FLOATS = np.dtype([(name, "<f4") for name in ("right", "forward", "up", "velocity")])
_FIXED = np.dtype([
    ("range_index", "<u2"), ("doppler_index", "<i2"), ("peak", "<u2"), ("right", "<i2"), ("forward", "<i2"), ("up", "<i2"),
])  # fmt: skip
_SIDE = np.dtype([("snr", "<i2"), ("noise", "<i2")])
_RETURNS = np.dtype([(name, "<f4") for name in ("x", "y", "z", "velocity", "snr")])
_FIXED_RETURNS = np.dtype([(name, "<f4") for name in ("x", "y", "z", "power")])
_SUFFIXES = (".bin", ".dat", ".raw", ".log", "")
_FRAME = "radar"
_LOOK_BYTES, _MAX_BYTES = 1 << 20, 1 << 30
_DEPTH = 5
_SAMPLED_FILES = 4  # of a folder below the one that was named
_COMMANDS = re.compile(rb"mmwDemo:/>|^(?:sensorStart|sensorStop|profileCfg|frameCfg)\b", re.MULTILINE)
_WORD = re.compile(re.escape(MAGIC))
_ADC_NAME = re.compile(r"adc_?data|_raw_\d+$", re.IGNORECASE)
_CYCLES_PER_S = 200e6
_WRAP = 1 << 32
_DEFAULT_PERIOD_S = 0.1
_PERIODS_S = (0.005, 5.0)
_UNSTEADY = 0.2
_MAX_TABLE_BYTES = 1 << 26


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
    data = _content(path, _LOOK_BYTES)
    return any(packet_in(data[found.start() :]) is not None for found in _WORD.finditer(data))


def _content(path: Path, size: int = _MAX_BYTES) -> bytes:
    try:
        if size == _MAX_BYTES < path.stat().st_size:
            raise RecordingError(
                f"{path}: has more than {_MAX_BYTES >> 20} MiB; cut it into parts and open them one by one"
            )
        with path.open("rb") as file:
            return file.read(size)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}; check its permissions") from error


def _is_command_log(path: Path) -> bool:
    head = _content(path, _LOOK_BYTES)
    return head.isascii() and _COMMANDS.search(head) is not None


def _refuse_other_data(path: Path) -> None:
    """Refuse other files of such a radar by their true name.

    Raises:
        RecordingError: it is one.
    """
    if path.suffix.lower() not in _SUFFIXES:
        return
    head = _content(path, _LOOK_BYTES)
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
    stream = b"".join(map(_content, chunks))
    scan = _scan(stream)
    stamped = stamp_packets(path, [packet for _, packet in scan.packets], radar_start, topic_of(path, "radar"))
    times = stamped.times_ns

    def message(row: int) -> bytes:
        place, packet = scan.packets[stamped.rows[row]]
        data = stream[place : place + packet.size]
        return cloud_message(TimeNs(int(times[row])), _FRAME, points_of(packet, data))

    return PlainSource(
        path, len(stream), _container(chunks, scan, stamped.clock), cloud_channel(topic_of(path, "radar")), times, message,
        (*_damage_warnings(path, scan), *stamped.warnings), None, stamped.assumptions,
    )  # fmt: skip


def _container(chunks: Sequence[Path], scan: "_Scan", clock: str) -> str:
    first = scan.packets[0][1]
    skipped = sorted({item.kind for _, packet in scan.packets for item in packet.items} - {1, 7})
    words = [f"TI data port, xWR{first.platform & 0xFFFF:X}, SDK {first.version}"]
    words += [f"{len(chunks)} files"] * (len(chunks) > 1)
    words += [clock, "x right, y forward, z up turned to x forward, y left, z up"]
    words += [f"without {', '.join(map(item_name, skipped))}"] * bool(skipped)
    return ", ".join(words)


def _damage_warnings(path: Path, scan: "_Scan") -> list[DataWarning]:
    steps = np.diff([packet.frame for _, packet in scan.packets])
    missing = int((steps[steps > 1] - 1).sum())
    if not (scan.broken or scan.strange_bytes or missing):
        return []
    return [
        DataWarning.reported(
            "damaged-file",
            f"{path.name}: of {scan.broken + len(scan.packets)} packets, {scan.broken} are damaged or cut off and skipped; "
            f"{scan.strange_bytes} bytes belong to no packet; by their numbers, {missing} frames are missing",
            "no action needed for a few: the port drops bytes; if there are many, check its speed and the cable",
        )
    ]


@dataclass(slots=True)
class _Scan:
    """What a stream holds.

    Attributes:
        packets: position and head of each whole packet.
        broken: number of packets that are damaged or cut off.
        strange_bytes: number of bytes between packets, unless all of them are zero.
    """

    packets: "list[tuple[int, Packet]]" = field(default_factory=list)
    broken: int = 0
    strange_bytes: int = 0


def _scan(stream: bytes) -> _Scan:
    scan, after = _Scan(), 0
    places = [found.start() for found in _WORD.finditer(stream)]
    for place, following in zip(places, [*places[1:], len(stream)], strict=True):
        scan.strange_bytes += _strange(stream[after:place])
        end = min(following, place + MAX_PACKET_BYTES)
        packet = packet_in(stream[place:end])
        if packet is None:
            scan.broken += 1
            after = max(after, end)
        else:
            scan.packets.append((place, packet))
            after = max(after, place + packet.size)
    scan.strange_bytes += _strange(stream[after:])
    return scan


def _strange(between: bytes) -> int:
    return len(between) if between.strip(b"\0") else 0


@dataclass(frozen=True, slots=True)
class Tlv:
    """One item of a packet: its kind, and where its value lies in the packet."""

    kind: int
    start: int
    size: int


@dataclass(frozen=True, slots=True)
class Packet:
    """The head of one packet.

    Attributes:
        version: major version of the SDK.
        size: total number of bytes.
        platform: the chip, such as 0xA1843.
        frame: number of the frame, from 1 since the sensor was started.
        cycles: processor cycles when it was sent, modulo 2 ** 32.
        count: number of detected points.
        items: what it contains.
    """

    version: int
    size: int
    platform: int
    frame: int
    cycles: int
    count: int
    items: tuple[Tlv, ...]


def item_name(kind: int) -> str:
    """Name the kind of an item."""
    return _NAMES.get(kind, f"items of type {kind}")


def packet_in(data: bytes) -> Packet | None:
    """Read the packet that data begins with; None if it is cut off or its items do not fit into it."""
    if len(data) < _HEADER.size or not data.startswith(MAGIC):
        return None
    _, version, size, platform, frame, cycles, count, items = _HEADER.unpack_from(data)
    if not _HEADER.size <= size <= min(len(data), MAX_PACKET_BYTES) or items > _MAX_ITEMS:
        return None
    for header in _HEADER_SIZES:
        for inclusive in (0, _TLV.size):  # some demos count the item's own head
            tlvs = _items(data[:size], header, items, inclusive)
            packet = Packet(version >> 24, size, platform, frame, cycles, count, tlvs or ())
            if tlvs is not None and _fits(packet, data):
                return packet
    return None


def _items(data: bytes, place: int, count: int, inclusive: int) -> tuple[Tlv, ...] | None:
    """Read the chain of items; None if it does not end with the packet, up to padding."""
    found = []
    for _ in range(count):
        if place + _TLV.size > len(data):
            return None
        kind, size = _TLV.unpack_from(data, place)
        size -= inclusive
        if size < 0 or place + _TLV.size + size > len(data):
            return None
        found.append(Tlv(kind, place + _TLV.size, size))
        place += _TLV.size + size
    return tuple(found) if 0 <= len(data) - place < _PAD_BYTES else None


def _fits(packet: Packet, data: bytes) -> bool:
    """Return whether the sizes of the points and of their side information agree with their number."""
    wanted = {_POINTS: packet.count * _FLOATS.itemsize, _SIDE_INFO: packet.count * _SIDE.itemsize}
    for item in packet.items:
        size = wanted.get(item.kind, item.size)
        if item.kind == _POINTS and _fixed_point(packet, item):
            size = 4 + packet.count * _FIXED.itemsize
            if struct.unpack_from("<H", data, item.start)[0] != packet.count:
                return False
        if item.size != size:
            return False
    return packet.count == 0 or any(item.kind == _POINTS for item in packet.items)


def _fixed_point(packet: Packet, item: Tlv) -> bool:
    return packet.version < 3 and item.size >= 4


def points_of(packet: Packet, data: bytes) -> np.ndarray:
    """Return the points of a packet (n,): x forward, y left, z up [m], and what else they have.

    SDK 3 gives the radial speed [m/s] and, if it is sent, the SNR [dB]; older ones give the strength of the peak, and the
    Doppler only as the number of a bin, whose size the stream does not state.
    """
    item = next((item for item in packet.items if item.kind == _POINTS), None)
    if item is None:
        return np.zeros(0, dtype=_FIXED_RETURNS if packet.version < 3 else _RETURNS)
    if _fixed_point(packet, item):
        shift = struct.unpack_from("<H", data, item.start + 2)[0] & 15
        raw = np.frombuffer(data, dtype=_FIXED, count=packet.count, offset=item.start + 4)
        returns = np.zeros(packet.count, dtype=_FIXED_RETURNS)
        returns["power"] = raw["peak"]
        scale = 2.0**-shift
    else:
        raw = np.frombuffer(data, dtype=_FLOATS, count=packet.count, offset=item.start)
        returns = np.zeros(packet.count, dtype=_RETURNS)
        returns["velocity"] = raw["velocity"]
        returns["snr"] = _snr_db(packet, data)
        scale = 1.0
    returns["x"], returns["y"], returns["z"] = raw["forward"] * scale, -raw["right"] * scale, raw["up"] * scale
    return returns


def _snr_db(packet: Packet, data: bytes) -> np.ndarray:
    """Return the SNR of each point [dB]; NaN if it is not sent."""
    item = next((item for item in packet.items if item.kind == _SIDE_INFO), None)
    if item is None:
        return np.full(packet.count, np.nan)
    side = np.frombuffer(data, dtype=_SIDE, count=packet.count, offset=item.start)
    return np.asarray(side["snr"] * 0.1)


@dataclass(frozen=True, slots=True, eq=False)
class StampedPackets:
    """The packets with a time.

    Attributes:
        rows: (n,) which packets they are.
        times_ns: (n,) ascending.
        clock: where the times come from, in words.
        warnings: what the user must know about the times.
        assumptions: what the stream does not state.
    """

    rows: Indices
    times_ns: TimesNs
    clock: str
    warnings: tuple[DataWarning, ...] = ()
    assumptions: tuple[Assumption, ...] = field(default=())


def stamp_packets(path: Path, packets: Sequence[Packet], start: str | None, topic: str) -> StampedPackets:
    """Give each packet a time.

    Args:
        path: the stream; NAME.csv or NAME.txt beside it may list one time per packet.
        packets: in the order sent.
        start: --radar-start: the time of the first frame, and after a comma the time between frames [s].
        topic: of the radar, for the assumptions.

    Raises:
        RecordingError: --radar-start or the list of times is wrong.
    """
    if start is None and (listed := _listed_times(path, len(packets))) is not None:
        order = np.argsort(listed, kind="stable")
        return StampedPackets(order, listed[order], f"times of {_table(path).name}")
    begin_ns, given_s = _start(start)
    frames, restarts = _frame_counts(packets)
    period_s = given_s if given_s is not None else _period_of_cycles(packets, frames)
    seconds = period_s if period_s is not None else _DEFAULT_PERIOD_S
    times = begin_ns + np.round(frames * (seconds * NS_PER_S)).astype(np.int64)
    assumptions = []
    if start is None:
        text = "the stream has no dates; its first frame is read as 1 s after the beginning of 1970"
        assumptions.append(Assumption("time-start", topic, text, "--radar-start TIME"))
    if given_s is None:
        assumptions.append(
            Assumption("time-unit", topic, _period_note(period_s), "--radar-start TIME,SECONDS_PER_FRAME")
        )
    return StampedPackets(
        np.arange(len(packets)),
        times,
        f"{seconds:.4g} s per frame",
        _restart_warnings(path, restarts),
        tuple(assumptions),
    )


def _period_note(period_s: float | None) -> str:
    if period_s is None:
        return f"its processor cycles are not steady; {_DEFAULT_PERIOD_S} s per frame are assumed"
    return (
        f"it counts processor cycles, read as 200 MHz of the Cortex-R4F: {period_s:.4g} s per frame; at the 600 MHz of the DSP, "
        f"which older demos counted, it would be {period_s / 3:.4g} s"
    )


def _restart_warnings(path: Path, restarts: int) -> tuple[DataWarning, ...]:
    if not restarts:
        return ()
    return (
        DataWarning.reported(
            "sensor-restarted",
            f"{path.name}: the frame numbers begin again {restarts} times: the sensor was restarted, and the pause is unknown",
            "open the parts one by one, each with its own --radar-start",
        ),
    )


def _start(start: str | None) -> tuple[int, float | None]:
    """Read --radar-start."""
    if start is None:
        return NS_PER_S, None
    time, _, period = start.partition(",")
    try:
        seconds = float(period) if period else None
        if seconds is not None and not 0 < seconds < 1000:
            raise RecordingError(f"'{period}' is not a time between frames; give seconds, such as 0.05")
        return int(read_time(time)), seconds
    except ValueError as error:
        raise RecordingError(f"--radar-start: '{period}' is not a number of seconds, such as 0.05") from error
    except RecordingError as error:
        raise RecordingError(f"--radar-start: {error}") from error


def _frame_counts(packets: Sequence[Packet]) -> tuple[np.ndarray, int]:
    """Count frames from the first one, and how often the sensor was restarted; a restart counts as one frame."""
    numbers = np.array([packet.frame for packet in packets], dtype=np.int64)
    steps = np.diff(numbers)
    restarted = steps < 0
    counts = np.concatenate([[0], np.cumsum(np.where(restarted, 1, steps))])
    return counts, int(np.count_nonzero(restarted))


def _period_of_cycles(packets: Sequence[Packet], frames: np.ndarray) -> float | None:
    """Measure the time between frames by the processor's cycles, which begin again after 2 ** 32; None if they are not steady."""
    cycles = np.array([packet.cycles for packet in packets], dtype=np.int64)
    steps, passed = np.diff(frames), np.diff(cycles) % _WRAP
    single = passed[steps == 1]
    if not len(single):
        return None
    middle = float(np.median(single))
    if np.median(np.abs(single - middle)) > _UNSTEADY * middle:
        return None
    wraps = np.round((steps * middle - passed) / _WRAP)
    whole = passed + np.maximum(wraps, 0) * _WRAP
    steady = (steps > 0) & (np.abs(whole - steps * middle) < _UNSTEADY * middle * np.maximum(steps, 1))
    if not steady.any():
        return None
    period_s = float(whole[steady].sum() / steps[steady].sum() / _CYCLES_PER_S)
    return period_s if _PERIODS_S[0] <= period_s <= _PERIODS_S[1] else None


def _table(path: Path) -> Path:
    """Return the list of times beside a stream."""
    name = path.name if path.is_dir() else path.stem
    beside = [path.parent / f"{name}{suffix}" for suffix in (".csv", ".txt")]
    return next((table for table in beside if table.is_file()), beside[0])


def _listed_times(path: Path, count: int) -> TimesNs | None:
    """Read one time per packet from a table beside the stream; None if there is none.

    Raises:
        RecordingError: it has another number of lines, or something other than times.
    """
    table = _table(path)
    if not table.is_file() or table.stat().st_size > _MAX_TABLE_BYTES:
        return None
    lines = [line.strip() for line in table.read_text(encoding="utf-8-sig", errors="replace").splitlines()]
    lines = [line for line in lines if line and not re.match(r"[#A-Za-z]", line)]
    if len(lines) != count:
        raise RecordingError(
            f"{table}: {len(lines)} times for the {count} packets of {path.name}; give one line per packet, or --radar-start"
        )
    try:
        return np.array([read_time(re.split(r"[,;\s]+", line)[-1]) for line in lines], dtype=np.int64)
    except RecordingError as error:
        raise RecordingError(f"{table}: {error}") from error
