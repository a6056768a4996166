"""Decompress recordings that are compressed as a whole (.db3.zstd, .mcap.zst, .bag.gz), within limits."""

import bz2
import gzip
import shutil
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from calib_core.errors import RecordingError
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.results import DataWarning

_COMMANDS = {"Zstandard": "zstd -d", "gzip": "gunzip", "bzip2": "bunzip2", "LZ4": "lz4 -d"}
_MAGIC = {b"\x28\xb5\x2f\xfd": "Zstandard", b"\x1f\x8b": "gzip", b"BZh": "bzip2", b"\x04\x22\x4d\x18": "LZ4"}
_PIECE_BYTES = 1 << 20
_ALWAYS_BYTES = 1 << 28
_MAX_RATIO = 50


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
    once = DataWarning(
        "packed-file",
        f"{name} is compressed with {kind}: it was decompressed to {size / 1e6:.1f} MB in a temporary folder",
        f"this is repeated every time it is opened; to do it once: {_COMMANDS[kind]} {name}",
    )
    if not fault:
        return [once]
    cut = DataWarning(
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
                piece = packed.read1(_PIECE_BYTES)
            except (OSError, EOFError, RuntimeError, ValueError, zlib.error, _zstd_error()) as error:
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
    return _open_zstd


def _open_zstd(path: Path) -> Any:
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return zstd.open(path)


def _zstd_error() -> type[Exception]:
    if sys.version_info >= (3, 14):
        from compression.zstd import ZstdError
    else:
        from backports.zstd import ZstdError
    return ZstdError
