"""Bins with round edges, for figures against range, azimuth and image position."""

import itertools

import numpy as np

from calib_core.arrays import Values
from calib_core.evaluation.figures import Spread

_MOST_BINS = 6


def edges_of(values: Values) -> Values:
    """Return round edges of at most six bins that hold all finite values; two edges at least, none without values."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return np.zeros(0)
    low, high = float(finite.min()), float(finite.max())
    rough = max(high - low, 1e-6 * max(abs(high), 1.0)) / _MOST_BINS
    unit = 10.0 ** np.floor(np.log10(rough))
    for factor in (1.0, 2.0, 5.0, 10.0, 20.0):
        step = factor * unit
        first, last = np.floor(low / step), max(np.ceil(high / step), np.floor(low / step) + 1)
        if last - first <= _MOST_BINS:
            break
    return np.asarray(np.arange(first, last + 1) * step)


def spreads(values: Values, distances_px: Values) -> tuple[Spread, ...]:
    """Summarize the lengths of residuals in bins of another quantity.

    Args:
        values: (n,) the quantity.
        distances_px: (n,) the lengths; NaN for pairs that are not projected, which count in no bin.
    """
    seen = np.isfinite(distances_px) & np.isfinite(values)
    values, distances_px = values[seen], distances_px[seen]
    edges = edges_of(values)
    rows = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(len(edges) - 2, 0))
    found = []
    for i, (low, high) in enumerate(itertools.pairwise(edges)):
        own = distances_px[rows == i]
        mean_px, median_px = (float(np.mean(own)), float(np.median(own))) if len(own) else (float("nan"), float("nan"))
        found.append(Spread(float(low), float(high), len(own), mean_px, median_px))
    return tuple(found)
