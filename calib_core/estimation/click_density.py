"""Click density: where the pixels of outliers are to be expected.

Most outliers have a good click and a radar position of something else, so their pixels are spread as those of all clicks are.
In an aisle, where all clicks are close together, an even density would take agreement by chance as evidence.
"""

import numpy as np

from calib_core.arrays import Points2, Values
from calib_core.camera import Camera

_ANYWHERE = 0.3  # share of the outliers whose click is anywhere on the image
_LEAST_WIDTH = 5.0  # standard deviations of a click
_ALL_OTHERS, _SOME_OTHERS = 300, 100  # of more clicks than the first, so many give the density: work grows linearly


def click_density(pixels_px: Points2, sigma_px: Values, camera: Camera) -> Values:
    """Return the density (n,) of the other clicks at each click [1/px^2], smoothed as far as their neighbours are apart.

    Args:
        pixels_px: (n, 2) the clicks.
        sigma_px: (n,) their standard deviations.
        camera: with the size of the image.
    """
    count = len(pixels_px)
    even = np.full(count, 1.0 / (camera.width_px * camera.height_px))
    if count < 2:
        return even
    chosen = np.linspace(0, count - 1, count if count <= _ALL_OTHERS else _SOME_OTHERS).round().astype(np.int64)
    squared = ((pixels_px[:, None] - pixels_px[chosen]) ** 2).sum(axis=2)
    nth = min(max(round(len(chosen) ** 0.5), 1), len(chosen) - 1)
    width2 = np.maximum(np.partition(squared, nth, axis=1)[:, nth], (_LEAST_WIDTH * sigma_px) ** 2)[:, None]
    kernels = np.exp(-0.5 * squared / width2) / (2.0 * np.pi * width2)
    kernels[chosen, np.arange(len(chosen))] = 0.0
    return np.asarray(_ANYWHERE * even + (1.0 - _ANYWHERE) * kernels.sum(axis=1) / max(len(chosen) - 1, 1))
