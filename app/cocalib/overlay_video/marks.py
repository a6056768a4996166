"""Draw marks into a picture: returns with trails, clicks with their reprojections, boxes with their classes."""

from collections.abc import Sequence

import cv2
import numpy as np

from calib_core.arrays import Flags, Points2
from calib_core.measurements import Box
from cocalib.colours import residual_colours
from cocalib.recorded_view import box_words

HUES = ((255, 210, 80), (110, 220, 130), (90, 190, 255), (255, 140, 120), (200, 160, 255), (240, 240, 240))
"""Colours of the classes of boxes, red first."""
LARGE_PX = 30.0
"""Residuals from here on have the last colour, as on the page."""

_SHIFT = 3
_EDGE = (16, 13, 10)
_WHITE = (255, 255, 255)
_RING = (84, 180, 255)
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_REFERENCE_HEIGHT_PX = 720
_MANY = 800


def text_height_px(picture: np.ndarray) -> float:
    """Return the height of capital letters that suits the picture."""
    return 12.0 * max(0.75, picture.shape[0] / _REFERENCE_HEIGHT_PX)


def draw_returns(picture: np.ndarray, pixels_px: Points2, colours: np.ndarray, still: Flags) -> None:
    """Draw returns in their colours: dots are static, triangles are moving, as on the page.

    Args:
        picture: uint8 (h, w, 3), blue first; changed.
        pixels_px: (n, 2).
        colours: (n, 3), red first.
        still: (n,) which are static.
    """
    size = 0.4 * text_height_px(picture)
    smooth = cv2.LINE_AA if len(pixels_px) < _MANY else cv2.LINE_8
    blue_first = colours[:, ::-1].tolist()
    for (u_px, v_px), colour, stays in zip(pixels_px.tolist(), blue_first, still.tolist(), strict=True):
        if stays:
            centre = _fixed(u_px, v_px)
            cv2.circle(picture, centre, round((size + 1.2) * (1 << _SHIFT)), _EDGE, -1, smooth, _SHIFT)
            cv2.circle(picture, centre, round(size * (1 << _SHIFT)), colour, -1, smooth, _SHIFT)
        else:
            _triangle(picture, u_px, v_px, 1.3 * size + 1.6, _EDGE, smooth)
            _triangle(picture, u_px, v_px, 1.3 * size, colour, smooth)


def draw_trail(picture: np.ndarray, pixels_px: Points2, colours: np.ndarray, ages: np.ndarray) -> None:
    """Draw earlier returns as dots that become smaller with age.

    Args:
        picture: uint8 (h, w, 3), blue first; changed.
        pixels_px: (n, 2).
        colours: (n, 3), red first.
        ages: (n,) 0 for the newest, 1 for the oldest.
    """
    radii = 0.3 * text_height_px(picture) * (1.0 - 0.75 * ages)
    rows = zip(pixels_px.tolist(), colours[:, ::-1].tolist(), radii.tolist(), strict=True)
    for (u_px, v_px), colour, radius_px in rows:
        cv2.circle(picture, _fixed(u_px, v_px), round(radius_px * (1 << _SHIFT)), colour, -1, cv2.LINE_8, _SHIFT)


def draw_clicks(picture: np.ndarray, clicks_px: Points2, projected_px: Points2, ids: Sequence[str]) -> None:
    """Draw clicks as crosses, their reprojections as rings, and the residuals between them, with their lengths."""
    size = text_height_px(picture)
    lengths_px = np.linalg.norm(projected_px - clicks_px, axis=1)
    colours = residual_colours(lengths_px, LARGE_PX)[:, ::-1].tolist()
    rows = zip(clicks_px.tolist(), projected_px.tolist(), ids, lengths_px.tolist(), colours, strict=True)
    for click, projected, name, length_px, colour in rows:
        (u_px, v_px), seen = click, bool(np.isfinite(projected).all())
        for (left, top), (right, bottom) in (((-1, 0), (1, 0)), ((0, -1), (0, 1))):
            ends = (_fixed(u_px + left * size, v_px + top * size), _fixed(u_px + right * size, v_px + bottom * size))
            cv2.line(picture, *ends, _EDGE, 3, cv2.LINE_AA, _SHIFT)
            cv2.line(picture, *ends, _WHITE, 1, cv2.LINE_AA, _SHIFT)
        if seen:
            cv2.line(picture, _fixed(u_px, v_px), _fixed(*projected), colour, 2, cv2.LINE_AA, _SHIFT)
            cv2.circle(picture, _fixed(*projected), round(0.7 * size * (1 << _SHIFT)), _RING, 2, cv2.LINE_AA, _SHIFT)
        words = f"{name}: {length_px:.1f} px" if seen else f"{name}: behind the camera"
        width = label_width_px(words, size)
        fits = u_px + 1.8 * size + width < picture.shape[1]
        left = u_px + 1.8 * size if fits else u_px - 1.8 * size - width
        label(picture, words, (left, v_px - 0.9 * size), _WHITE, plate=True)


def draw_boxes(picture: np.ndarray, boxes: Sequence[Box], labels: Sequence[str]) -> None:
    """Draw boxes with their classes and tracks, one colour per class."""
    for box in boxes:
        hue = HUES[labels.index(box.label) % len(HUES)][::-1] if box.label in labels else _WHITE
        corners = (_fixed(box.left_px, box.top_px), _fixed(box.right_px, box.bottom_px))
        cv2.rectangle(picture, *corners, _EDGE, 4, cv2.LINE_AA, _SHIFT)
        cv2.rectangle(picture, *corners, hue, 2, cv2.LINE_AA, _SHIFT)
        words = box_words(box)
        if words:
            label(picture, words, (box.left_px, box.top_px - 0.6 * text_height_px(picture)), hue, plate=True)


def label(
    picture: np.ndarray,
    words: str,
    place_px: tuple[float, float],
    colour: tuple[int, int, int],
    height_px: float | None = None,
    *,
    plate: bool = False,
) -> float:
    """Write one line inside the picture; return its width [px].

    Args:
        picture: changed.
        words: to write; what the font does not have becomes a question mark.
        place_px: of the left end of the base line.
        colour: blue first.
        height_px: of capital letters.
        plate: darken what is behind the line, so that it can be read on any picture.
    """
    height_px = text_height_px(picture) if height_px is None else height_px
    plain, scale, width = _measured(words, height_px)
    u_px = min(max(place_px[0], 2.0), max(2.0, picture.shape[1] - width - 2.0))
    v_px = min(max(place_px[1], 1.5 * height_px), picture.shape[0] - 0.5 * height_px)
    if plate:
        margin = round(0.4 * height_px)
        top, bottom = max(0, round(v_px - height_px) - margin), round(v_px) + margin
        behind = picture[top:bottom, max(0, round(u_px) - margin) : round(u_px + width) + margin]
        behind[:] = behind // 4
    cv2.putText(picture, plain, (round(u_px), round(v_px)), _FONT, scale, colour, 1, cv2.LINE_AA)
    return width


def label_width_px(words: str, height_px: float) -> float:
    """Return how wide a line is [px]."""
    return _measured(words, height_px)[2]


def _measured(words: str, height_px: float) -> tuple[str, float, float]:
    """Return what can be written of a line, OpenCV's scale for letters of a height, and the width [px]."""
    plain = words.encode("ascii", "replace").decode()
    scale = height_px / cv2.getTextSize("H", _FONT, 1.0, 1)[0][1]
    return plain, scale, float(cv2.getTextSize(plain, _FONT, scale, 1)[0][0])


def _triangle(picture: np.ndarray, u_px: float, v_px: float, size: float, colour: Sequence[int], smooth: int) -> None:
    corners = [(u_px, v_px - size), (u_px + 0.9 * size, v_px + 0.7 * size), (u_px - 0.9 * size, v_px + 0.7 * size)]
    cv2.fillConvexPoly(picture, np.array([_fixed(*corner) for corner in corners]), colour, smooth, _SHIFT)


def _fixed(u_px: float, v_px: float) -> tuple[int, int]:
    """Return a place as OpenCV takes it, with fractions of a pixel."""
    return round(u_px * (1 << _SHIFT)), round(v_px * (1 << _SHIFT))
