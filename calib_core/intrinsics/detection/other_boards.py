"""Which checkerboard a picture shows, if it is not the one that was looked for."""

import numpy as np

from calib_core.intrinsics.board import Board

_WIDTH_PX = 640
_SEEDS = ((3, 3), (4, 3), (5, 4))


def board_in(picture: np.ndarray, board: Board) -> tuple[int, int] | None:
    """Return the inner corners of another checkerboard in a picture: along its longer and its shorter side; None without one.

    Args:
        picture: uint8 (h, w, 3), blue first, or (h, w).
        board: the one that was looked for and is not there.
    """
    import cv2

    if board.kind != "checkerboard":
        return None
    grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    factor = min(1.0, _WIDTH_PX / grey.shape[1])
    small = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    sizes = []
    for seed in _SEEDS:
        flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_NORMALIZE_IMAGE
        found, _, meta = cv2.findChessboardCornersSBWithMeta(small, seed, flags)
        if found and meta is not None:
            sizes.append((max(meta.shape[:2]), min(meta.shape[:2])))
    largest = max(sizes, key=lambda size: size[0] * size[1], default=None)
    looked_for = max(board.columns, board.rows), min(board.columns, board.rows)
    return None if largest == looked_for else largest
