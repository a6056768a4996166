"""Decompress the chunks of a recording, never to more than their declared size."""

import bz2
import sys
from typing import Protocol

from calib_core.errors import RecordingError

MAX_CHUNK_BYTES = 1 << 28
"""Recorders write chunks of about 1 MB; a compressed one that declares more than 256 MiB is damaged or malicious."""

_SUSPICIOUS_BYTES = 1 << 25
_SUSPICIOUS_RATIO = 1000

_PIECE_BYTES = 1 << 12


class _Unpacker(Protocol):
    def decompress(self, data: bytes, max_length: int = -1) -> bytes: ...

    @property
    def eof(self) -> bool: ...

    @property
    def unused_data(self) -> bytes | None: ...


def unpack(data: bytes, kind: str, size: int, *, where: str) -> bytes:
    """Decompress one chunk.

    Args:
        data: the compressed bytes.
        kind: "none", "", "bz2", "lz4" or "zstd".
        size: its declared uncompressed size.
        where: file and position, for the error message.

    Raises:
        RecordingError: unknown compression, damaged bytes, a size other than declared, or more than 256 MiB.
    """
    if kind in ("", "none"):
        return data
    refuse_bomb(len(data), size, where=where)
    parts: list[bytes] = []
    left = size
    while data and left > 0:
        unpacker = _unpacker(kind, where)
        try:
            part = unpacker.decompress(data, max_length=left)
        except (OSError, RuntimeError, ValueError, EOFError, _zstd_error()) as error:
            raise RecordingError(f"{where}: the {kind} data is damaged ({error}); copy the file again") from error
        parts.append(part)
        left -= len(part)
        data = (unpacker.unused_data or b"") if unpacker.eof else b""
    if left:
        raise RecordingError(
            f"{where}: the {kind} data decompresses to {size - left} bytes, but {size} are declared; "
            "the file is damaged: copy it again"
        )
    return parts[0] if len(parts) == 1 else b"".join(parts)


def refuse_bomb(stored: int, size: int, *, where: str) -> None:
    """Refuse a compressed chunk that declares an implausible size, before decompressing it.

    Raises:
        RecordingError: it declares over 256 MiB, or over 32 MiB and a thousand times its size in the file.
    """
    if size > MAX_CHUNK_BYTES:
        raise RecordingError(
            f"{where}: a chunk declares {size / 2**20:.0f} MiB; compressed chunks over {MAX_CHUNK_BYTES >> 20} MiB are "
            "refused as damaged"
        )
    if size > _SUSPICIOUS_BYTES and size > _SUSPICIOUS_RATIO * stored:
        raise RecordingError(
            f"{where}: a chunk of {stored} bytes declares {size / 2**20:.0f} MiB, over a thousand times its size; "
            "it is refused as damaged or malicious"
        )


def unpack_what_is_there(data: bytes, kind: str, size: int) -> bytes:
    """Decompress a chunk that may be truncated or damaged; return the bytes before the damage.

    Args:
        data: the available compressed bytes.
        kind: as for unpack; an unknown kind yields nothing.
        size: its declared uncompressed size.
    """
    if kind in ("", "none"):
        return data
    if kind not in ("bz2", "lz4", "zstd"):
        return b""
    unpacker = _unpacker(kind, "")
    parts: list[bytes] = []
    left = min(size, MAX_CHUNK_BYTES)
    try:
        for place in range(0, len(data), _PIECE_BYTES):
            if unpacker.eof or left <= 0:
                break
            parts.append(unpacker.decompress(data[place : place + _PIECE_BYTES], max_length=left))
            left -= len(parts[-1])
    except (OSError, RuntimeError, ValueError, EOFError, _zstd_error()):
        pass  # keep what was decompressed before the error
    return b"".join(parts)


def unpack_message(data: bytes, *, where: str) -> bytes:
    """Decompress one Zstandard frame, which need not declare its size; refuse more than 256 MiB.

    Raises:
        RecordingError: damaged, or too large.
    """
    unpacker = _unpacker("zstd", where)
    try:
        message = unpacker.decompress(data, max_length=MAX_CHUNK_BYTES)
    except _zstd_error() as error:
        raise RecordingError(f"{where}: a zstd message is damaged ({error}); copy the file again") from error
    if not unpacker.eof:
        raise RecordingError(f"{where}: a zstd message is truncated or over 256 MiB; copy the file again")
    return message


def _unpacker(kind: str, where: str) -> _Unpacker:
    if kind == "bz2":
        return bz2.BZ2Decompressor()
    if kind == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        unpacker: _Unpacker = LZ4FrameDecompressor()
        return unpacker
    if kind == "zstd":
        if sys.version_info >= (3, 14):
            from compression.zstd import ZstdDecompressor
        else:
            from backports.zstd import ZstdDecompressor

        return ZstdDecompressor()
    raise RecordingError(f"{where}: unknown compression '{kind}'; none, bz2, lz4 and zstd are supported")


def _zstd_error() -> type[Exception]:
    if sys.version_info >= (3, 14):
        from compression.zstd import ZstdError
    else:
        from backports.zstd import ZstdError
    return ZstdError
