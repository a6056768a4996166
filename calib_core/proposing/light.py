"""Changes of light between pictures of one fixed camera: how much brighter one is, per channel and from place to place."""

import numpy as np

_EVERY = 6
"""A gain is fitted to one row and column in so many."""
_DARK_GREY, _BRIGHT_GREY = 12, 243
_SHADE_SHARE = 0.16
"""Side of the square over which the light is compared, of the picture's width: what is smaller is not a change of light."""
_REDUCED = 8
_SAME_LIGHT = 0.015
_LEAST_SHADE, _MOST_SHADE = 0.7, 1.4


def channel_gains(picture: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return by how much to multiply each channel of a reference so that most of it looks like a picture: (3,).

    Args:
        picture: (h, w, 3) uint8.
        reference: (h, w, 3) uint8.
    """
    one, other = (each[_EVERY // 2 :: _EVERY, _EVERY // 2 :: _EVERY] for each in (picture, reference))
    gains = np.ones(3)
    for channel in range(3):
        a, b = one[..., channel], other[..., channel]
        told = (np.minimum(a, b) > _DARK_GREY) & (np.maximum(a, b) < _BRIGHT_GREY)
        if np.count_nonzero(told) >= 50:
            gains[channel] = float(np.median(a[told].astype(np.float32) / b[told]))
    return gains


def in_same_light(picture: np.ndarray, gains: np.ndarray, *, levels_per_grey: float) -> np.ndarray:
    """Return a picture with its channels multiplied: (h, w, 3) uint16, so many levels per level of grey.

    Args:
        picture: (h, w, 3) uint8.
        gains: (3,) of its channels.
        levels_per_grey: how fine.
    """
    import cv2

    factors = np.array([*(levels_per_grey * gains), 0.0])
    return np.asarray(cv2.multiply(picture, factors, dtype=cv2.CV_16U))


def in_light_of(reference: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """Return a picture in the light of another one: (h, w, 3) uint8; the picture itself if that hardly differs.

    Args:
        reference: (h, w, 3) uint8.
        picture: (h, w, 3) uint8.
    """
    import cv2

    gains = channel_gains(reference, picture)
    if picture is reference or np.abs(gains - 1.0).max() < _SAME_LIGHT:
        return picture
    return np.asarray(cv2.convertScaleAbs(in_same_light(picture, gains, levels_per_grey=64.0), alpha=1.0 / 64.0))


def local_light(picture: np.ndarray, usual: np.ndarray) -> np.ndarray:
    """Return how much brighter the surroundings of each pixel are than usual: (h, w, 1) float32, about 1.

    Args:
        picture: (h, w, 3) float32.
        usual: (h, w, 3) float32, with the gains of the channels applied.
    """
    import cv2

    height, width = picture.shape[:2]
    small = (max(1, width // _REDUCED), max(1, height // _REDUCED))
    one, other = (
        cv2.cvtColor(cv2.resize(each, small, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY)
        for each in (picture, usual)
    )
    share = (np.clip((one + 4.0) / (other + 4.0), _LEAST_SHADE, _MOST_SHADE) - _LEAST_SHADE) / (
        _MOST_SHADE - _LEAST_SHADE
    )
    side = max(3, round(_SHADE_SHARE * small[0]) | 1)
    levels = cv2.medianBlur(np.round(255.0 * share).astype(np.uint8), side).astype(np.float32)
    ratio = _LEAST_SHADE + (_MOST_SHADE - _LEAST_SHADE) / 255.0 * cv2.blur(levels, (side, side))
    return np.asarray(cv2.resize(ratio, (width, height), interpolation=cv2.INTER_LINEAR))[..., None]
