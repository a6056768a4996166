"""Array types named by their shape, and `freeze`, through which every array enters a dataclass."""

from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from jaxtyping import Bool, Float64, Int64
else:  # to type checkers jaxtyping's names are Annotated too, and importing it takes half as long as NumPy
    Bool = Float64 = Int64 = Annotated

Vector2: TypeAlias = Float64[np.ndarray, "2"]
Vector3: TypeAlias = Float64[np.ndarray, "3"]
Matrix22: TypeAlias = Float64[np.ndarray, "2 2"]
Matrix33: TypeAlias = Float64[np.ndarray, "3 3"]
Matrix66: TypeAlias = Float64[np.ndarray, "6 6"]
Points2: TypeAlias = Float64[np.ndarray, "n 2"]
Points3: TypeAlias = Float64[np.ndarray, "n 3"]
Values: TypeAlias = Float64[np.ndarray, "n"]
Grid: TypeAlias = Float64[np.ndarray, "rows columns"]
Counts: TypeAlias = Int64[np.ndarray, "rows columns"]
Flags: TypeAlias = Bool[np.ndarray, "n"]
TimesNs: TypeAlias = Int64[np.ndarray, "n"]
"""Stamps, nanoseconds since the epoch."""

Indices: TypeAlias = Int64[np.ndarray, "n"]
"""Indices into another array: rows, owners, offsets."""


def frozen_array(values: Any, shape: tuple[int | None, ...], *, dtype: Any = np.float64) -> Any:
    """Make values a read-only, contiguous array and check its shape.

    The values are copied unless they already are a read-only array or a view of one.

    Args:
        values: anything NumPy can convert to an array.
        shape: the length of each axis; None for any length.
        dtype: the element type of the copy.

    Raises:
        ValueError: the shape is different.
    """
    array = np.array(values, dtype=dtype, order="C", copy=None if _is_frozen(values) else True)
    if array.size == 0 and len(shape) == 2 and array.ndim == 1:
        array = array.reshape(0, shape[1] or 0)
    if array.shape != shape and not _fits(array.shape, shape):
        wanted = " x ".join("n" if length is None else str(length) for length in shape)
        raise ValueError(f"expected an array of {wanted}, got {' x '.join(map(str, array.shape)) or 'a single number'}")
    array.setflags(write=False)
    return array


def freeze(value: object, dtype: Any = np.float64, /, **shapes: tuple[int | None, ...]) -> None:
    """Make fields of a frozen dataclass read-only arrays of the given shapes, in its `__post_init__`.

    Args:
        value: the dataclass, changed in place.
        dtype: the element type of all of them.
        shapes: by the fields' names, as in `frozen_array`.
    """
    for name, shape in shapes.items():
        object.__setattr__(value, name, frozen_array(getattr(value, name), shape, dtype=dtype))


def _fits(have: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    return len(have) == len(wanted) and all(want in (None, length) for want, length in zip(wanted, have, strict=True))


def _is_frozen(values: Any) -> bool:
    """Return whether an array and every array it is a view of are read-only."""
    array = values
    while isinstance(array, np.ndarray):
        if array.flags.writeable:
            return False
        array = array.base
    return array is None and values is not None
