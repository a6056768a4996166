"""Recordings written piece by piece: the bytes of a finished file as a recorder would have written them, and databases."""

import re
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2

from calib_core.recordings.containers.sources import Source

_INDEX_POSITION = re.compile(rb"index_pos=([\x00-\xff]{8})")


def write_in_chunks(path: Path, ros, rows, container: str, *, per_chunk: int) -> Path:
    """Write rows, closing a chunk after every few of them; return the file."""
    kind, _, compression = container.partition("-")
    if kind == "bag":
        writer = Writer1(path.with_suffix(".bag"))
        if compression:
            writer.set_compression(Writer1.CompressionFormat[compression.upper()])
    else:
        writer = Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP)
        if compression:
            writer.set_compression(CompressionMode.STORAGE, CompressionFormat[compression.upper()])
    with writer:
        connections = {}
        for number, (topic, receive_ns, message) in enumerate(rows):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=ros.store)
            writer.write(connections[topic], receive_ns, ros.serialise(message))
            if number % per_chunk == per_chunk - 1:
                close_chunk(writer)
    return path.with_suffix(".bag") if kind == "bag" else next(path.glob("*.mcap"))


def close_chunk(writer) -> None:
    """Write the chunk that is being filled, as a recorder does when it is large enough."""
    if isinstance(writer, Writer1):
        writer.write_chunk(writer.chunks[-1])
        writer.bio.flush()
    else:
        writer.storage.close_chunk()
        writer.storage.bio.flush()


class Replay:
    """Write the bytes of a finished file again, so that the file grows as it did while it was recorded.

    The header of a bag has no index position until the end.
    """

    def __init__(self, finished: Path, path: Path) -> None:
        self._whole = finished.read_bytes()
        found = _INDEX_POSITION.search(self._whole[:4096]) if finished.suffix == ".bag" else None
        self._first = bytearray(self._whole)
        if found:
            self._first[found.start(1) : found.end(1)] = bytes(8)
        self._file = path.open("wb")
        self.place = 0

    def __len__(self) -> int:
        return len(self._whole)

    def write_up_to(self, place: int) -> None:
        """Append the bytes up to a position."""
        self._file.write(self._first[self.place : place])
        self._file.flush()
        self.place = max(self.place, place)

    def finish(self) -> None:
        """Write the rest and close the file."""
        self.write_up_to(len(self))
        if self._first != self._whole:
            self._file.seek(0)
            self._file.write(self._whole[:4096])
        self._file.close()

    def kill(self) -> None:
        """Stop writing."""
        self._file.close()


class LoggedDatabase:
    """A ROS 2 bag in SQLite with a write-ahead log, as `--storage-preset-profile resilient` writes it."""

    def __init__(self, path: Path, ros) -> None:
        self._ros = ros
        self._database = sqlite3.connect(path)
        self._database.execute("PRAGMA journal_mode=WAL")
        self._database.execute(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
            "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)"
        )
        self._database.execute(
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
            "data BLOB NOT NULL)"
        )
        self._database.commit()
        self._topics: dict[str, int] = {}

    def write(self, rows) -> None:
        """Write rows in one transaction."""
        for topic, receive_ns, message in rows:
            if topic not in self._topics:
                self._topics[topic] = len(self._topics) + 1
                self._database.execute(
                    "INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (self._topics[topic], topic, message.__msgtype__)
                )
            self._database.execute(
                "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)",
                (self._topics[topic], receive_ns, self._ros.serialise(message)),
            )
        self._database.commit()

    def close(self) -> None:
        """Close the database, which merges the log."""
        self._database.close()


def messages_of(sources: tuple[Source, ...]) -> dict[str, list[tuple[int, bytes]]]:
    """Return receive time and bytes of every message, by topic."""
    return {channel.topic: list(_messages(source, channel.id)) for source in sources for channel in source.channels}


def _messages(source: Source, channel: int) -> Iterator[tuple[int, bytes]]:
    index = source.index(channel)
    for receive_ns, chunk, offset in zip(index.receive_ns, index.chunk, index.offset, strict=True):
        yield int(receive_ns), source.read(int(chunk), int(offset))
