"""What a search for a board has found, so far and in the end."""

from dataclasses import dataclass

from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_pictures import BoardCorners, LeftOutPicture
from calib_core.intrinsics.searching.coverage import Coverage, view_coverage


@dataclass(frozen=True, slots=True)
class SearchProgress:
    """How far a search is.

    Attributes:
        searched: pictures so far.
        total: pictures to search, as far as known; it grows where the board is found in a long recording.
        views: in which the board was found so far, in order of their numbers.
        left_out: those not used so far.
        coverage: of these views; None before the first.
        indices: numbers of the pictures that were searched, ascending.
    """

    searched: int
    total: int
    views: tuple[BoardCorners, ...] = ()
    left_out: tuple[LeftOutPicture, ...] = ()
    coverage: Coverage | None = None
    indices: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class BoardSearch:
    """What a search found.

    Attributes:
        board: what was looked for.
        size_px: width and height of the pictures.
        views: those to calibrate with, in order of their numbers.
        left_out: the others in which the board is, or was expected, with the reason.
        searched: how many pictures were looked at.
        complete: whether all were; False after a cancelled search.
        indices: their numbers, ascending.
        found: all views that were found, the ones left out included, for a search that goes on from here.
    """

    board: Board
    size_px: tuple[int, int]
    views: tuple[BoardCorners, ...]
    left_out: tuple[LeftOutPicture, ...]
    searched: int
    complete: bool = True
    indices: tuple[int, ...] = ()
    found: tuple[BoardCorners, ...] = ()

    @property
    def coverage(self) -> Coverage:
        """What of the picture, and which tilts and distances, the views cover."""
        return view_coverage(self.views, self.board, self.size_px)
