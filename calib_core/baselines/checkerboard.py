"""CCM, the paper's baseline by checkerboard: the reflector is put on the board's corners, whose positions the camera knows.

The camera sees the pose of the board, so each corner is a point in the camera frame; the radar measures the reflector there.
The two sets of points are registered. The board is small and far, and radar angles are coarse: the problem is badly
conditioned, which the result says with a figure.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, Points2
from calib_core.baselines.judging import judged
from calib_core.baselines.registration import Registration, register, register_linearly
from calib_core.camera import Camera
from calib_core.measurements import Pair, Unpaired, Unsolvable
from calib_core.options import BoardOptions, CalibrationOptions
from calib_core.results import Calibration, DataWarning
from calib_core.vision.checkerboard import BoardView, view_of_board

_FEWEST_CORNERS = 3


@dataclass(frozen=True, slots=True)
class CornerPairs:
    """The pairs whose reflector is on a corner of the board.

    Attributes:
        pairs: in the order given.
        corners: for each of them, which corner it is.
        elsewhere: ids of the others.
    """

    pairs: tuple[Pair, ...]
    corners: tuple[int, ...]
    elsewhere: tuple[str, ...]


def pairs_on_corners(pairs: Sequence[Pair], corners_px: Points2, board: BoardOptions) -> CornerPairs:
    """Assign each pair to the corner nearest to its click, if one is within reach.

    Args:
        pairs: clicks with radar positions.
        corners_px: (rows * columns, 2) row by row.
        board: its size and the reach.
    """
    reach_px = board.reach_squares * _square_px(corners_px, board)
    apart_px = np.array([np.linalg.norm(corners_px - pair.pixel_px, axis=1) for pair in pairs])
    nearest: Indices = np.argmin(apart_px, axis=1) if len(pairs) else np.zeros(0, dtype=np.int64)
    on = [bool(apart_px[i, k] <= reach_px[k]) for i, k in enumerate(nearest.tolist())]
    return CornerPairs(
        pairs=tuple(pair for pair, here in zip(pairs, on, strict=True) if here),
        corners=tuple(k for k, here in zip(nearest.tolist(), on, strict=True) if here),
        elsewhere=tuple(pair.id for pair, here in zip(pairs, on, strict=True) if not here),
    )


def calibrate_on_board(
    pairs: Sequence[Pair],
    corners_px: Points2,
    camera: Camera,
    options: CalibrationOptions,
    *,
    excluded: frozenset[str] = frozenset(),
    unpaired: tuple[Unpaired, ...] = (),
) -> Calibration | Unsolvable:
    """Register the radar positions of the reflector with the corners of the board that it was put on.

    Args:
        pairs: in the order of the results; those that are not on a corner are shown and judged on, but not registered.
        corners_px: (rows * columns, 2) of the board in the picture, row by row.
        camera: the intrinsics.
        options: the board.
        excluded: ids of pairs that are shown, but not used.
        unpaired: clicks without a radar position.
    """
    board = options.board
    view = view_of_board(corners_px, board.columns, board.rows, board.square_m, camera)
    if view is None:
        return Unsolvable(
            "board-not-seen",
            "the corners that were found cannot be a flat checkerboard in front of this camera",
            "check that the intrinsics belong to these frames, and columns, rows and side of the squares of the board",
            unpaired,
            tuple(pairs),
        )
    on = pairs_on_corners([pair for pair in pairs if pair.id not in excluded], corners_px, board)
    distinct = len(set(on.corners))
    if distinct < _FEWEST_CORNERS:
        return Unsolvable("too-few-corners", *_too_few(distinct, on, len(unpaired)), unpaired, tuple(pairs))
    radar_m = np.array([pair.candidates[0].position_radar_m for pair in on.pairs])
    solve = register if board.registration == "rigid" else register_linearly
    found = solve(radar_m, view.corners_camera_m[list(on.corners)])
    if found is None:
        return Unsolvable(
            "points-in-one-line",
            f"the {distinct} corners with the reflector are too few for this registration or lie on one line",
            "put the reflector on four or more corners of at least two rows and two columns, as far apart as the board allows",
            unpaired,
            tuple(pairs),
        )
    warnings = [_conditioning(found, view, distinct), *_elsewhere(on)]
    return judged(found.camera_from_radar, pairs, unpaired, excluded, camera, options, warnings)


def _square_px(corners_px: Points2, board: BoardOptions) -> np.ndarray:
    """Return how large a square is in the picture at each corner: its nearest neighbour's distance, (n,) [px]."""
    grid = corners_px.reshape(board.rows, board.columns, 2)
    along, across = (np.linalg.norm(np.diff(grid, axis=axis), axis=2) for axis in (1, 0))
    sides = np.full((4, board.rows, board.columns), np.inf)
    sides[0, :, 1:], sides[1, :, :-1], sides[2, 1:], sides[3, :-1] = along, along, across, across
    return np.asarray(sides.min(axis=0).ravel())


def _too_few(distinct: int, on: CornerPairs, unpaired: int) -> tuple[str, str]:
    kinds = ((len(on.elsewhere), "clicked beside every corner"), (unpaired, "without a radar position"))
    others = "".join(f", {count} {what}" for count, what in kinds if count)
    return (
        f"the reflector is on {distinct} of at least {_FEWEST_CORNERS} required corners of the checkerboard{others}",
        "put the reflector on more corners, and click each time where the corner is",
    )


def _conditioning(found: Registration, view: BoardView, distinct: int) -> DataWarning:
    middle = view.corners_camera_m.mean(axis=0)
    return DataWarning(
        "board-geometry",
        f"registered on {distinct} corners of a board {np.linalg.norm(middle):.1f} m away: condition number "
        f"{found.condition:,.0f}, {100.0 * found.rms_m:.0f} cm (RMS) left between radar and corners",
        "do not extrapolate from a board: place the reflector near and far, and use the default method",
    )


def _elsewhere(on: CornerPairs) -> list[DataWarning]:
    if not on.elsewhere:
        return []
    named = ", ".join(on.elsewhere[:6]) + (", ..." if len(on.elsewhere) > 6 else "")
    return [
        DataWarning(
            "beside-board",
            f"{len(on.elsewhere)} clicks are on no corner of the checkerboard and did not take part ({named})",
            "fine for clicks that only judge the pose; otherwise check columns and rows of the board, and the clicks",
        )
    ]
