"""Look for a board in many images, first all over a recording and then where it is, and choose those to calibrate with."""

import os
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from calib_core.arrays import Points2, Values
from calib_core.errors import CalibrationError
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_detection import blur_px, board_in, find_board
from calib_core.intrinsics.board_images import BoardCorners, BoardImages, LeftOutImage
from calib_core.intrinsics.coverage import BoardSearch, SearchProgress, view_coverage
from calib_core.measurements import NS_PER_S, TimeNs, Unsolvable

_LISTED = 200  # of so few images, each one without a board is named
_ASKED_FOR_OTHERS = 13
_BEFORE_OTHERS, _OTHERS_ENOUGH = 24, 6
_FEW_SHARE, _OTHERS_FACTOR = 0.25, 3
_IMAGES_PER_CORE = 4
_OTHER_SIZES_SHARE = 0.2


def search_boards(
    images: BoardImages,
    board: Board,
    *,
    known: SearchProgress | None = None,
    progress: Callable[[SearchProgress], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> BoardSearch | Unsolvable:
    """Look for a board and choose the views to calibrate with.

    Of a few hundred images each is searched; of a long recording some all over it, and then more where the board is.

    Args:
        images: where to look.
        board: what to look for.
        known: how far an earlier search came; its images are not looked at again.
        progress: called from this thread while the search runs.
        stopped: asked between images; once it is true the search ends with what was found.
    """
    search = _Search(images, board, known or SearchProgress(0, 0))
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for _ in search.run(pool):
            if progress is not None:
                progress(search.progress())
            if stopped():
                break
    return search.result()


class _Search:
    """A search, and what it has found so far."""

    def __init__(self, images: BoardImages, board: Board, known: SearchProgress) -> None:
        self._images = images
        self._board = board
        self._views = {view.index: view for view in known.views}
        self._seen = set(known.indices)
        self._unreadable: dict[int, str] = {}
        self._sizes: Counter[tuple[int, int]] = Counter(view.size_px for view in known.views)
        self._order = ImageOrder(len(images), images.time_ns)
        self._complete = False
        self._shown: dict[int, tuple[int, int] | None] = {}  # other boards in images that were asked for them

    def run(self, pool: ThreadPoolExecutor) -> Iterator[None]:
        """Search image after image; yields after each."""
        step = _IMAGES_PER_CORE * (os.cpu_count() or 1)
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
        """Return whether the first images show another board, so that the rest need not be searched."""
        if self._shown or self._views or len(self._seen) < _BEFORE_OTHERS:
            return False
        sizes = Counter(self._other_boards(self._empty()).values())
        return bool(sizes) and sizes.most_common(1)[0][1] >= _OTHERS_ENOUGH

    def _look(self, index: int) -> tuple[tuple[int, int], BoardCorners | None] | str:
        """Look at an image: its size and what is in it, or why it cannot be read."""
        try:
            image = self._images.image(index)
        except CalibrationError as error:
            return str(error)
        size_px = (image.shape[1], image.shape[0])
        found = find_board(image, self._board)
        if found is None:
            return size_px, None
        name, time = self._images.name(index), self._images.time_ns(index)
        return size_px, BoardCorners(index, name, time, size_px, *found, blur_px(image, *found, self._board))

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
            LeftOutImage(view.index, view.name, f"it has {_size_text(view.size_px)} pixels, not {_size_text(size_px)}")
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
        )

    def _is_rather_of_another_board(self) -> bool:
        """Return whether another board is in far more images: the few views are a part of it, or wrong."""
        count = len(self._views)
        if self._board.kind != "checkerboard" or count > _FEW_SHARE * len(self._seen):
            return False
        sizes = Counter(self._other_boards(self._empty()).values())
        return bool(sizes) and sizes.most_common(1)[0][1] >= max(_OTHERS_ENOUGH, _OTHERS_FACTOR * count)

    def _sorted_views(self) -> tuple[BoardCorners, ...]:
        return tuple(self._views[index] for index in sorted(self._views))

    def _faults(self) -> list[LeftOutImage]:
        return [
            LeftOutImage(index, self._images.name(index), f"it cannot be read: {why}")
            for index, why in sorted(self._unreadable.items())
        ]

    def _empty(self) -> list[int]:
        return sorted(self._seen - set(self._views) - set(self._unreadable))

    def _without_board(self) -> list[LeftOutImage]:
        """Name the images without the board, if they are few enough to have been taken of one."""
        if len(self._images) > _LISTED:
            return []
        empty = self._empty()
        shown = self._other_boards(empty)
        return [
            LeftOutImage(
                index,
                self._images.name(index),
                f"it shows a board of {_size_text(shown[index])} inner corners"
                if index in shown
                else f"no {self._board.text} is seen in it as a whole"
                if self._board.kind == "checkerboard"
                else f"no {self._board.text} is seen in it",
            )
            for index in empty
        ]

    def _other_boards(self, indices: Sequence[int]) -> dict[int, tuple[int, int]]:
        """Return which checkerboard some images show instead, by their numbers."""
        asked = indices[:: max(1, len(indices) // _ASKED_FOR_OTHERS)]
        if not self._shown.keys() & set(indices):
            for index in asked:
                self._shown[index] = board_in(self._images.image(index), self._board)
        return {index: shown for index, shown in self._shown.items() if shown}

    def _no_board(self) -> Unsolvable:
        if not self._seen:
            return Unsolvable("no-pictures")
        if self._unreadable and len(self._unreadable) == len(self._seen):
            why = next(iter(self._unreadable.values()))
            return Unsolvable("unreadable", {"images": len(self._seen), "why": why})
        sizes = Counter(self._other_boards(self._empty()).values())
        seen = {"board": self._board, "searched": len(self._seen), "views": len(self._views)}
        if not sizes:
            return Unsolvable("no-board", seen)
        corners, shown = sizes.most_common(1)[0]
        return Unsolvable("other-board", {**seen, "corners": corners, "shown": shown, "asked": len(self._shown)})

    def _mixed_sizes(self) -> Unsolvable:
        return Unsolvable("mixed-sizes", {"counts": tuple(self._sizes.most_common(4))})


def _size_text(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]} x {size_px[1]}"


_EVERY_ONE = 300
_FIRST_PASS = 180
_MOST = 420
_FINEST_S = 0.3
_USUAL_RATE_HZ = 30.0


class ImageOrder:
    """Batches of images to search, each chosen by what was found before. The order does not depend on how fast anything is."""

    def __init__(self, count: int, time_ns: Callable[[int], TimeNs | None]) -> None:
        """Set up the order.

        Args:
            count: of images.
            time_ns: of an image by its number; None if nothing says.
        """
        self._count = count
        self._asked: set[int] = set()
        self._finest = max(1, round(_FINEST_S * _rate_hz(count, time_ns)))
        self.total = count if count <= _EVERY_ONE else _FIRST_PASS
        """Images to search, as far as known."""

    def next_batch(self, found: Collection[int]) -> list[int]:
        """Return the numbers of the images to search next; none at the end.

        Args:
            found: numbers of the images in which the board was found so far.
        """
        if not self._asked:
            batch = self._everywhere()
        else:
            batch = [] if self._count <= _EVERY_ONE else self._gap_middles(sorted(self._asked), set(found))
        self._asked.update(batch)
        self.total = max(self.total, len(self._asked))
        return batch

    def _everywhere(self) -> list[int]:
        """Return images all over the recording, such that the first ones are far apart."""
        if self._count <= _EVERY_ONE:
            return list(range(self._count))
        even = np.linspace(0, self._count - 1, _FIRST_PASS).round().astype(int)
        return list(dict.fromkeys(even[_far_apart(len(even))].tolist()))

    def _gap_middles(self, asked: list[int], found: set[int]) -> list[int]:
        """Return the middles of the gaps beside images with the board, the widest first, as far as the number allows."""
        gaps = [
            (after - before, (before + after) // 2)
            for before, after in pairwise(asked)
            if after - before > self._finest and (before in found or after in found)
        ]
        gaps.sort(key=lambda gap: (-gap[0], gap[1]))
        return [middle for _, middle in gaps[: _MOST - len(self._asked)]]


def _rate_hz(count: int, time_ns: Callable[[int], TimeNs | None]) -> float:
    first, last = (time_ns(0), time_ns(count - 1)) if count > 1 else (None, None)
    if first is None or last is None or last <= first:
        return _USUAL_RATE_HZ
    return (count - 1) * NS_PER_S / (last - first)


def _far_apart(count: int) -> np.ndarray:
    """Return 0 to count - 1 in the order of their reversed binary digits."""
    bits = max(1, int(count - 1).bit_length())
    reversed_digits = [int(f"{number:0{bits}b}"[::-1], 2) for number in range(1 << bits)]
    order = np.array(reversed_digits)
    return np.asarray(order[order < count])


MOST_VIEWS = 60
_SHARP_SHARE = 0.3
_BLURRED_FACTOR, _BLURRED_PX = 1.6, 0.8
_SAME_SHARE, _SAME_PX = 0.004, 2.0  # of the width of the image
_SHARPER_FACTOR = 1.05


def chosen_views(views: Sequence[BoardCorners], board: Board) -> tuple[list[BoardCorners], list[LeftOutImage]]:
    """Return the views to calibrate with, in order of their numbers, and the others with the reason.

    Args:
        views: of one size of image, in order of their numbers.
        board: that they show.
    """
    left_out: list[LeftOutImage] = []
    known = np.array([view.blur_px for view in views])
    known = known[np.isfinite(known)]
    sharp_px = float(np.quantile(known, _SHARP_SHARE)) if len(known) else float("inf")
    limit_px = max(_BLURRED_FACTOR * sharp_px, sharp_px + _BLURRED_PX)
    sharp = []
    for view in views:
        if view.blur_px > limit_px:
            reason = f"blurred: edges are {view.blur_px:.1f} px wide, those of the others {sharp_px:.1f} px"
            left_out.append(LeftOutImage(view.index, view.name, reason))
        else:
            sharp.append(view)
    outlines = np.array([outline_px(view, board) for view in sharp]).reshape(len(sharp), -1)
    kept = _without_duplicates(sharp, outlines, left_out)
    if len(kept) > MOST_VIEWS:
        different = set(_most_different(outlines[kept], np.array([sharp[row].blur_px for row in kept])))
        for index, row in enumerate(kept):
            if index not in different:
                reason = f"not needed: {MOST_VIEWS} views that differ more from one another are used"
                left_out.append(LeftOutImage(sharp[row].index, sharp[row].name, reason, spare=True))
        kept = [row for index, row in enumerate(kept) if index in different]
    return [sharp[row] for row in kept], left_out


def outline_px(view: BoardCorners, board: Board) -> Points2:
    """Return where the four outer corners of the board are in the image, or would be: (4, 2) [px]."""
    import cv2

    plane_m = board.corners_m[:, :2]
    (left, top), (right, bottom) = plane_m.min(axis=0), plane_m.max(axis=0)
    outer = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    homography, _ = cv2.findHomography(plane_m[view.corner_ids], view.pixels_px)
    if homography is None:
        middle = view.pixels_px.mean(axis=0)
        return np.repeat(middle[None], 4, axis=0)
    return np.asarray(cv2.perspectiveTransform(outer[:, None], homography)[:, 0])


def _without_duplicates(views: Sequence[BoardCorners], outlines: np.ndarray, left_out: list[LeftOutImage]) -> list[int]:
    """Return the rows of the views that are no repetition of a sharper one, ascending; name the others."""
    sharpest_first = sorted(range(len(views)), key=lambda row: (np.nan_to_num(views[row].blur_px, nan=1e9), row))
    kept: list[int] = []
    for row in sharpest_first:
        near_px = max(_SAME_PX, _SAME_SHARE * views[row].size_px[0])
        turned = outlines[row].reshape(4, 2)[[2, 3, 0, 1]].ravel()  # a checkerboard looks the same from both ends
        same = next(
            (
                one
                for one in kept
                if min(_outline_distance_px(outlines[one], outlines[row]), _outline_distance_px(outlines[one], turned))
                < near_px
            ),
            None,
        )
        if same is None:
            kept.append(row)
        else:
            sharper = views[row].blur_px > _SHARPER_FACTOR * views[same].blur_px
            reason = f"the same view as {views[same].name}{', which is sharper' if sharper else ''}"
            left_out.append(LeftOutImage(views[row].index, views[row].name, reason, spare=True))
    return sorted(kept)


def _outline_distance_px(a: Values, b: Values) -> float:
    """Return the rms distance between two outlines (8,) [px]."""
    return float(np.sqrt(np.square(a - b).sum() / 4.0))


def _most_different(outlines: np.ndarray, blur_px: Values) -> list[int]:
    """Choose views one by one, each as far from the chosen ones as possible; of equally far ones the sharper."""
    size = np.ptp(outlines, axis=0).max()
    apart = np.linalg.norm(outlines[:, None] - outlines[None], axis=2) / max(float(size), 1e-9)
    worth = 1.0 / np.maximum(np.nan_to_num(blur_px, nan=np.nanmax(blur_px, initial=1.0)), 0.3)
    chosen = [int(np.argmax(apart.sum(axis=1)))]
    while len(chosen) < MOST_VIEWS:
        nearest = apart[:, chosen].min(axis=1)
        nearest[chosen] = -1.0
        chosen.append(int(np.argmax(nearest * worth)))
    return chosen
