"""Recordings broken in every known way, built from an intact one. Each case takes a Kit and returns the path to open."""

import bz2
import gzip
import re
import shutil
import sqlite3
import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import lz4.frame
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2.storage_mcap import zstd

from tests.unit.recordings.conftest import START_NS, Ros, altered, plain_rows, write_rows
from tests.unit.recordings.containers.mcap_writing import mcap, record

FRAMES = 60
CHUNK_BYTES = 16_000
BOMB_BYTES = 200_000_000
CASES: dict[str, Callable[["Kit"], Path]] = {}


@cache
def _rows(generation: int, jpeg: bytes) -> list[Any]:
    return plain_rows(Ros(generation), jpeg, n=FRAMES)


@cache
def _bomb(compress: Callable[[bytes], bytes]) -> bytes:
    """Return 200 MB of nothing, compressed."""
    return compress(bytes(BOMB_BYTES))


@dataclass(frozen=True)
class Kit:
    """The materials of a case: its own folder, and one image."""

    folder: Path
    jpeg: bytes

    def rows(self, generation: int) -> tuple[Ros, list[Any]]:
        return Ros(generation), _rows(generation, self.jpeg)

    def bag(self, compression: str = "", name: str = "r.bag", extra: tuple[Any, ...] = ()) -> Path:
        """Write a bag of several chunks."""
        ros, rows = self.rows(1)
        path = self.folder / name
        writer = Writer1(path)
        writer.chunk_threshold = CHUNK_BYTES
        if compression:
            writer.set_compression(Writer1.CompressionFormat[compression.upper()])
        with writer:
            connections: dict[str, Any] = {}
            for topic, at, message in [*rows, *extra]:
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=ros.store)
                writer.write(connections[topic], at, ros.serialise(message))
        return path

    def mcap(self, name: str = "r.mcap", generation: int = 2, **shape: Any) -> Path:
        ros, rows = self.rows(generation)
        path = self.folder / name
        path.write_bytes(mcap(ros, rows, **{"chunk_rows": 30, **shape}))
        return path

    def db3(self, name: str = "r") -> Path:
        ros, rows = self.rows(2)
        return write_rows(self.folder / name, ros, rows, "db3")


def case(build: Callable[[Kit], Path]) -> Callable[[Kit], Path]:
    CASES[build.__name__] = build
    return build


def edit(path: Path, change: Callable[[bytearray], Any]) -> Path:
    raw = bytearray(path.read_bytes())
    kept = change(raw)
    path.write_bytes(raw if kept is None else kept)
    return path


def poke(raw: bytearray, place: int, data: bytes) -> None:
    raw[place : place + len(data)] = data


def without_index(raw: bytearray) -> bytes:
    place = raw.index(b"index_pos=") + 10
    end = struct.unpack_from("<Q", raw, place)[0]
    poke(raw, place, bytes(8))
    return bytes(raw[:end])


def chunk_places(raw: bytes | bytearray) -> list[int]:
    """Return the position of the data of each chunk of a bag."""
    places, place = [], raw.find(b"op=\x05")
    while place >= 0:
        start = place - 8
        while True:  # the header begins a few bytes earlier, with its own length
            length = struct.unpack_from("<I", raw, start)[0]
            if 20 < length < 120 and start + 4 + length >= place + 4 and b"size=" in raw[start : start + 4 + length]:
                break
            start -= 1
        places.append(start + 8 + length)
        place = raw.find(b"op=\x05", place + 4)
    return places


# -- ROS 1 bags


@case
def bag_lz4_damaged_and_never_closed(kit: Kit) -> Path:
    kit.bag("lz4")
    edit(kit.folder / "r.bag", lambda raw: poke(raw, chunk_places(raw)[1] + 7, b"\xa5" * 300))
    return edit(kit.folder / "r.bag", without_index)


@case
def bag_with_a_garbled_record(kit: Kit) -> Path:
    def change(raw: bytearray) -> None:
        """Damage the head of an image's record."""
        for found in re.finditer(rb"\x26\x00\x00\x00(?=[\x00-\xff]{0,32}op=\x02)", raw[chunk_places(raw)[2] :]):
            place = chunk_places(raw)[2] + found.start()
            if struct.unpack_from("<I", raw, place + 42)[0] > 1000:
                poke(raw, place + 4, b"\xff" * 20)
                return

    return edit(kit.bag(), change)


@case
def bag_with_a_garbled_record_and_never_closed(kit: Kit) -> Path:
    bag_with_a_garbled_record(kit)
    return edit(kit.folder / "r.bag", without_index)


@case
def bag_with_zeros_over_a_chunk_and_never_closed(kit: Kit) -> Path:
    edit(kit.bag(), lambda raw: poke(raw, chunk_places(raw)[1] - 80, bytes(9000)))
    return edit(kit.folder / "r.bag", without_index)


@case
def bag_chunk_that_declares_three_gigabytes(kit: Kit) -> Path:
    def change(raw: bytearray) -> None:
        start = chunk_places(raw)[1]
        poke(raw, raw.rindex(b"size=", 0, start) + 5, struct.pack("<I", 3 << 30))

    return edit(kit.bag("bz2"), change)


@case
def bag_bomb(kit: Kit) -> Path:
    """A chunk of a few hundred bytes that decompresses to 200 MB."""

    def change(raw: bytearray) -> bytes:
        start = chunk_places(raw)[-1]
        bomb = _bomb(bz2.compress)
        poke(raw, raw.rindex(b"size=", 0, start) + 5, struct.pack("<I", BOMB_BYTES))
        poke(raw, raw.index(b"index_pos=") + 10, bytes(8))
        return bytes(raw[: start - 4]) + struct.pack("<I", len(bomb)) + bomb

    return edit(kit.bag("bz2"), change)


@case
def bag_with_a_bad_md5_elsewhere(kit: Kit) -> Path:
    ros = Ros(1)
    odd = ("/odd", START_NS, ros.new("std_msgs/msg/String", data="hello"))
    return edit(kit.bag(extra=(odd,)), lambda raw: raw.replace(b"992ce8a1687cec8c8bd883ec73ca41d1", b"*" + b"0" * 31))


@case
def bag_with_an_unreadable_definition_elsewhere(kit: Kit) -> Path:
    ros = Ros(1)
    odd = ("/odd", START_NS, ros.new("std_msgs/msg/String", data="hello"))
    return edit(kit.bag(extra=(odd,)), lambda raw: raw.replace(b"string data", b"string $ata"))


@case
def bag_encrypted(kit: Kit) -> Path:
    def change(raw: bytearray) -> bytes:
        length = struct.unpack_from("<I", raw, 13)[0]
        field = b"encryptor=rosbag/AesCbcEncryptor"
        header = bytes(raw[17 : 17 + length]) + struct.pack("<I", len(field)) + field
        return bytes(raw[:13]) + struct.pack("<I", len(header)) + header + bytes(raw[17 + length :])

    return edit(kit.bag(), change)


@case
def bag_packed_with_gzip(kit: Kit) -> Path:
    path = kit.folder / "r.bag.gz"
    path.write_bytes(gzip.compress(kit.bag(name="whole").read_bytes()))
    return path


@case
def bag_packed_with_bzip2(kit: Kit) -> Path:
    path = kit.folder / "r.bag.bz2"
    path.write_bytes(bz2.compress(kit.bag(name="whole").read_bytes()))
    return path


# -- MCAP


@case
def mcap_with_a_garbled_chunk_head_and_without_summary(kit: Kit) -> Path:
    def change(raw: bytearray) -> None:
        place = raw.index(b"\x06", len(raw) // 3)
        while raw[place + 5 : place + 9] != bytes(4) or raw[place + 37 : place + 41] != bytes(4):
            place = raw.index(b"\x06", place + 1)
        poke(raw, place, b"\xff" * 60)

    return edit(kit.mcap(summary=False), change)


@case
def mcap_with_a_garbled_record(kit: Kit) -> Path:
    def change(raw: bytearray) -> None:
        found = re.compile(rb"\x05[\x00-\xff]{2}\x00{6}").search(raw, len(raw) // 2)
        assert found
        poke(raw, found.start(), b"\xff" * 20)

    return edit(kit.mcap(), change)


@case
def mcap_with_a_damaged_summary(kit: Kit) -> Path:
    def change(raw: bytearray) -> None:
        start = struct.unpack_from("<Q", raw, len(raw) - 28)[0]
        poke(raw, start + 1, b"\xff" * 8)

    return edit(kit.mcap(), change)


@case
def mcap_bomb(kit: Kit) -> Path:
    """A chunk of 20 kB that decompresses to 200 MB."""
    bomb = _bomb(zstd.compress)
    head = struct.pack("<QQQI", START_NS, START_NS, BOMB_BYTES, 0) + struct.pack("<I", 4) + b"zstd"
    chunk = record(6, head + struct.pack("<Q", len(bomb)) + bomb)
    return edit(kit.mcap(summary=False), lambda raw: raw.replace(record(15, bytes(4)), chunk + record(15, bytes(4))))


@case
def mcap_packed_with_zstd(kit: Kit) -> Path:
    path = kit.folder / "r.mcap.zstd"
    path.write_bytes(zstd.compress(kit.mcap("whole").read_bytes()))
    return path


@case
def mcap_packed_with_lz4(kit: Kit) -> Path:
    path = kit.folder / "r.mcap.lz4"
    path.write_bytes(lz4.frame.compress(kit.mcap("whole").read_bytes()))
    return path


@case
def packed_bomb(kit: Kit) -> Path:
    """A file of 40 kB that decompresses to half a GB."""
    path = kit.folder / "r.mcap.zstd"
    path.write_bytes(zstd.compress(bytes(1 << 26)) * 8)
    return path


# -- SQLite


@case
def db3_without_metadata(kit: Kit) -> Path:
    return Path(shutil.move(kit.db3(), kit.folder / "alone.db3"))


@case
def db3_with_a_log_left_over(kit: Kit) -> Path:
    path = db3_without_metadata(kit)
    with sqlite3.connect(path) as database:
        rows = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id").fetchall()
        database.execute("DELETE FROM messages")
    database.execute("PRAGMA journal_mode=WAL")
    database.execute("PRAGMA wal_autocheckpoint=0")
    with database:
        database.executemany("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", rows)
    for suffix in ("", "-wal"):
        shutil.copy(f"{path}{suffix}", kit.folder / f"left.db3{suffix}")
    database.close()
    return kit.folder / "left.db3"


def damage_a_page(raw: bytearray) -> None:
    """Overwrite the page with the 91st message: the leaf page (13) that holds its time."""
    time = struct.pack(">q", START_NS + 30 * 100_000_000 + 30_000_000)
    place = raw.index(time)
    while raw[place // 4096 * 4096] != 13:
        place = raw.index(time, place + 1)
    poke(raw, place // 4096 * 4096, b"\xff" * 4096)


@case
def db3_with_damaged_definitions(kit: Kit) -> Path:
    def change(raw: bytearray) -> None:
        poke(raw, raw.index(b"uint32 row_step") // 4096 * 4096, b"\xff" * 4096)

    return edit(db3_without_metadata(kit), change)


@case
def db3_packed_as_a_file(kit: Kit) -> Path:
    path = kit.db3()
    metadata = path.parent / "metadata.yaml"
    Path(f"{path}.zstd").write_bytes(zstd.compress(path.read_bytes()))
    path.unlink()
    metadata.write_text(metadata.read_text().replace(path.name, f"{path.name}.zstd"))
    return path.parent


@case
def db3_with_metadata_that_is_no_yaml(kit: Kit) -> Path:
    path = kit.db3()
    (path.parent / "metadata.yaml").write_text("rosbag2_bagfile_information: [}")
    return path.parent


# -- several files


def split(kit: Kit) -> tuple[Path, list[Path]]:
    """Write a ROS 2 recording of three files."""
    ros, rows = kit.rows(2)
    folder = kit.folder / "split"
    folder.mkdir()
    lines, paths = ["rosbag2_bagfile_information:", "  version: 9", "  relative_file_paths:"], []
    for number in range(3):
        paths.append(folder / f"split_{number}.mcap")
        paths[-1].write_bytes(mcap(ros, rows[60 * number : 60 * number + 60], chunk_rows=30))
        lines.append(f"  - {paths[-1].name}")
    lines += ["  files:", *(f"  - {{path: {path.name}, message_count: 60}}" for path in paths)]
    (folder / "metadata.yaml").write_text("\n".join(lines))
    return folder, paths


@case
def split_with_a_missing_file(kit: Kit) -> Path:
    folder, paths = split(kit)
    paths[1].unlink()
    return folder


@case
def split_with_an_empty_file(kit: Kit) -> Path:
    folder, paths = split(kit)
    paths[2].write_bytes(b"")
    return folder


@case
def split_with_a_cut_file_and_no_metadata(kit: Kit) -> Path:
    folder, paths = split(kit)
    (folder / "metadata.yaml").unlink()
    edit(paths[2], lambda raw: raw[: len(raw) // 2])
    return folder


@case
def file_of_nothing(kit: Kit) -> Path:
    path = kit.folder / "r.bag"
    path.touch()
    return path


@case
def file_of_zeros(kit: Kit) -> Path:
    path = kit.folder / "r.bag"
    path.write_bytes(bytes(5000))
    return path


@case
def sparse_bag_of_100_gigabytes_of_nothing(kit: Kit) -> Path:
    path = edit(kit.bag(), without_index)
    with path.open("r+b") as file:
        file.truncate(100 << 30)
    return path


CASES |= {
    "bag_never_closed": lambda kit: edit(kit.bag(), without_index),
    "bag_active": lambda kit: edit(kit.bag(name="r.bag.active"), without_index),
    "bag_active_in_a_folder": lambda kit: edit(kit.bag(name="r.bag.active"), without_index).parent,
    "bag_lz4_never_closed": lambda kit: edit(kit.bag("lz4"), without_index),
    "bag_bz2_never_closed": lambda kit: edit(kit.bag("bz2"), without_index),
    "bag_cut_in_half": lambda kit: edit(kit.bag(), lambda raw: raw[: len(raw) // 2]),
    "bag_lz4_cut_in_half": lambda kit: edit(kit.bag("lz4"), lambda raw: raw[: len(raw) // 2]),
    "bag_bz2_cut_in_half": lambda kit: edit(kit.bag("bz2"), lambda raw: raw[: len(raw) // 2]),
    "bag_without_its_last_byte": lambda kit: edit(kit.bag(), lambda raw: raw[:-1]),
    "bag_cut_after_its_header": lambda kit: edit(kit.bag(), lambda raw: raw[:4200]),
    "bag_cut_within_its_header": lambda kit: edit(kit.bag(), lambda raw: raw[:40]),
    "bag_lz4_with_a_damaged_chunk": lambda kit: edit(
        kit.bag("lz4"), lambda raw: poke(raw, chunk_places(raw)[1] + 7, b"\xa5" * 300)
    ),
    "bag_bz2_with_a_damaged_chunk": lambda kit: edit(
        kit.bag("bz2"), lambda raw: poke(raw, chunk_places(raw)[1] + 2000, b"\xa5" * 300)
    ),
    "bag_with_a_garbled_chunk_head": lambda kit: edit(
        kit.bag(), lambda raw: poke(raw, chunk_places(raw)[2] - 60, b"\xff" * 60)
    ),
    "bag_with_a_damaged_index_block": lambda kit: edit(
        kit.bag(), lambda raw: poke(raw, raw.index(b"op=\x04") + 40, b"\xff" * 60)
    ),
    "bag_with_an_index_position_past_its_end": lambda kit: edit(
        kit.bag(), lambda raw: poke(raw, raw.index(b"index_pos=") + 10, struct.pack("<Q", 1 << 60))
    ),
    "bag_with_a_wrong_chunk_count": lambda kit: edit(
        kit.bag(), lambda raw: poke(raw, raw.index(b"chunk_count=") + 12, struct.pack("<I", 99))
    ),
    "bag_with_an_unknown_compression": lambda kit: edit(
        kit.bag("bz2"), lambda raw: raw.replace(b"compression=bz2", b"compression=br7")
    ),
    "bag_of_version_1": lambda kit: edit(kit.bag(), lambda raw: raw.replace(b"#ROSBAG V2.0", b"#ROSBAG V1.2")),
    "bag_packed_with_gzip_and_cut": lambda kit: edit(bag_packed_with_gzip(kit), lambda raw: raw[: len(raw) * 2 // 3]),
    "mcap_without_summary": lambda kit: kit.mcap(summary=False),
    "mcap_without_message_index": lambda kit: kit.mcap(message_index=False),
    "mcap_without_chunk_index": lambda kit: kit.mcap(chunk_index=False),
    "mcap_without_repeated_channels": lambda kit: kit.mcap(repeat_channels=False),
    "mcap_without_chunks": lambda kit: kit.mcap(chunked=False),
    "mcap_of_ros1": lambda kit: kit.mcap(generation=1),
    "mcap_of_no_profile": lambda kit: kit.mcap(profile=""),
    "mcap_without_definitions": lambda kit: kit.mcap(schemas=False),
    "mcap_that_counts_more_messages_than_it_has": lambda kit: kit.mcap(statistics=500),
    "mcap_lz4_without_message_index": lambda kit: kit.mcap(compression="lz4", message_index=False),
    "mcap_lz4_without_summary": lambda kit: kit.mcap(compression="lz4", summary=False),
    "mcap_without_chunks_and_summary": lambda kit: kit.mcap(chunked=False, summary=False),
    "mcap_cut_in_half": lambda kit: edit(kit.mcap(), lambda raw: raw[: len(raw) // 2]),
    "mcap_lz4_cut_in_half": lambda kit: edit(kit.mcap(compression="lz4"), lambda raw: raw[: len(raw) // 2]),
    "mcap_without_its_last_byte": lambda kit: edit(kit.mcap(), lambda raw: raw[:-1]),
    "mcap_without_chunks_cut_in_half": lambda kit: edit(
        kit.mcap(chunked=False, summary=False), lambda raw: raw[: len(raw) // 2]
    ),
    "mcap_lz4_with_a_damaged_chunk": lambda kit: edit(
        kit.mcap(compression="lz4"), lambda raw: poke(raw, len(raw) // 2, b"\xa5" * 300)
    ),
    "mcap_lz4_damaged_and_without_summary": lambda kit: edit(
        kit.mcap(compression="lz4", summary=False), lambda raw: poke(raw, len(raw) // 2, b"\xa5" * 300)
    ),
    "mcap_with_a_summary_past_its_end": lambda kit: edit(
        kit.mcap(), lambda raw: poke(raw, len(raw) - 28, struct.pack("<Q", 1 << 62))
    ),
    "db3_cut_in_half": lambda kit: edit(db3_without_metadata(kit), lambda raw: raw[: len(raw) // 2]),
    "db3_without_definitions": lambda kit: altered(db3_without_metadata(kit), "DROP TABLE message_definitions"),
    "db3_with_rows_of_unknown_topics": lambda kit: altered(
        db3_without_metadata(kit), "UPDATE messages SET topic_id = 77 WHERE id % 9 = 0 AND id > 90"
    ),
    "db3_with_times_that_are_words": lambda kit: altered(
        db3_without_metadata(kit), "UPDATE messages SET timestamp = 'noon' WHERE id = 31"
    ),
    "db3_of_something_else": lambda kit: altered(kit.folder / "other.db3", "CREATE TABLE people (name TEXT)"),
    "db3_with_a_damaged_page": lambda kit: edit(db3_without_metadata(kit), damage_a_page),
    "db3_with_a_damaged_page_beside_its_metadata": lambda kit: edit(kit.db3(), damage_a_page).parent,
}
"""What takes one step; the others are functions."""
