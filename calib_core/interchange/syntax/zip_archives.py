"""Zip archives whose bytes depend on their content only, and a reader that lets none grow."""

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping

from calib_core.errors import InputError

__all__ = ["pack", "unpack"]

_EPOCH = (1980, 1, 1, 0, 0, 0)
_MAX_BYTES = 8 * 1024 * 1024
_DAMAGED = (EOFError, LookupError, NotImplementedError, OSError, RuntimeError, ValueError, struct.error, zlib.error)


def pack(members: Mapping[str, bytes]) -> bytes:
    """Return a zip archive of the members in their order, stored, without today's date."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, data in members.items():
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), data)
    return buffer.getvalue()


def unpack(data: bytes, *, source: str) -> dict[str, bytes]:
    """Return the members of a small zip archive.

    Raises:
        InputError: it is broken, or unpacks to more than any calibration holds.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(member.file_size for member in archive.infolist()) > _MAX_BYTES:
                raise InputError(f"{source}: unpacks to more than a calibration holds; is it the right file?")
            return {member.filename: archive.read(member)[:_MAX_BYTES] for member in archive.infolist()}
    except (*_DAMAGED, zipfile.BadZipFile) as error:
        raise InputError(f"{source}: not a whole zip archive ({error}); export it again") from None
