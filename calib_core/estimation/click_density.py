"""Click density: where the pixels of outliers are to be expected."""

import numpy as np

from calib_core.arrays import Values
from calib_core.estimation.measurement_model import PairMeasurements

__all__ = ["click_density"]

_ANYWHERE = 0.3  # share of the outliers whose click is anywhere on the image
_LEAST_WIDTH = 5.0  # standard deviations of a click


def click_density(measurements: PairMeasurements) -> Values:
    """Return the density (n,) of the other clicks at each click [1/px^2], smoothed as far as their neighbours are apart."""
    pixels_px, count = measurements.pixels_px, len(measurements)
    even = 1.0 / (measurements.camera.width_px * measurements.camera.height_px)
    squared = ((pixels_px[:, None] - pixels_px) ** 2).sum(axis=2)
    nth = min(max(round(count**0.5), 1), count - 1)
    width2 = np.maximum(np.sort(squared, axis=1)[:, nth], (_LEAST_WIDTH * measurements.sigma_px) ** 2)
    kernels = np.exp(-0.5 * squared / width2) / (2.0 * np.pi * width2)
    np.fill_diagonal(kernels, 0.0)
    return np.asarray(_ANYWHERE * even + (1.0 - _ANYWHERE) * kernels.sum(axis=1) / max(count - 1, 1))
