"""NumPy's npz of plain arrays, without pickle."""

import io

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.format import Reads
from calib_core.interchange.formats.arrays.named_arrays import from_arrays
from calib_core.interchange.imported import ImportedCalibration
from calib_core.interchange.syntax.content import Content


def _recognizes(content: Content) -> bool:
    return content.syntax == "archive"


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read an npz that contains camera_from_radar, or R and t.

    Raises:
        InputError: it contains neither, or Python objects.
    """
    arrays: dict[str, np.ndarray] = {}
    for name, data in content.members.items():
        try:
            arrays[name.removesuffix(".npy")] = np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
        except (ValueError, EOFError) as error:
            raise InputError(f"{source}: {name}: {error}; save plain arrays") from None
    return from_arrays(arrays, "numpy", source=source)


NUMPY = Reads(_recognizes, _read)
