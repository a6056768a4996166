"""Recordings, compared with rosbags: opening, decoding, seeking, memory. Files are generated here and deleted afterwards."""

import os
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed.rows import Row, Table
from calib_core.recordings import first_image, open_recording
from cocalib.platform.process import keep_freed_memory

__all__ = ["measure_recordings", "write_bag"]

_START_NS = 1_700_000_000 * 10**9
_FRAME_NS = 33_333_333
_SEEKS = 150
_OPENINGS = 5
_FRAMES = 2_000
_DECODINGS = 4
_MEMORY = """
import pathlib, resource, sys
from calib_core.recordings import first_image, open_recording
from cocalib.platform.process import keep_freed_memory
import cv2
keep_freed_memory()
def peak():  # on Linux, ru_maxrss is inherited from the parent process; VmHWM is not
    status = pathlib.Path("/proc/self/status")
    lines = status.read_text().splitlines() if status.exists() else []
    marks = [int(line.split()[1]) for line in lines if line.startswith("VmHWM")]
    return (marks[0] if marks else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1024
before = peak()
with open_recording(sys.argv[1]) as recording:
    recording.image(0)
    opened = peak()
    for window in recording.radar_windows():
        pass
    n = len(recording.image_times)
    for place in range(150):
        recording.image(place * 7919 % n)
        time = recording.image_times[place * 7919 % n]
        recording.radar_scans_around([time], 0.5)
    scrubbed = peak()
    for index in range(min(n, 1500)):
        recording.image_bytes(index)
    print(before, opened, scrubbed, peak())
"""


def measure_recordings(scratch: Path, *, large: bool = False) -> Table:
    """Measure on generated bags.

    Args:
        scratch: folder with enough space for the files.
        large: open a bag of 5 GB and a sparse one of 100 GB as well.
    """
    os.environ["COCALIB_CACHE"] = "off"
    keep_freed_memory()  # as the cocalib command does
    plain = write_bag(scratch / "plain.bag", _FRAMES)
    packed = write_bag(scratch / "packed.bag", 1_000, compression="lz4")
    rows = [
        *_opening(plain, scratch / "cache"),
        *_decoding(write_bag(scratch / "returns.bag", 1, returns=60_000), "RadarScan, one return per message", 15.0),
        *_decoding(write_bag(scratch / "clouds.bag", 1, clouds=4_000), "PointCloud2 of 120 points", 10.0),
        _seeking(plain, "none"),
        _seeking(packed, "lz4"),
        *_memory(plain, plain.stat().st_size),
    ]
    plain.unlink()
    for frames, hole_bytes in ((8 * _FRAMES, 0), (_FRAMES, 50_000_000)) if large else ():
        path = write_bag(scratch / f"{frames}-{hole_bytes}.bag", frames, hole_bytes=hole_bytes)
        rows += [*_opening(path, scratch / path.stem), *_memory(path, path.stat().st_size)]
        path.unlink()
    return Table(
        "Recordings",
        "Bags generated for this run and then deleted: images of 1920 x 1080 and ten radar clouds a second, 0.6 GB or 5 GB; "
        "the one of 100 GB is a mostly empty sparse file. Read by cocalib and by rosbags in turn. Cold: the file's pages are "
        "dropped from the system's cache before each opening; medians. The first image is at the beginning of the file; "
        "the timeline has the stamps of all images and scans, each read from its message. Decoding and seeking are in "
        "processor time. Our seeks and bare decodes of the same bytes alternate.",
        tuple(rows),
    )


# -- files


def write_bag(
    path: Path,
    frames: int,
    *,
    compression: str = "",
    returns: int = 0,
    clouds: int = 0,
    hole_bytes: int = 0,
    size_px: tuple[int, int] = (1920, 1080),
    one_scene: bool = False,
) -> Path:
    """Write a bag with rosbags; with holes, its images are far apart in a sparse file; of one scene, only noise differs."""
    from rosbags.rosbag1 import Writer

    writer = Writer(path)
    if compression:
        writer.set_compression(Writer.CompressionFormat[compression.upper()])
    images = _images(size_px, one_scene=one_scene)
    with writer:
        topics = _connections(writer, returns > 0)
        for time_ns, topic, data in _messages(frames, returns, clouds, images):
            if hole_bytes and topic == "/camera/image/compressed":
                _flush(writer)
                writer.bio.seek(hole_bytes, os.SEEK_CUR)  # readers use the index and never read this part
            writer.write(topics[topic], time_ns, data)
    return path


def _flush(writer: Any) -> None:
    """End the current chunk, so that a new one follows."""
    if writer.chunks[-1].data.tell():
        writer.write_chunk(writer.chunks[-1])


def _connections(writer: Any, returns: bool) -> dict[str, Any]:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    from calib_core.recordings.containers.writing import RADAR_SCAN_DEFINITION, RADAR_SCAN_TYPE

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(RADAR_SCAN_DEFINITION, RADAR_SCAN_TYPE))
    radar = RADAR_SCAN_TYPE if returns else "sensor_msgs/msg/PointCloud2"
    types = {"/camera/image/compressed": "sensor_msgs/msg/CompressedImage", "/radar": radar}
    return {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in types.items()}


def _messages(frames: int, returns: int, clouds: int, images: list[bytes]) -> Iterator[tuple[int, str, bytes]]:
    if returns:
        for number in range(returns):
            at = _START_NS + number * 1_000_000
            yield at, "/radar", _header(at, "radar") + struct.pack("<HfffffHff", number % 12, 3, 1, 0, 3, 0, 1, 0.3, 10)
        yield _START_NS, "/camera/image/compressed", _image(_START_NS, images[0])
        return
    cloud = _cloud_body()
    for number in range(max(frames, clouds)):
        at = _START_NS + number * _FRAME_NS
        if number < frames:
            yield at, "/camera/image/compressed", _image(at, images[number % len(images)])
        if number % 3 == 0 or clouds:
            yield at + 1, "/radar", _header(at, "radar") + cloud


def _header(at: int, frame: str) -> bytes:
    return struct.pack("<IIII", 0, *divmod(at, 10**9), len(frame)) + frame.encode()


def _image(at: int, jpeg: bytes) -> bytes:
    return _header(at, "camera") + struct.pack("<I4sI", 4, b"jpeg", len(jpeg)) + jpeg


def _cloud_body() -> bytes:
    names = ("x", "y", "z", "velocity", "snr")
    fields = b"".join(
        struct.pack("<I", len(n)) + n.encode() + struct.pack("<IBI", 4 * i, 7, 1) for i, n in enumerate(names)
    )
    points = np.random.default_rng(1).uniform(1, 9, (120, 5)).astype("<f4").tobytes()
    head = struct.pack("<III", 1, 120, 5) + fields
    return head + struct.pack("<?III", False, 20, len(points), len(points)) + points + b"\x01"


def _images(size_px: tuple[int, int], *, one_scene: bool) -> list[bytes]:
    import cv2

    rng = np.random.default_rng(2)
    images = []
    small = rng.integers(0, 255, (68, 120, 3), dtype=np.uint8)
    for number in range(4):
        if number and not one_scene:
            small = rng.integers(0, 255, (68, 120, 3), dtype=np.uint8)
        image = cv2.resize(small, size_px, interpolation=cv2.INTER_CUBIC)
        noise = rng.integers(-6, 6, image.shape, dtype=np.int16)
        image = np.clip(image + noise, 0, 255).astype(np.uint8)
        images.append(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 75])[1].tobytes())
    return images


# -- measurements


def _opening(path: Path, cache: Path) -> list[Row]:
    size = f"{path.stat().st_size / 1e9:.1f} GB"
    works = (_first_frame_rosbags, _first_image, _timeline)
    turns = [[_cold(path, work) for work in works] for _ in range(_OPENINGS)]
    peer, first, whole = np.median(turns, axis=0).tolist()
    os.environ["COCALIB_CACHE"] = str(cache)
    _timeline(path)
    again = float(np.median([_cold(path, _timeline) for _ in range(_OPENINGS)]))
    os.environ["COCALIB_CACHE"] = "off"
    return [
        Row(f"{size}, cold: rosbags.AnyReader, to the first image", f"{peer * 1e3:.0f} ms"),
        Row(
            f"{size}, cold: ours, to the first image",
            f"{first * 1e3:.1f} ms",
            f"1/{peer / first:.1f} of rosbags",
            "at most 1/20 of rosbags",
            first * 20.0 <= peer,
        ),
        Row(
            f"{size}, cold: ours, to the whole timeline and its first frame",
            f"{whole * 1e3:.0f} ms",
            f"1/{peer / whole:.1f} of rosbags' first image",
        ),
        Row(
            f"{size}, cold: the same again, with the index kept",
            f"{again * 1e3:.1f} ms",
            f"1/{peer / again:.1f} of rosbags' first image",
        ),
    ]


def _cold(path: Path, work: Callable[[Path], None]) -> float:
    with path.open("rb") as file:
        os.fsync(file.fileno())
        if hasattr(os, "posix_fadvise"):
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    start = time.perf_counter()
    work(path)
    return time.perf_counter() - start


def _first_image(path: Path) -> None:
    assert first_image([path]) is not None


def _timeline(path: Path) -> None:
    with open_recording(path) as recording:
        recording.image_bytes(0)


def _first_frame_rosbags(path: Path) -> None:
    from rosbags.highlevel import AnyReader

    with AnyReader([path]) as reader:
        wanted = [connection for connection in reader.connections if "image" in connection.topic]
        next(iter(reader.messages(connections=wanted)))


def _decoding(path: Path, what: str, aim: float) -> list[Row]:
    turns = [(_decode_rosbags(path), _decode(path)) for _ in range(_DECODINGS)]
    peer, ours = np.min(turns, axis=0).tolist()
    path.unlink()
    return [
        Row(f"{what}: rosbags, deserialised", f"{peer * 1e6:.1f} us a message"),
        Row(
            f"{what}: ours, to arrays",
            f"{ours * 1e6:.2f} us a message",
            f"{peer / ours:.1f} x as fast",
            f"at least {aim:.0f} x",
            peer >= aim * ours,
        ),
    ]


def _decode(path: Path) -> float:
    """Return seconds per message when reading all radar windows, as placement detection does."""
    with open_recording(path) as recording:
        start = time.process_time()
        scans = sum(len(window) for window in recording.radar_windows())
        seconds = time.process_time() - start
        assert scans == len(recording.radar_times)
        return seconds / next(topic.count for topic in recording.topics if topic.name == "/radar")


def _decode_rosbags(path: Path) -> float:
    from rosbags.highlevel import AnyReader

    count = 0
    with AnyReader([path]) as reader:
        wanted = [connection for connection in reader.connections if connection.topic == "/radar"]
        start = time.process_time()
        for connection, _, data in reader.messages(connections=wanted):
            reader.deserialize(data, connection.msgtype)
            count += 1
        return (time.process_time() - start) / count


def _seeking(path: Path, compression: str) -> Row:
    import cv2

    with path.open("rb") as file:  # reads the file into the system's cache
        while file.read(1 << 24):
            pass
    bare_s, ours_s = [], []
    with open_recording(path) as recording:
        n = len(recording.image_times)
        order = np.random.default_rng(3).integers(0, n, _SEEKS).tolist()
        for index in order:
            start = time.process_time()
            recording.image(index)
            ours_s.append(time.process_time() - start)
            data = np.frombuffer(recording.image_bytes(index).data, dtype=np.uint8)
            start = time.process_time()
            cv2.imdecode(data, cv2.IMREAD_COLOR)
            bare_s.append(time.process_time() - start)
    ratio = float(np.median(ours_s) / np.median(bare_s))
    return Row(
        f"random seek and decode, 1080p JPEG, compression {compression}",
        f"{np.median(ours_s) * 1e3:.2f} ms",
        f"{ratio:.2f} x the bare decode",
        "at most 1.1 x",
        ratio <= 1.1,
    )


def _memory(path: Path, size_bytes: int) -> list[Row]:
    answer = subprocess.run([sys.executable, "-c", _MEMORY, str(path)], check=True, capture_output=True, text=True)
    before, opened, scrubbed, played = map(float, answer.stdout.split())
    return [
        Row(
            f"peak memory, {size_bytes / 1e9:.1f} GB: opened, scrubbed, played",
            f"{opened:.0f}, {scrubbed:.0f}, {played:.0f} MB ({before:.0f} MB of it imports)",
            "",
            "under 300 MB",
            played < 300,
        )
    ]


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        for row in measure_recordings(Path(folder), large="--large" in sys.argv).rows:
            print(" | ".join((row.what, row.figure, row.ratio, row.aim, "met" if row.met else "MISSED")))
