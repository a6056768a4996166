"""Decompress chunks, never to more than their declared size, and whole files (.db3.zstd, .mcap.zst, .bag.gz), within limits."""

import bz2
import gzip
import shutil
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

from calib_core.errors import RecordingError
from calib_core.measurements import DataWarning
from calib_core.recordings.containers.positioned_reads import FileBytes

MAX_CHUNK_BYTES = 1 << 28
"""Recorders write chunks of about 1 MB; a compressed one that declares more than 256 MiB is damaged or malicious."""
_SUSPICIOUS_BYTES = 1 << 25
_SUSPICIOUS_RATIO = 1000
_PIECE_BYTES = 1 << 12
_COMMANDS = {"Zstandard": "zstd -d", "gzip": "gunzip", "bzip2": "bunzip2", "LZ4": "lz4 -d"}
_MAGIC = {b"\x28\xb5\x2f\xfd": "Zstandard", b"\x1f\x8b": "gzip", b"BZh": "bzip2", b"\x04\x22\x4d\x18": "LZ4"}
_COPIED_BYTES = 1 << 20
_ALWAYS_BYTES = 1 << 28
_MAX_RATIO = 50


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
        except _damage() as error:
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
        for index in range(0, len(data), _PIECE_BYTES):
            if unpacker.eof or left <= 0:
                break
            parts.append(unpacker.decompress(data[index : index + _PIECE_BYTES], max_length=left))
            left -= len(parts[-1])
    except _damage():
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
    except _damage() as error:
        raise RecordingError(f"{where}: a zstd message is damaged ({error}); copy the file again") from error
    if not unpacker.eof:
        raise RecordingError(f"{where}: a zstd message is truncated or over 256 MiB; copy the file again")
    return message


def packing_of(head: bytes) -> str | None:
    """Return the compression a file begins with; None if it is not a supported one."""
    return next((name for magic, name in _MAGIC.items() if head.startswith(magic)), None)


def unpacked_file(file: FileBytes, kind: str) -> FileBytes:
    """Decompress a file into a temporary folder, which is removed when the returned file is closed.

    A truncated or damaged file yields the bytes before the damage, with a warning.

    Args:
        file: the compressed file; it is closed.
        kind: the compression, as returned by packing_of.

    Raises:
        RecordingError: nothing can be decompressed, the result is implausibly large, or the disk is full.
    """
    file.close()
    folder = TemporaryDirectory(prefix="cocalib-", ignore_cleanup_errors=True)
    try:
        target = Path(folder.name) / "unpacked"
        size, fault = _copy(file, kind, target)
        if not size:
            raise RecordingError(
                f"{file.path}: the {kind}-compressed file cannot be decompressed ({fault}); copy the file again"
            )
        return FileBytes(
            file.path,
            stored=target,
            folder=folder,
            warnings=(*file.warnings, *_unpacking_warnings(file, kind, size, fault)),
        )
    except BaseException:
        folder.cleanup()
        raise


def _unpacking_warnings(file: FileBytes, kind: str, size: int, fault: str) -> list[DataWarning]:
    name = file.path.name
    once = DataWarning.reported(
        "packed-file",
        f"{name} is compressed with {kind}: it was decompressed to {size / 1e6:.1f} MB in a temporary folder",
        f"this is repeated every time it is opened; to do it once: {_COMMANDS[kind]} {name}",
    )
    if not fault:
        return [once]
    cut = DataWarning.reported(
        "packed-file-damaged",
        f"{name} is damaged or truncated ({fault}): everything after the first {size} decompressed bytes is lost",
        "copy the file again from its source",
    )
    return [once, cut]


def _copy(file: FileBytes, kind: str, target: Path) -> tuple[int, str]:
    """Decompress piece by piece; return the number of bytes written, and the error if it ended early."""
    free = shutil.disk_usage(target.parent).free
    limit = max(_ALWAYS_BYTES, _MAX_RATIO * file.size_bytes)
    size = 0
    with _reader(kind)(file.path) as packed, target.open("wb") as out:
        while True:
            try:
                piece = packed.read1(_COPIED_BYTES)
            except _damage() as error:
                return size, " ".join(str(error).split())
            if not piece:
                return size, ""
            size += len(piece)
            if size > limit:
                raise RecordingError(
                    f"{file.path}: decompresses to over {limit / 2**20:.0f} MiB, more than {_MAX_RATIO} times its size; "
                    f"it is refused as possibly malicious; if you trust it, decompress it yourself: {_COMMANDS[kind]}"
                )
            if size > free // 2:
                raise RecordingError(
                    f"{file.path}: decompressing this {kind} file would fill over half of the free "
                    f"space in {target.parent.parent}; decompress it where there is enough space: {_COMMANDS[kind]}"
                )
            out.write(piece)


def _reader(kind: str) -> Callable[[Path], Any]:
    if kind == "gzip":
        return gzip.open
    if kind == "bzip2":
        return bz2.BZ2File
    if kind == "LZ4":
        from lz4.frame import LZ4FrameFile

        return lambda path: LZ4FrameFile(str(path))
    return zstandard().open


def _unpacker(kind: str, where: str) -> _Unpacker:
    if kind == "bz2":
        return bz2.BZ2Decompressor()
    if kind == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        unpacker: _Unpacker = LZ4FrameDecompressor()
        return unpacker
    if kind == "zstd":
        return zstandard().ZstdDecompressor()
    raise RecordingError(f"{where}: unknown compression '{kind}'; none, bz2, lz4 and zstd are supported")


def zstandard() -> Any:
    """Return the module of Zstandard, which Python has since 3.14."""
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return zstd


def _damage() -> tuple[type[Exception], ...]:
    """Return what the decompressors raise for damaged data."""
    return OSError, EOFError, RuntimeError, ValueError, zlib.error, zstandard().ZstdError
