"""Write the bytes that the data port of a TI radar sends, from known scans."""

import struct

import numpy as np

MAGIC = bytes([2, 1, 4, 3, 6, 5, 8, 7])
CYCLES_PER_S = 200e6


def item(kind: int, value: bytes, *, inclusive: bool = False) -> bytes:
    return struct.pack("<II", kind, len(value) + 8 * inclusive) + value


def packet(
    number: int,
    items: list[bytes],
    count: int,
    *,
    seconds: float = 0.0,
    version: int = 0x03060002,
    subframe: bool = True,
    platform: int = 0xA1843,
) -> bytes:
    """Return one packet, padded to a multiple of 32 bytes."""
    body = b"".join(items)
    size = 36 + 4 * subframe + len(body)
    size += -size % 32
    cycles = (123_456 + round(seconds * CYCLES_PER_S)) % 2**32
    head = MAGIC + struct.pack("<7I", version, size, platform, number, cycles, count, len(items))
    return (head + struct.pack("<I", 0) * subframe + body).ljust(size, b"\x0f")


def scan_items(points: np.ndarray, snr_db: np.ndarray | None) -> list[bytes]:
    """Return the items of a scan of SDK 3; points (n, 4): x forward, y left, z up [m], speed [m/s]."""
    forward, left, up, speed = points.T
    found = [item(1, np.stack([-left, forward, up, speed], axis=1).astype("<f4").tobytes())]
    if snr_db is not None:
        side = np.stack([np.round(snr_db * 10), np.full(len(points), 300)], axis=1)
        found.append(item(7, side.astype("<i2").tobytes()))
    return [*found, item(6, bytes(24))]


def fixed_items(points: np.ndarray, peaks: np.ndarray, shift: int = 9) -> list[bytes]:
    """Return the items of a scan of SDK 1 and 2, in fixed point."""
    rows = np.zeros((len(points), 6), dtype="<i2")
    rows[:, 2] = peaks
    rows[:, 3], rows[:, 4], rows[:, 5] = np.round(
        np.stack([-points[:, 1], points[:, 0], points[:, 2]]) * 2**shift
    ).astype(int)
    return [item(1, struct.pack("<HH", len(points), shift) + rows.tobytes()), item(2, bytes(512))]


def scans(count: int, rng: np.random.Generator) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return points (n, 4) and SNR (n,) [dB] of some scans."""
    made = []
    for _ in range(count):
        size = int(rng.integers(1, 9))
        points = rng.uniform([1, -4, -1, -3], [20, 4, 2, 3], (size, 4)).astype(np.float32).astype(np.float64)
        made.append((points, np.round(rng.uniform(8, 30, size), 1)))
    return made


def stream(found: list[tuple[np.ndarray, np.ndarray]], *, period_s: float = 0.05, first: int = 1) -> bytes:
    """Return the stream of scans of SDK 3."""
    return b"".join(
        packet(first + number, scan_items(points, snr_db), len(points), seconds=(first + number) * period_s)
        for number, (points, snr_db) in enumerate(found)
    )
