"""Arrays as NumPy saves them: npy, and npz with several; only arrays of numbers, never pickled objects."""

import math
import re
import struct
from collections.abc import Mapping

import numpy as np

from calib_core.errors import InputError

_MAGIC = b"\x93NUMPY"
_HEADER = re.compile(
    r"\{'descr': '([<>|=](?:f[248]|[iu][1248]|b1))', 'fortran_order': (True|False), 'shape': \(([\d, ]{0,60})\), ?\}\s*"
)


def is_npy(data: bytes) -> bool:
    """Return whether a file's first bytes are those of an npy file."""
    return data.startswith(_MAGIC)


def load_npy(data: bytes, *, source: str) -> np.ndarray:
    """Return the array in an npy file as float64.

    Raises:
        InputError: it is damaged, or contains anything other than numbers, such as pickled objects.
    """
    if len(data) < 12:
        raise InputError(f"{source}: a damaged npy file; save it again with numpy.save")
    wide = data[6] > 1
    (length,) = struct.unpack_from("<I" if wide else "<H", data, 8)
    start = 12 if wide else 10
    match = _HEADER.fullmatch(data[start : start + length].decode("latin-1"))
    if match is None:
        raise InputError(f"{source}: not an array of numbers; save a plain array with numpy.save")
    shape = tuple(int(size) for size in match[3].replace(",", " ").split())
    numbers = np.dtype(match[1])
    body = data[start + length :]
    if math.prod(shape) * numbers.itemsize != len(body):
        raise InputError(f"{source}: a damaged npy file: {len(body):,} bytes for the shape {shape}; save it again")
    flat = np.frombuffer(body, numbers).astype(np.float64)
    return flat.reshape(shape[::-1]).T if match[2] == "True" else flat.reshape(shape)


def load_npz(members: Mapping[str, bytes], *, source: str) -> dict[str, np.ndarray | None]:
    """Return the arrays of an archive by name; None of what is text, such as a frame's name, or objects."""
    arrays = (name for name in members if name.endswith(".npy"))
    return {name.removesuffix(".npy"): _member(members[name], f"{source}: {name}") for name in arrays}


def _member(data: bytes, source: str) -> np.ndarray | None:
    try:
        return load_npy(data, source=source)
    except InputError:
        return None
