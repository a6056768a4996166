"""Read ready-made pairs from tables, with the columns, units and separators of radar tables, or from arrays of NumPy."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.arrays import Points2, Points3
from calib_core.association.array_pairs import pairs_from_arrays
from calib_core.camera import Camera
from calib_core.errors import InputError, RecordingError
from calib_core.input_files import is_known_binary, no_text
from calib_core.interchange.hypotheses.plain_values import plain_values
from calib_core.interchange.own.pairs_files import PairsFile
from calib_core.interchange.syntax.content import readings
from calib_core.interchange.syntax.npy_file import is_npy
from calib_core.measurements import NS_PER_S
from calib_core.options import NoiseOptions
from calib_core.recordings.containers.sources import Assumption
from calib_core.recordings.field_words import pixel_axis
from calib_core.recordings.plain_files.source import PlainOptions
from calib_core.recordings.plain_files.tables.opening import radar_columns, times_of
from calib_core.recordings.plain_files.tables.text_tables import TextTable, open_text_table, read_cells, read_rows
from calib_core.recordings.radar.column_guess import split_unit

_EXAMPLE = "id,x_m,y_m,z_m,u_px,v_px"
_UNNAMED: Mapping[int, tuple[str, ...]] = {
    4: ("x_m", "y_m", "u", "v"), 5: ("x_m", "y_m", "z_m", "u", "v"), 6: ("x_m", "y_m", "z_m", "u", "v", "id"),
}  # fmt: skip
"""The columns of tables without a header and of arrays, by their number."""
_ID_NAMES = ("id", "pair", "pair_id", "name")
_NOT_OF_POSITIONS = ("speed-unit", "noise-unit")
_PIXEL_UNITS = ("px", "pix", "pixel", "pixels")


@dataclass(frozen=True, slots=True, eq=False)
class PairTable:
    """A table of pairs.

    Attributes:
        points_radar_m: (n, 3) positions; z is 0 where the table has none, as of a radar without elevation.
        pixels_px: (n, 2).
        ids: (n,).
        times_s: (n,) of the images [s]; None if the table has none.
        assumptions: what the table does not state.
    """

    points_radar_m: Points3
    pixels_px: Points2
    ids: tuple[str, ...]
    times_s: np.ndarray | None = None
    assumptions: tuple[Assumption, ...] = ()

    def pairs(self, camera: Camera, noise: NoiseOptions | None, *, source: str) -> PairsFile:
        """Return the pairs.

        Raises:
            InputError: a number is not finite, a position is at the radar, or ids repeat.
        """
        assumed = tuple(one.text for one in self.assumptions)
        missing = np.flatnonzero(np.isnan(self.points_radar_m).all(axis=1))
        if missing.size:
            where = f"{source}: points_radar_m[{missing[0]}]"
            raise InputError(
                f"{where}: is no position, or at the radar's origin, which cannot be a return; remove the pair"
            )
        try:
            pairs = pairs_from_arrays(
                self.points_radar_m, self.pixels_px, noise=noise, ids=self.ids, times_s=self.times_s
            )
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
        return PairsFile(camera, pairs, assumed=assumed)


def read_pair_table(data: bytes, *, source: str, options: PlainOptions | None = None) -> PairTable:
    """Read a table of pairs: text as of radar tables, or an array (npy), or one or two of them (npz).

    Args:
        data: the file's content.
        source: its name in error messages.
        options: the user's --map and --radar-axes.

    Raises:
        InputError: a column or a number is missing; the message names the line and what to do.
    """
    if is_npy(data) or (data.startswith(b"PK") and b".npy" in data):
        return _of_arrays(plain_values(next(readings(data, source=source)), source=source), source)
    if is_known_binary(data):
        raise InputError(f"{source}: {no_text(data, 'a table of pairs')}")
    try:
        return _of_text(open_text_table(Path(source), data), options or PlainOptions())
    except RecordingError as error:
        raise InputError(f"{error} (a table of pairs: {_EXAMPLE})") from None


def _of_text(table: TextTable, options: PlainOptions) -> PairTable:
    if table.headless:
        if len(table.names) not in _UNNAMED:
            raise RecordingError(f"{table.path}: no header, and {len(table.names)} columns; write one that names them")
        table = replace(table, names=_UNNAMED[len(table.names)])
    pixels = {pixel_axis(_with_pixels(name)): place for place, name in reversed(list(enumerate(table.names)))}
    if not {"u", "v"} <= pixels.keys():
        raise RecordingError(
            f"{table.path}: no columns u_px and v_px of the image; the columns are {', '.join(table.names[:12])}"
        )
    of_radar = tuple("" if place in (pixels["u"], pixels["v"]) else name for place, name in enumerate(table.names))
    columns = radar_columns(replace(table, names=of_radar), options)
    times = times_of(replace(table, names=of_radar), columns, "", options) if columns.times.time else None
    rows = read_rows(table, (*columns.wanted, pixels["u"], pixels["v"]), times)
    if rows.is_cut_off or not len(rows.values):
        raise RecordingError(f"{table.path}: {'its last row is cut off' if rows.is_cut_off else 'has no rows'}")
    values, pixels_px = rows.values[:, :-2], rows.values[:, -2:]
    columns = columns.with_values(table.path, values)
    names = [name.strip("#% ").lower() for name in table.names]
    place = next((names.index(name) for name in _ID_NAMES if name in names), None)
    ids = read_cells(table, place) if place is not None else [""] * len(values)
    return PairTable(
        columns.returns(values).points_radar_m,
        pixels_px,
        tuple(name or f"pair-{number}" for number, name in enumerate(ids, start=1)),
        None if times is None else rows.times_ns / NS_PER_S,
        tuple(one.assumption for one in columns.plan.assumptions if one.assumption.key not in _NOT_OF_POSITIONS),
    )


def _with_pixels(written: str) -> str:
    name, unit = split_unit(written)
    return f"{name}_px" if unit.lower() in _PIXEL_UNITS else name


def _of_arrays(values: Any, source: str) -> PairTable:
    named = {"": values} if isinstance(values, np.ndarray) else {k: v for k, v in values.items() if v is not None}
    arrays = {name: array for name, array in named.items() if array.ndim == 2 and 2 <= array.shape[1] <= 5}
    pixels = [name for name, array in arrays.items() if array.shape[1] == 2]
    pixels = [name for name in pixels if name.lower().startswith(("im", "pix", "uv", "px", "click"))] or pixels
    if len(arrays) == 2 and len(pixels) == 1:
        both = (array for name, array in arrays.items() if name != pixels[0])
        whole = (
            [np.column_stack([next(both), arrays[pixels[0]]])]
            if len({len(one) for one in arrays.values()}) == 1
            else []
        )
    else:
        whole = [array for array in arrays.values() if array.shape[1] >= 4]
    if len(whole) != 1:
        shown = (
            ", ".join(f"{name} {' x '.join(map(str, array.shape))}".strip() for name, array in named.items()) or "none"
        )
        raise InputError(
            f"{source}: no pairs in its arrays ({shown}); save radar positions [m] and pixels together: "
            "numpy.savez('pairs.npz', radar=points, pixels=pixels), n x 3 and n x 2"
        )
    (array,) = whole
    height = array[:, 2:-2] if array.shape[1] == 5 else np.zeros((len(array), 1))
    ids = tuple(f"pair-{number}" for number in range(1, len(array) + 1))
    return PairTable(np.column_stack([array[:, :2], height]), array[:, -2:], ids)
