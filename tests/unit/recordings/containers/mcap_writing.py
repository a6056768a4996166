"""Write MCAP files according to the specification, optionally without parts that other writers omit."""

import struct
import zlib

import lz4.frame

MAGIC = b"\x89MCAP0\r\n"


def text(value: str) -> bytes:
    raw = value.encode()
    return struct.pack("<I", len(raw)) + raw


def record(kind: int, body: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(body)) + body


def declarations(ros, rows, encoding: str, schemas: bool) -> bytes:
    kinds = {topic: message.__msgtype__ for topic, _, message in rows}
    form = "ros1msg" if ros.generation == 1 else "ros2msg"
    declared = b""
    for number, topic in enumerate(sorted(kinds), 1):
        definition = ros.store.generate_msgdef(kinds[topic], ros_version=ros.generation)[0] if schemas else ""
        name = kinds[topic].replace("/msg/", "/") if ros.generation == 1 else kinds[topic]
        declared += record(3, struct.pack("<H", number) + text(name) + text(form) + text(definition))
        channel = struct.pack("<HH", number, number) + text(topic) + text("ros1" if ros.generation == 1 else encoding)
        declared += record(4, channel + struct.pack("<I", 0))
    return declared


def chunk_and_index(body, places, times, compression, start, message_index, checksums):
    """Return a chunk with its message indexes, and the record of it for the summary."""
    packed = lz4.frame.compress(body) if compression == "lz4" else body
    head = struct.pack("<QQQI", min(times), max(times), len(body), zlib.crc32(body) if checksums else 0) + text(
        compression
    )
    chunk = record(6, head + struct.pack("<Q", len(packed)) + packed)
    indexes, offsets = b"", b""
    for number, entries in places.items() if message_index else ():
        offsets += struct.pack("<HQ", number, start + len(chunk) + len(indexes))
        array = b"".join(struct.pack("<QQ", *entry) for entry in entries)
        indexes += record(7, struct.pack("<HI", number, len(array)) + array)
    info = struct.pack("<QQQQI", min(times), max(times), start, len(chunk), len(offsets)) + offsets
    info += struct.pack("<Q", len(indexes)) + text(compression) + struct.pack("<QQ", len(packed), len(body))
    return chunk + indexes, record(8, info)


def mcap(
    ros,
    rows,
    *,
    chunked=True,
    compression="",
    summary=True,
    chunk_index=True,
    message_index=True,
    encoding="cdr",
    repeat_channels=True,
    profile=None,
    schemas=True,
    statistics=None,
    chunk_rows=10**9,
    checksums=False,
) -> bytes:
    """Write an MCAP without the parts that a test omits."""
    topics = sorted({topic for topic, _, _ in rows})
    declared = declarations(ros, rows, encoding, schemas)
    if profile is None:
        profile = "ros1" if ros.generation == 1 else "ros2"
    out, infos = MAGIC + record(1, text(profile) + text("a test")), b""
    for first in range(0, len(rows), chunk_rows):
        places: dict[int, list[tuple[int, int]]] = {}
        body = declared
        for sequence, (topic, at, message) in enumerate(rows[first : first + chunk_rows]):
            number = topics.index(topic) + 1
            places.setdefault(number, []).append((at, len(body)))
            body += record(5, struct.pack("<HIQQ", number, sequence, at, at) + ros.serialise(message))
        if not chunked:
            out += body
            continue
        times = [at for _, at, _ in rows[first : first + chunk_rows]]
        chunk, info = chunk_and_index(body, places, times, compression, len(out), message_index, checksums)
        out, infos = out + chunk, infos + (info if chunk_index else b"")
    out += record(15, bytes(4))
    summary_start = len(out) if summary else 0
    if summary:
        out += (declared if repeat_channels else b"") + infos
        if statistics is not None:
            out += record(11, struct.pack("<QHIIIIQQI", statistics, len(topics), len(topics), 0, 0, 1, 0, 0, 0))
    footer = record(2, struct.pack("<QQI", summary_start, 0, 0))
    if checksums and summary:
        footer = footer[:-4] + struct.pack("<I", zlib.crc32(out[summary_start:] + footer[:-4]))
    return out + footer + MAGIC
