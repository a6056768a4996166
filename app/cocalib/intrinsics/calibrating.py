"""Look for the board and calibrate the lens: one step for the command line and the page."""

from collections.abc import Callable, Collection

from calib_core.intrinsics import (
    Board,
    BoardCorners,
    BoardPictures,
    BoardSearch,
    CalibratedLens,
    IntrinsicsOptions,
    SearchProgress,
    calibrate_lens,
    search_boards,
)
from calib_core.measurements import Unsolvable


def calibrate_from(
    pictures: BoardPictures,
    board: Board,
    options: IntrinsicsOptions | None = None,
    *,
    known: tuple[BoardCorners, ...] = (),
    searched: Collection[int] = (),
    progress: Callable[[SearchProgress | str], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[BoardSearch, CalibratedLens] | Unsolvable:
    """Find the board in pictures, and calibrate the lens that took them.

    Args:
        pictures: where to look.
        board: what to look for.
        options: of the calibration.
        known: views of an earlier search.
        searched: numbers of the pictures that it looked at.
        progress: called while the board is looked for, and then with what is done next, in words.
        stopped: asked often; once it is true there is no calibration.
    """
    search = search_boards(pictures, board, known=known, searched=searched, progress=progress, stopped=stopped)
    if isinstance(search, Unsolvable):
        return search
    if stopped():
        return Unsolvable("stopped", "the calibration was stopped", "start it again")
    lens = calibrate_lens(search, options, progress=progress, stopped=stopped)
    return lens if isinstance(lens, Unsolvable) else (search, lens)
