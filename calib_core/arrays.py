"""Array types that name their shape, and the one way an array enters a value."""

from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from jaxtyping import Bool, Float64, Int64
else:  # to type checkers jaxtyping's names are Annotated too, and importing it takes half as long as NumPy
    Bool = Float64 = Int64 = Annotated

__all__ = [
    "Flags",
    "Indices",
    "Matrix23",
    "Matrix33",
    "Matrix66",
    "Points2",
    "Points3",
    "TimesNs",
    "Values",
    "Vector2",
    "Vector3",
    "frozen_array",
]

Vector2: TypeAlias = Float64[np.ndarray, "2"]
Vector3: TypeAlias = Float64[np.ndarray, "3"]
Matrix23: TypeAlias = Float64[np.ndarray, "2 3"]
Matrix33: TypeAlias = Float64[np.ndarray, "3 3"]
Matrix66: TypeAlias = Float64[np.ndarray, "6 6"]
Points2: TypeAlias = Float64[np.ndarray, "n 2"]
Points3: TypeAlias = Float64[np.ndarray, "n 3"]
Values: TypeAlias = Float64[np.ndarray, "n"]
Flags: TypeAlias = Bool[np.ndarray, "n"]
TimesNs: TypeAlias = Int64[np.ndarray, "n"]
"""Stamps, nanoseconds since the epoch."""

Indices: TypeAlias = Int64[np.ndarray, "n"]
"""Places in another array: rows, owners, offsets."""


def frozen_array(values: Any, shape: tuple[int | None, ...], *, dtype: Any = np.float64) -> Any:
    """Make values a read-only, contiguous array and check its shape.

    They are copied, unless they are such an array already, or a part of one: nobody can change it.

    Args:
        values: anything NumPy can make an array of.
        shape: the length of each axis; None where any length will do.
        dtype: the element type of the copy.

    Raises:
        ValueError: the shape is another one.
    """
    array = np.array(values, dtype=dtype, order="C", copy=None if _is_frozen(values) else True)
    if array.size == 0 and len(shape) == 2 and array.ndim == 1:
        array = array.reshape(0, shape[1] or 0)
    fits = array.ndim == len(shape) and all(want in (None, have) for want, have in zip(shape, array.shape, strict=True))
    if not fits:
        wanted = " x ".join("n" if length is None else str(length) for length in shape)
        raise ValueError(f"expected an array of {wanted}, got {' x '.join(map(str, array.shape)) or 'a single number'}")
    array.setflags(write=False)
    return array


def _is_frozen(values: Any) -> bool:
    """Tell whether nobody can write to an array: neither through it nor through what it is a part of."""
    array = values
    while isinstance(array, np.ndarray):
        if array.flags.writeable:
            return False
        array = array.base
    return array is None and values is not None
