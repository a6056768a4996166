"""The checkerboard of the paper's other method (CCM) in the frames of a recording: where its inner corners are."""

from collections.abc import Iterator
from typing import Protocol, runtime_checkable

import numpy as np

from calib_core.arrays import Points2, TimesNs
from calib_core.measurements import Unsolvable

_MOST_FRAMES = 40
_STRIDE = 17
"""Coprime to the number of frames: frames far apart are searched first."""
_ENOUGH_VIEWS = 3
_STILL_PX = 3.0


@runtime_checkable
class PictureSource(Protocol):
    """The part of a Recording that shows the board."""

    image_times: TimesNs

    def image(self, index: int, /) -> np.ndarray:
        """Return a frame's pixels: uint8 (h, w, 3), blue first."""


def find_board(source: object, columns: int, rows: int) -> Points2 | Unsolvable:
    """Find a checkerboard that stands still: its inner corners (rows * columns, 2) [px], row by row.

    Up to 40 frames all over the recording are searched, until three show the whole board.

    Args:
        source: a recording; one without pictures shows no board.
        columns: inner corners along the longer side of the board.
        rows: inner corners along its shorter side.

    Raises:
        CalibrationError: a frame cannot be read.
    """
    searched = 0
    views: list[Points2] = []
    for picture in _frames(source):
        searched += 1
        corners = find_corners(picture, columns, rows)
        if corners is not None:
            views.append(corners if not views else _in_the_order_of(views[0], corners))
        if len(views) == _ENOUGH_VIEWS:
            break
    if not views:
        return Unsolvable(
            "no-board",
            f"none of {searched} frames all over the recording shows a checkerboard of {columns} x {rows} inner "
            "corners as a whole",
            "record some seconds in which nothing hides the board, near enough that its squares are 10 px wide, and state its "
            "inner corners, which are one fewer than its squares",
        )
    moved_px = max(float(np.linalg.norm(view - views[0], axis=1).max()) for view in views)
    if moved_px > _STILL_PX:
        return Unsolvable(
            "board-moved",
            f"the checkerboard moves by {moved_px:.0f} px in the course of the recording",
            "leave board and sensors where they are while the reflector is put on its corners",
        )
    return np.asarray(np.mean(views, axis=0))


def find_corners(picture: np.ndarray, columns: int, rows: int) -> Points2 | None:
    """Find all inner corners of a checkerboard: (rows * columns, 2) [px], row by row; None if one of them is hidden.

    Args:
        picture: uint8 (h, w, 3), blue first.
        columns: inner corners in a row.
        rows: number of rows.
    """
    import cv2

    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    found, corners = cv2.findChessboardCornersSB(grey, (columns, rows), flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    return np.asarray(corners, dtype=np.float64).reshape(-1, 2) if found else None


def _frames(source: object) -> Iterator[np.ndarray]:
    if not isinstance(source, PictureSource) or not len(source.image_times):
        return
    places = np.linspace(0, len(source.image_times) - 1, _MOST_FRAMES).round().astype(int)
    order = places[_STRIDE * np.arange(_MOST_FRAMES) % _MOST_FRAMES]
    for index in dict.fromkeys(order.tolist()):
        yield source.image(index)


def _in_the_order_of(first_px: Points2, corners_px: Points2) -> Points2:
    """Count the corners from the same end of the board as in another view; a board looks the same from both."""
    turned = corners_px[::-1]
    apart, turned_apart = (np.linalg.norm(view - first_px, axis=1).sum() for view in (corners_px, turned))
    return turned if turned_apart < apart else corners_px
