"""The sample recording, written again as an MCAP file that grows: chunk by chunk, on demand or at recorded rate.

As a program: python -m tests.growing_recording OUT.mcap RATE CHUNK_S, with stamps of the present time at the beginning. It prints
the number of frames and the time after each chunk.
"""

import struct
import sys
import time
import zlib
from dataclasses import dataclass
from pathlib import Path

import lz4.frame

from calib_core.recordings.containers.opening import open_sources
from calib_core.recordings.containers.sources import Channel

_NS = 1_000_000_000
_SAMPLE = Path(__file__).resolve().parents[1] / "sample_data" / "rooftop"
_MAGIC = b"\x89MCAP0\r\n"
_STAMP = struct.Struct("<II")
_STAMP_PLACE = 4  # after the sequence number of a ROS 1 header


@dataclass(frozen=True, order=True)
class _Message:
    receive_ns: int
    channel: int
    data: bytes


def _record(kind: int, body: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(body)) + body


def _text(value: str) -> bytes:
    raw = value.encode()
    return struct.pack("<I", len(raw)) + raw


class SampleWriter:
    """Writes the messages of the sample in the order of their receive times.

    Args:
        path: of the file to write.
        begin_ns: the first receive time [ns], to which all stamps are moved; None leaves them as they are.
        compression: "" or "lz4".
    """

    def __init__(self, path: Path, *, begin_ns: int | None = None, compression: str = "") -> None:
        self._compression = compression
        self._channels: list[Channel] = []
        self._messages: list[_Message] = []
        for source in open_sources([_SAMPLE / "radar.bag", _SAMPLE / "camera.bag"]):
            for channel in source.channels:
                number = len(self._channels) + 1
                self._channels.append(channel)
                index = source.index(channel.id)
                for receive_ns, chunk, offset in zip(index.receive_ns, index.chunk, index.offset, strict=True):
                    self._messages.append(_Message(int(receive_ns), number, source.read(int(chunk), int(offset))))
            source.close()
        self._messages.sort()
        self.start_ns = self._messages[0].receive_ns
        self._shift_ns = 0 if begin_ns is None else begin_ns - self.start_ns
        self.length_s = (self._messages[-1].receive_ns - self.start_ns) / _NS
        self._written = 0
        self._file = path.open("wb")
        self._file.write(_MAGIC + _record(1, _text("ros1") + _text("tests")))
        self._file.flush()

    def write_until(self, seconds: float) -> None:
        """Write the messages up to a time of the sample as one chunk."""
        end_ns = self.start_ns + round(seconds * _NS)
        records = [] if self._written else [self._declarations()]
        times = []
        while self._written < len(self._messages) and self._messages[self._written].receive_ns <= end_ns:
            message = self._messages[self._written]
            times.append(message.receive_ns + self._shift_ns)
            head = struct.pack("<HIQQ", message.channel, self._written, times[-1], times[-1])
            records.append(_record(5, head + self._shifted(message.data)))
            self._written += 1
        if times:
            body = b"".join(records)
            packed = lz4.frame.compress(body) if self._compression else body
            head = struct.pack("<QQQI", times[0], times[-1], len(body), zlib.crc32(body)) + _text(self._compression)
            self._file.write(_record(6, head + struct.pack("<Q", len(packed)) + packed))
            self._file.flush()

    @property
    def frames(self) -> int:
        """The number of frames written so far."""
        camera = next(n for n, channel in enumerate(self._channels, 1) if channel.type.endswith("Image"))
        return sum(message.channel == camera for message in self._messages[: self._written])

    def finish(self) -> None:
        """Write the rest, and end the file as a recorder does, without a summary."""
        self.write_until(self.length_s + 1)
        self._file.write(_record(15, bytes(4)) + _record(2, struct.pack("<QQI", 0, 0, 0)) + _MAGIC)
        self._file.close()

    def stop(self) -> None:
        """Stop writing, as a recorder does that is killed."""
        self._file.close()

    def _declarations(self) -> bytes:
        body = b""
        for number, channel in enumerate(self._channels, 1):
            schema = _text(channel.type) + _text("ros1msg") + _text(channel.definition)
            body += _record(3, struct.pack("<H", number) + schema)
            body += _record(4, struct.pack("<HH", number, number) + _text(channel.topic) + _text("ros1") + bytes(4))
        return body

    def _shifted(self, data: bytes) -> bytes:
        """Move the stamp in the header of a message."""
        sec, nanosec = _STAMP.unpack_from(data, _STAMP_PLACE)
        moved = divmod(sec * _NS + nanosec + self._shift_ns, _NS)
        return data[:_STAMP_PLACE] + _STAMP.pack(*moved) + data[_STAMP_PLACE + _STAMP.size :]


def main(path: Path, rate: float, chunk_s: float) -> None:
    """Write the sample at a rate relative to the recorded one, in chunks of a length [s of the sample]."""
    writer = SampleWriter(path, begin_ns=time.time_ns())
    began, seconds = time.monotonic(), 0.0
    while seconds < writer.length_s:
        seconds += chunk_s
        time.sleep(max(0.0, began + seconds / rate - time.monotonic()))
        writer.write_until(seconds)
        print(writer.frames, time.time(), flush=True)
    writer.finish()


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]))
