"""Corners to a fraction of a pixel: the window around each follows the distance to its neighbours.

Where four squares meet, the brightness has a saddle point. A first estimate is where the gradients point along the lines
through it (OpenCV's cornerSubPix); then the saddle point of a quadratic that is fitted to the smoothed picture, which uses all
of the light around the corner instead of the edges alone.
"""

import numpy as np

from calib_core.arrays import Points2, Values

_WINDOW_SHARE = 0.22  # half the window over the distance to the nearest neighbour
_SMALLEST_PX, _LARGEST_PX = 2, 9
_STEPS, _ENOUGH_PX = 40, 1e-3
_SMOOTHING_PX = 1.2
_SADDLE_SHARE, _SMALLEST_SADDLE_PX, _LARGEST_SADDLE_PX = 0.3, 3.0, 6.0
_SADDLE_SAMPLES = 13
_CORNERS_FOR_SQUARES, _CORNERS_FOR_SLOPE = 16, 6
_SADDLE_ROUNDS, _LARGEST_STEP_PX = 4, 1.0


def refined_corners(grey: np.ndarray, corners_px: Points2, spacing_px: Values) -> Points2:
    """Move each corner (n, 2) to where four squares meet.

    A window that reaches the next corner is pulled towards it; a small one collects little light, and much noise.

    Args:
        grey: uint8 (h, w).
        corners_px: roughly.
        spacing_px: (n,) distance to the nearest other corner.
    """
    import cv2

    half = np.clip(np.floor(_WINDOW_SHARE * np.asarray(spacing_px)), _SMALLEST_PX, _LARGEST_PX).astype(int)
    refined = np.array(corners_px, dtype=np.float64)
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, _STEPS, _ENOUGH_PX)
    for size in np.unique(half).tolist():
        chosen = half == size
        start = np.ascontiguousarray(refined[chosen], dtype=np.float32).reshape(-1, 1, 2)
        refined[chosen] = cv2.cornerSubPix(grey, start, (size, size), (-1, -1), until).reshape(-1, 2)
    return _saddle_points(grey, refined, np.asarray(spacing_px))


def _saddle_points(grey: np.ndarray, corners_px: Points2, spacing_px: Values) -> Points2:
    """Step to the saddle point of the brightness around each corner; one that is none, or far off, stays where it was."""
    import cv2

    left, top = np.maximum(np.floor(corners_px.min(axis=0)).astype(int) - _MARGIN_PX, 0)
    right, bottom = np.ceil(corners_px.max(axis=0)).astype(int) + _MARGIN_PX
    part = np.ascontiguousarray(grey[top:bottom, left:right], dtype=np.float32)
    smooth = cv2.GaussianBlur(part, (0, 0), _SMOOTHING_PX)
    reach = np.clip(_SADDLE_SHARE * spacing_px, _SMALLEST_SADDLE_PX, _LARGEST_SADDLE_PX)
    origin = np.array([left, top], dtype=np.float64)
    first = corners_px - origin
    at, good = first.copy(), np.ones(len(first), dtype=bool)
    for _ in range(_SADDLE_ROUNDS):
        patch = (at[:, None] + reach[:, None, None] * _OFFSETS).astype(np.float32)
        values = cv2.remap(smooth, patch[..., 0], patch[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        even = values.astype(np.float64) / _light(at, patch, values)
        _, slope_x, slope_y, xx, xy, yy = (even @ _FIT.T).T
        determinant = 4.0 * xx * yy - xy * xy
        good &= determinant < 0.0
        step = np.stack([xy * slope_y - 2.0 * yy * slope_x, xy * slope_x - 2.0 * xx * slope_y], axis=1)
        step *= (reach / np.where(good, determinant, 1.0))[:, None]
        at[good] += np.clip(step[good], -_LARGEST_STEP_PX, _LARGEST_STEP_PX)
    good &= np.linalg.norm(at - first, axis=1) <= _LARGEST_STEP_PX
    return np.where(good[:, None], at + origin, corners_px)


def _light(corners_px: Points2, patches_px: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the brightness of the light over patches (n, m, 2), as a share of that at their corners: (n, m).

    Half of every patch is black and half is white, so its mean follows the light; a light that falls off to one side would
    otherwise move all corners to the other.
    """
    middle, size = corners_px.mean(axis=0), max(float(np.ptp(corners_px, axis=0).max()), 1.0)
    degree = 2 if len(corners_px) >= _CORNERS_FOR_SQUARES else 1 if len(corners_px) >= _CORNERS_FOR_SLOPE else 0

    def terms(pixels_px: np.ndarray) -> np.ndarray:
        x, y = (pixels_px[..., 0] - middle[0]) / size, (pixels_px[..., 1] - middle[1]) / size
        return np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=-1)

    means = np.log(np.maximum((values * _WEIGHTS).sum(axis=1), 1.0))
    at_corners = terms(corners_px)
    smooth, *_ = np.linalg.lstsq(at_corners, means, rcond=None)
    return np.asarray(np.exp(terms(patches_px) @ smooth - (at_corners @ smooth)[:, None]))


def _offsets() -> np.ndarray:
    """Return the places at which a patch is sampled, over its reach: (m, 2)."""
    line = np.linspace(-1.0, 1.0, _SADDLE_SAMPLES)
    return np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)


def _middle_weights(offsets: np.ndarray) -> np.ndarray:
    """Return weights (m,) of a patch's samples, larger in the middle; their sum is 1."""
    weights = np.exp(-2.0 * (offsets**2).sum(axis=1))
    return np.asarray(weights / weights.sum())


def _quadratic_fit(offsets: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return what makes the coefficients of 1, x, y, x^2, x y, y^2 of m values: (6, m)."""
    x, y = offsets.T
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    weighted = terms * weights[:, None]
    return np.asarray(np.linalg.solve(terms.T @ weighted, weighted.T))


_OFFSETS = _offsets()
_WEIGHTS = _middle_weights(_OFFSETS)
_FIT = _quadratic_fit(_OFFSETS, _WEIGHTS)
_MARGIN_PX = 16
