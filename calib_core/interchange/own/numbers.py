"""Convert numbers for JSON: non-finite values become null, and arrays become nested tuples."""

from typing import Any

import numpy as np


def finite_or_none(value: float) -> float | None:
    """Return a finite number as it is, and None for any other."""
    return float(value) if np.isfinite(value) else None


def nan_if_none(value: float | None) -> float:
    """Return the number in a file, NaN for null."""
    return float("nan") if value is None else value


def nested(array: np.ndarray) -> Any:
    """Return an array as nested tuples; None if any entry is not finite."""
    if not np.isfinite(array).all():
        return None
    return tuple(map(tuple, array.tolist())) if array.ndim == 2 else tuple(array.tolist())
