"""Write zip archives whose bytes depend only on their content, and read them with a size limit."""

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping

import numpy as np

from calib_core.errors import InputError
from calib_core.file_tag import TAG

_EPOCH = (1980, 1, 1, 0, 0, 0)
_MAX_BYTES = 8 * 1024 * 1024
_DAMAGED = (EOFError, LookupError, NotImplementedError, OSError, RuntimeError, ValueError, struct.error, zlib.error)


def pack(members: Mapping[str, bytes]) -> bytes:
    """Return a zip archive of the members in their order, uncompressed, without today's date."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, data in members.items():
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), data)
        archive.comment = TAG.encode()
    return buffer.getvalue()


def pack_arrays(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return NumPy's archive (npz) of plain arrays; numpy.load reads it with allow_pickle=False."""
    members = {}
    for name, array in arrays.items():
        buffer = io.BytesIO()
        np.lib.format.write_array(buffer, np.asarray(array), allow_pickle=False)
        members[f"{name}.npy"] = buffer.getvalue()
    return pack(members)


def unpack(data: bytes, *, source: str) -> dict[str, bytes]:
    """Return the members of a small zip archive.

    Raises:
        InputError: it is damaged, or unpacks to more data than any calibration contains.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(member.file_size for member in archive.infolist()) > _MAX_BYTES:
                raise InputError(f"{source}: unpacks to more data than a calibration contains; is it the right file?")
            return {member.filename: archive.read(member)[:_MAX_BYTES] for member in archive.infolist()}
    except (*_DAMAGED, zipfile.BadZipFile) as error:
        raise InputError(f"{source}: a damaged zip archive ({error}); export it again") from None
