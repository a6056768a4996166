"""Look for a board in many pictures, and choose those to calibrate with."""

import os
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

from calib_core.errors import CalibrationError
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_pictures import BoardCorners, BoardPictures, LeftOutPicture
from calib_core.intrinsics.detection import blur_px, board_in, find_board
from calib_core.intrinsics.searching.coverage import view_coverage
from calib_core.intrinsics.searching.picture_order import PictureOrder
from calib_core.intrinsics.searching.search_result import BoardSearch, SearchProgress
from calib_core.intrinsics.searching.view_choice import chosen_views
from calib_core.measurements import Unsolvable

_LISTED = 200  # of so few pictures, each one without a board is named
_ASKED_FOR_OTHERS = 13
_BEFORE_OTHERS, _OTHERS_ENOUGH = 24, 6
_FEW_SHARE, _OTHERS_FACTOR = 0.25, 3
_PICTURES_PER_CORE = 4
_OTHER_SIZES_SHARE = 0.2


def search_boards(
    pictures: BoardPictures,
    board: Board,
    *,
    known: tuple[BoardCorners, ...] = (),
    searched: Collection[int] = (),
    progress: Callable[[SearchProgress], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> BoardSearch | Unsolvable:
    """Look for a board and choose the views to calibrate with.

    Of a few hundred pictures each is searched; of a long recording some all over it, and then more where the board is.

    Args:
        pictures: where to look.
        board: what to look for.
        known: views of an earlier search, which are not looked for again.
        searched: numbers of the pictures that the earlier search looked at.
        progress: called from this thread while the search runs.
        stopped: asked between pictures; once it is true the search ends with what was found.
    """
    search = _Search(pictures, board, known, searched)
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for _ in search.run(pool):
            if progress is not None:
                progress(search.progress())
            if stopped():
                break
    return search.result()


class _Search:
    """A search, and what it has found so far."""

    def __init__(
        self, pictures: BoardPictures, board: Board, known: Sequence[BoardCorners], searched: Collection[int]
    ) -> None:
        self._pictures = pictures
        self._board = board
        self._views = {view.index: view for view in known}
        self._seen = {*searched, *self._views}
        self._unreadable: dict[int, str] = {}
        self._sizes: Counter[tuple[int, int]] = Counter(view.size_px for view in known)
        self._order = PictureOrder(len(pictures), pictures.time_ns)
        self._complete = False
        self._shown: dict[int, str] = {}  # other boards in pictures that were asked for them; "" for none

    def run(self, pool: ThreadPoolExecutor) -> Iterator[None]:
        """Search picture after picture; yields after each."""
        step = _PICTURES_PER_CORE * (os.cpu_count() or 1)
        while True:
            batch = self._order.next_batch(self._views)
            if not batch:
                break
            todo = [index for index in batch if index not in self._seen]
            for first in range(0, len(todo), step):
                some = todo[first : first + step]
                for index, found in zip(some, pool.map(self._look, some), strict=True):
                    self._take(index, found)
                    yield
                if self._is_of_other_boards():
                    return
        self._complete = True

    def _is_of_other_boards(self) -> bool:
        """Return whether the first pictures show another board, so that the rest need not be searched."""
        if self._shown or self._views or len(self._seen) < _BEFORE_OTHERS:
            return False
        sizes = Counter(self._other_boards(self._empty()).values())
        return bool(sizes) and sizes.most_common(1)[0][1] >= _OTHERS_ENOUGH

    def _look(self, index: int) -> tuple[tuple[int, int], BoardCorners | None] | str:
        """Look at a picture: its size and what is in it, or why it cannot be read."""
        try:
            picture = self._pictures.picture(index)
        except CalibrationError as error:
            return str(error)
        size_px = (picture.shape[1], picture.shape[0])
        found = find_board(picture, self._board)
        if found is None:
            return size_px, None
        name, time = self._pictures.name(index), self._pictures.time_ns(index)
        return size_px, BoardCorners(index, name, time, size_px, *found, blur_px(picture, *found, self._board))

    def _take(self, index: int, found: tuple[tuple[int, int], BoardCorners | None] | str) -> None:
        self._seen.add(index)
        if isinstance(found, str):
            self._unreadable[index] = found
            return
        self._sizes[found[0]] += 1
        if found[1] is not None:
            self._views[index] = found[1]

    def progress(self) -> SearchProgress:
        """Say how far the search is."""
        views = self._sorted_views()
        return SearchProgress(
            searched=len(self._seen),
            total=max(len(self._seen), self._order.total),
            views=views,
            left_out=tuple(self._faults()),
            coverage=view_coverage(views, self._board, views[0].size_px) if views else None,
            indices=tuple(sorted(self._seen)),
        )

    def result(self) -> BoardSearch | Unsolvable:
        """Choose the views to calibrate with."""
        if not self._views or self._is_rather_of_another_board():
            return self._no_board()
        size_px, count = self._sizes.most_common(1)[0]
        others = sum(self._sizes.values()) - count
        if others > _OTHER_SIZES_SHARE * sum(self._sizes.values()):
            return self._mixed_sizes()
        fitting = [view for view in self._sorted_views() if view.size_px == size_px]
        if not fitting:
            return self._mixed_sizes()
        views, left_out = chosen_views(fitting, self._board)
        left_out += [
            LeftOutPicture(
                view.index, view.name, f"it has {_size_text(view.size_px)} pixels, not {_size_text(size_px)}"
            )
            for view in self._sorted_views()
            if view.size_px != size_px
        ]
        left_out += [*self._faults(), *self._without_board()]
        return BoardSearch(
            self._board,
            size_px,
            tuple(views),
            tuple(sorted(left_out, key=lambda one: one.index)),
            len(self._seen),
            self._complete,
            tuple(sorted(self._seen)),
            self._sorted_views(),
        )

    def _is_rather_of_another_board(self) -> bool:
        """Return whether another board is in far more pictures: the few views are a part of it, or wrong."""
        count = len(self._views)
        if self._board.kind != "checkerboard" or count > _FEW_SHARE * len(self._seen):
            return False
        sizes = Counter(self._other_boards(self._empty()).values())
        return bool(sizes) and sizes.most_common(1)[0][1] >= max(_OTHERS_ENOUGH, _OTHERS_FACTOR * count)

    def _sorted_views(self) -> tuple[BoardCorners, ...]:
        return tuple(self._views[index] for index in sorted(self._views))

    def _faults(self) -> list[LeftOutPicture]:
        return [
            LeftOutPicture(index, self._pictures.name(index), f"it cannot be read: {why}")
            for index, why in sorted(self._unreadable.items())
        ]

    def _empty(self) -> list[int]:
        return sorted(self._seen - set(self._views) - set(self._unreadable))

    def _without_board(self) -> list[LeftOutPicture]:
        """Name the pictures without the board, if they are few enough to have been taken of one."""
        if len(self._pictures) > _LISTED:
            return []
        empty = self._empty()
        shown = self._other_boards(empty)
        return [
            LeftOutPicture(
                index,
                self._pictures.name(index),
                f"it shows a board of {shown[index]} inner corners"
                if index in shown
                else f"no {self._board.text} is seen in it as a whole"
                if self._board.kind == "checkerboard"
                else f"no {self._board.text} is seen in it",
            )
            for index in empty
        ]

    def _other_boards(self, indices: Sequence[int]) -> dict[int, str]:
        """Return which checkerboard some pictures show instead, by their numbers."""
        asked = indices[:: max(1, len(indices) // _ASKED_FOR_OTHERS)]
        if not self._shown.keys() & set(indices):
            for index in asked:
                other = board_in(self._pictures.picture(index), self._board)
                self._shown[index] = f"{other[0]} x {other[1]}" if other else ""
        return {index: shown for index, shown in self._shown.items() if shown}

    def _no_board(self) -> Unsolvable:
        if not self._seen:
            return Unsolvable(
                "no-pictures", "there are no pictures to look for a board in", "give pictures of the board"
            )
        if self._unreadable and len(self._unreadable) == len(self._seen):
            why = next(iter(self._unreadable.values()))
            return Unsolvable("unreadable", f"none of {len(self._seen)} pictures can be read: {why}", "check the files")
        empty = self._empty()
        sizes = Counter(self._other_boards(empty).values())
        count = len(self._views)
        shows = "show" if count > 1 else "shows"
        what = f"{count or 'none'} of {len(self._seen)} pictures {shows} a {self._board.text}"
        if sizes:
            size, count = sizes.most_common(1)[0]
            return Unsolvable(
                "other-board",
                f"{what}; {count} of the {len(self._shown)} that were looked at for others show {size} inner corners",
                f"state {size.replace(' ', '')} if that is the board: its inner corners are one fewer than its squares",
            )
        return Unsolvable("no-board", what, _film(self._board))

    def _mixed_sizes(self) -> Unsolvable:
        sizes = ", ".join(f"{count} of {_size_text(size)}" for size, count in self._sizes.most_common(4))
        return Unsolvable(
            "mixed-sizes",
            f"the pictures have different sizes: {sizes} pixels",
            "give the pictures of one camera in one size: every size has a calibration of its own",
        )


def _film(board: Board) -> str:
    if board.kind == "checkerboard":
        return (
            "film the board as a whole, near enough that its squares are 10 px wide, with a white margin around it, and state "
            "its inner corners, which are one fewer than its squares"
        )
    return "film the board near enough that its markers are 30 px wide, and state its size and the dictionary of its markers"


def _size_text(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]} x {size_px[1]}"
