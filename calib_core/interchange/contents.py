"""The content of an exported file as readable text: binary files are unpacked and their arrays printed."""

import io
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from calib_core.interchange.exporting import Export
from calib_core.interchange.syntax.mat_file import load_mat
from calib_core.interchange.syntax.zip_archives import unpack

_MAT_TEXT_BYTES = 116


def contents_text(written: Export) -> str:
    """Return a text file unchanged, and a binary file as text, one member after the other."""
    content = written.content
    if isinstance(content, str):
        return content
    if content.startswith(b"PK"):
        members = unpack(content, source=written.file_name)
        return "\n".join(_member(name, data) for name, data in members.items())
    if content.startswith(b"MATLAB"):
        comment = content[:_MAT_TEXT_BYTES].decode("ascii", errors="replace").rstrip("\0 ")
        return "\n".join([comment, "", *_variables(load_mat(content, source=written.file_name))]) + "\n"
    return f"binary, {len(content):,} bytes\n"  # a format of an installed package, with an unknown layout


def _member(name: str, data: bytes) -> str:
    if name.endswith(".npz"):
        inside = unpack(data, source=name)
        return f"[{name}]\n" + "\n".join(_member(inner, array) for inner, array in inside.items())
    if not name.endswith(".npy"):
        return f"[{name}]\n{data.decode('utf-8', errors='replace')}"
    array = np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
    return "\n".join(_variables({name.removesuffix(".npy"): array})) + "\n"


def _variables(values: Mapping[str, Any], owner: str = "") -> Iterator[str]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _variables(value, f"{owner}{key}.")
            continue
        array = np.asarray(value)
        if array.dtype.kind in "US":
            lines = [line for text in array.ravel().tolist() for line in str(text).splitlines()]
            yield from [f"{owner}{key} = {lines[0]!r}"] if len(lines) == 1 else [f"{owner}{key}", *_indented(lines)]
            continue
        yield f"{owner}{key}  {array.dtype}  {' x '.join(map(str, array.shape)) or 'scalar'}"
        yield from (f"    {row}" for row in _rows(array))


def _indented(lines: list[str]) -> list[str]:
    return [f"    {line}" for line in lines]


def _rows(array: np.ndarray) -> list[str]:
    """Format an array row by row, each number with six significant digits."""
    rows = np.atleast_2d(array)
    return ["".join(f"{value:>13.6g}" for value in row.ravel().tolist()) for row in rows]
