"""Damaged recordings made systematically from small sound ones, with the messages that brute force still finds in each.

`python -m tests.unit.recordings.containers.damage COUNT SEED` opens COUNT files per container and prints how many lost
messages silently.
"""

import contextlib
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Reader as Reader2

from calib_core.errors import RecordingError
from calib_core.recordings.containers.opening import open_sources
from calib_core.recordings.topics import join_topics, read_stamps
from tests.unit.recordings.conftest import START_NS, Ros, some_points, write_rows
from tests.unit.recordings.containers.mcap_writing import mcap

KINDS = (
    "bag", "bag-lz4", "bag-bz2", "mcap", "mcap-lz4", "mcap-checksums", "mcap-lz4-checksums", "mcap-no-summary",
    "mcap-statistics", "db3",
)  # fmt: skip
_MESSAGES = 30
_CHUNK_BYTES = 3000


@dataclass(frozen=True)
class Sound:
    """A sound recording.

    Attributes:
        kind: its container.
        data: its bytes.
        messages: the bytes of each message, all different, with its receive time.
        pieces: for each message, bytes of the file that must be whole for it to be readable.
    """

    kind: str
    data: bytes
    messages: dict[bytes, int]
    pieces: dict[bytes, bytes]

    def readable(self, damaged: bytes) -> set[bytes]:
        """Return the messages whose bytes, with their record's head, are all in the damaged file."""
        there: dict[bytes, bool] = {}
        for piece in set(self.pieces.values()):
            there[piece] = piece in damaged
        return {message for message, piece in self.pieces.items() if there[piece]}


def sound(kind: str, folder: Path) -> Sound:
    """Write a recording of radar clouds and images."""
    container, _, shape = kind.partition("-")
    ros = Ros(1 if container == "bag" else 2)
    rows = [
        (("/radar/points", "/rear/points")[number % 2], START_NS + number * 50_000_000, ros.cloud(
            START_NS + number * 50_000_000, some_points(3 + number % 4, number)))
        for number in range(_MESSAGES)
    ]  # fmt: skip
    messages = {ros.serialise(message): at for _, at, message in rows}
    path = folder / f"sound-{shape}.{container}"
    if container == "bag":
        writer = Writer1(path)
        writer.chunk_threshold = _CHUNK_BYTES
        if shape:
            writer.set_compression(Writer1.CompressionFormat[shape.upper()])
        with writer:
            connections = {
                name: writer.add_connection(name, rows[0][2].__msgtype__, typestore=ros.store)
                for name in ("/radar/points", "/rear/points")
            }
            for topic, at, message in rows:
                writer.write(connections[topic], at, ros.serialise(message))
    elif container == "mcap":
        path.write_bytes(
            mcap(
                ros, rows, chunk_rows=8, compression="lz4" if "lz4" in shape else "", checksums="checksums" in shape,
                summary=shape != "no-summary", statistics=len(rows) if shape == "statistics" else None,
            )
        )  # fmt: skip
    else:
        path = write_rows(folder / "sound", ros, rows, "db3")
    data = path.read_bytes()
    return Sound(kind, data, messages, {message: _piece(kind, data, message) for message in messages})


def _piece(kind: str, data: bytes, message: bytes) -> bytes:
    """Return the part of the file that holds a message: its record, or the compressed chunk around it."""
    place = data.find(message)
    if place < 0:
        return _chunk_with(kind, data, message)
    lead = {"bag": 46, "mcap": 31}.get(kind.partition("-")[0], 0)
    return data[place - lead : place + len(message)]


def _chunk_with(kind: str, data: bytes, message: bytes) -> bytes:
    for chunk, content in chunks(kind, data):
        if message in content:
            return chunk
    raise AssertionError(kind)


def chunks(kind: str, data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield each chunk record of an intact file with its uncompressed content."""
    import bz2

    import lz4.frame

    for begin, end in records(kind, data):
        record = data[begin:end]
        if kind.startswith("mcap") and record[0] == 6:
            length = int.from_bytes(record[9 + 28 : 9 + 32], "little")
            body = record[9 + 40 + length :]
            yield record, lz4.frame.decompress(body) if length else body
        if kind.startswith("bag") and b"op=\x05" in record[:100]:
            body = record[8 + int.from_bytes(record[:4], "little") :]
            packed = (
                "lz4" if b"compression=lz4" in record[:100] else "bz2" if b"compression=bz2" in record[:100] else ""
            )
            yield record, {"lz4": lz4.frame.decompress, "bz2": bz2.decompress, "": bytes}[packed](body)


def records(kind: str, data: bytes) -> list[tuple[int, int]]:
    """Return begin and end of each record outside chunks of an intact file; of a database, its pages."""
    if kind == "db3":
        return [(place, place + 4096) for place in range(0, len(data), 4096)]
    found, place = [], 13 if kind.startswith("bag") else 8
    end = len(data) if kind.startswith("bag") else len(data) - 8
    while place < end:
        if kind.startswith("bag"):
            head = int.from_bytes(data[place : place + 4], "little")
            after = place + 8 + head + int.from_bytes(data[place + 4 + head : place + 8 + head], "little")
        else:
            after = place + 9 + int.from_bytes(data[place + 1 : place + 9], "little")
        found.append((place, after))
        place = after
    return found


def damaged(file: Sound, rng: random.Random, count: int) -> Iterator[tuple[str, bytes]]:
    """Yield names and bytes of damaged copies: each record cut and changed, then random damage, count in all."""
    made = 0
    places = records(file.kind, file.data)
    ways = (*_AT_RECORDS, *_ANYWHERE)
    while made < count:
        way = ways[made % len(ways)] if made < 4 * len(ways) else rng.choice(ways)
        data = way(file.data, places, rng)
        if data != file.data:
            yield way.__name__, data
        made += 1


Way = Callable[[bytes, list[tuple[int, int]], random.Random], bytes]


def cut_at_a_record(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    return data[: rng.choice(places)[0]]


def cut_inside_a_record(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    begin, end = rng.choice(places)
    return data[: rng.randrange(begin, end)]


def flip_in_a_head(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    begin, end = rng.choice(places)
    place = rng.randrange(begin, min(end, begin + 80))
    return data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]


def flip_anywhere(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    place = rng.randrange(len(data))
    return data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]


def flip_in_the_tail(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    place = rng.randrange(max(0, len(data) - 3000), len(data))
    return data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]


def drop_a_record(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    begin, end = rng.choice(places)
    return data[:begin] + data[end:]


def empty_a_record(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    begin, end = rng.choice(places)
    return data[:begin] + bytes(end - begin) + data[end:]


def repeat_a_record(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    begin, end = rng.choice(places)
    return data[:end] + data[begin:]


def append_a_record(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    begin, end = rng.choice(places)
    return data + data[begin:end]


def swap_records(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    number = rng.randrange(len(places) - 1)
    (a, b), (_, c) = places[number], places[number + 1]
    return data[:a] + data[b:c] + data[a:b] + data[c:]


def zero_a_range(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    place, size = rng.randrange(len(data)), rng.choice((4, 60, 900, 5000))
    return data[:place] + bytes(min(size, len(data) - place)) + data[place + size :]


def overwrite_a_range(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    place, size = rng.randrange(len(data)), rng.choice((4, 60, 900))
    return data[:place] + rng.randbytes(min(size, len(data) - place)) + data[place + size :]


def remove_a_range(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    place, size = rng.randrange(len(data)), rng.choice((1, 4, 300, 4096))
    return data[:place] + data[place + size :]


def change_a_length(data: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    begin, end = rng.choice(places)
    place = begin + rng.choice((0, 1, 4, 8, 12, 20, 40))
    value = rng.choice(
        (b"\0\0\0\0", b"\1\0\0\0", b"\xff\xff\xff\xff", b"\0\1\0\0", (end - begin).to_bytes(4, "little"))
    )
    return data[:place] + value + data[place + 4 :]


_AT_RECORDS: tuple[Way, ...] = (
    cut_at_a_record, cut_inside_a_record, flip_in_a_head, drop_a_record, empty_a_record, repeat_a_record, append_a_record,
    swap_records, change_a_length,
)  # fmt: skip
_ANYWHERE: tuple[Way, ...] = (
    flip_anywhere,
    flip_in_the_tail,
    zero_a_range,
    overwrite_a_range,
    remove_a_range,
)


def read_by_us(path: Path) -> tuple[set[bytes], list[str]]:
    """Return all messages that opening gives, and everything that is told: warnings, unreadable messages, the error."""
    try:
        sources = open_sources([path])
    except RecordingError as error:
        return set(), [str(error)]
    found: set[bytes] = set()
    told: list[str] = []
    try:
        topics, repeated = join_topics(sources)
        told.extend(warning.facts["message"] for warning in repeated)
        used = [topic for topic in topics if len(topic)]
        for both in read_stamps([(topic, 12) for topic in used]) if used else ():
            told.extend([both.fault] * bool(both.lost))
            for row in range(len(both.topic)):
                try:
                    found.add(both.topic.payload(row))
                except RecordingError as error:
                    told.append(str(error))
        for source in sources:
            told.extend(warning.facts["message"] for warning in (*source.warnings, *source.later_warnings))
    except RecordingError as error:
        told.append(str(error))
    finally:
        for source in sources:
            source.close()
    return found, told


def read_by_rosbags(path: Path) -> set[bytes]:
    """Return all messages that rosbags reads; none if it refuses the file."""
    found: set[bytes] = set()
    reader: Any = Reader1(path) if path.suffix == ".bag" else Reader2(path)
    with contextlib.suppress(Exception), reader:  # whatever damage makes it raise
        for _, _, data in reader.messages():
            found.add(bytes(data))
    return found


@dataclass(frozen=True)
class Outcome:
    """What opening one damaged file gives.

    Attributes:
        way: how it was damaged.
        lost: number of messages that are readable, by brute force or by rosbags, but are not given.
        told: what is told about the file.
    """

    way: str
    lost: int
    told: list[str]

    @property
    def silent(self) -> bool:
        """Return whether messages are lost and nothing is told."""
        return bool(self.lost) and not self.told


def outcomes(kind: str, folder: Path, rng: random.Random, count: int) -> Iterator[Outcome]:
    """Open damaged copies of one sound recording."""
    file = sound(kind, folder)
    path = folder / f"damaged.{kind.partition('-')[0]}"
    for way, data in damaged(file, rng, count):
        path.write_bytes(data)
        found, told = read_by_us(path)
        readable = file.readable(data) | read_by_rosbags(path) & file.messages.keys()
        yield Outcome(way, len(readable - found), told)


def main() -> int:
    """Count the files that lose messages silently."""
    count, seed = int(sys.argv[1]), sys.argv[2]
    tried = incomplete = silent = 0
    for kind in KINDS:
        with tempfile.TemporaryDirectory() as folder:
            found = list(outcomes(kind, Path(folder), random.Random(kind + seed), count))
        ways = Counter(one.way for one in found if one.silent)
        tried += len(found)
        incomplete += sum(one.lost > 0 for one in found)
        silent += ways.total()
        print(f"{kind:<20} {len(found)} files, {ways.total()} lose messages silently {dict(ways) or ''}".rstrip())
    print(f"{tried} files, {incomplete} of them not read in full, {silent} with messages silently lost")
    return int(silent > 0)


if __name__ == "__main__":
    sys.exit(main())
