"""Write and read board-views-1: what a search for a board has found, so that it is not done again."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from calib_core.errors import InputError
from calib_core.interchange.own.documents import finite_or_none, nan_if_none
from calib_core.interchange.own.lens_documents import (
    BOARD_VIEWS_SCHEMA,
    BoardViewDocument,
    BoardViewsDocument,
    ImageSource,
)
from calib_core.interchange.syntax.strict_json import document_text, parse_document
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_images import BoardCorners, LeftOutImage
from calib_core.measurements import TimeNs

_LONGEST_NAME = 200


@dataclass(frozen=True, slots=True)
class BoardViews:
    """What a search has found so far.

    Attributes:
        board: what was looked for.
        source: where.
        views: in which the board was found.
        searched: first and last number of runs of images that need not be looked at again.
        complete: whether the search came to its end.
    """

    board: Board
    source: ImageSource
    views: tuple[BoardCorners, ...]
    searched: tuple[tuple[int, int], ...] = ()
    complete: bool = False

    def searched_indices(self) -> tuple[int, ...]:
        """Return the numbers of the images that need not be looked at again, ascending."""
        flags = np.zeros(self.source.images, dtype=bool)
        for first, last in self.searched:
            flags[first : last + 1] = True
        flags[[view.index for view in self.views]] = True
        return tuple(np.flatnonzero(flags).tolist())

    def require_same(self, board: Board, source: ImageSource, *, file: str) -> None:
        """Refuse views of another board or of other images.

        Raises:
            InputError: they are.
        """
        if self.board != board:
            raise InputError(
                f"{file}: views of a {_caption(self.board)}, but the board is a {_caption(board)}; "
                "give that board, or name another file"
            )
        if self.source.sha256 != source.sha256 or self.source.images != source.images:
            raise InputError(
                f"{file}: views in {self.source.name} ({self.source.images} images), not in {source.name} as it is now "
                f"({source.images} images); give the same images, or name another file"
            )


def _caption(board: Board) -> str:
    parts = [f"{board.text} with {1e3 * board.square_m:g} mm"]
    if board.marker_m:
        parts.append(f"{1e3 * board.marker_m:g} mm")
    return ", ".join([*parts, *([board.dictionary] if board.dictionary else [])])


def write_board_views(views: BoardViews) -> str:
    """Write board-views-1 text; the same views give the same bytes."""
    document = BoardViewsDocument(
        BOARD_VIEWS_SCHEMA,
        views.board,
        published_source(views.source),
        views.complete,
        list(views.searched),
        [_view_document(view) for view in views.views],
    )
    return document_text(document)


def read_board_views(text: str, source: str = "views") -> BoardViews:
    """Read board-views-1 text.

    Args:
        text: the file's content.
        source: the name of the file in error messages.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    document = parse_document(text, BoardViewsDocument, source=source)
    board = document.board
    images = document.source.images
    for index, (first, last) in enumerate(document.searched):
        if not first <= last < images:
            raise InputError(f"{source}: searched[{index}]: {first} to {last} of {images} images; search again")
    views = tuple(
        _view(view, board, images, source=source, place=f"views[{index}]") for index, view in enumerate(document.views)
    )
    if len({view.index for view in views}) < len(views):
        raise InputError(f"{source}: views: two are of the same image; search again")
    return BoardViews(
        board,
        document.source,
        views,
        tuple(document.searched),
        document.complete,
    )


def published_source(source: ImageSource) -> ImageSource:
    """Return a source of images with a name that is not longer than files may state, and not empty."""
    return structs.replace(source, name=source.name[:_LONGEST_NAME] or "images")


def published_left_out(left_out: Iterable[LeftOutImage]) -> list[LeftOutImage]:
    """Return images that are not used, with names that are not longer than files may state."""
    return [structs.replace(image, name=image.name[:_LONGEST_NAME]) for image in left_out]


def _view_document(view: BoardCorners) -> BoardViewDocument:
    return BoardViewDocument(
        view.index,
        view.name[:_LONGEST_NAME],
        view.size_px,
        view.corner_ids.tolist(),
        [tuple(pixel) for pixel in view.pixels_px.tolist()],
        time_ns=None if view.time_ns is None else int(view.time_ns),
        blur_px=finite_or_none(view.blur_px),
    )


def _view(document: BoardViewDocument, board: Board, images: int, *, source: str, place: str) -> BoardCorners:
    """Return a view.

    Raises:
        InputError: it cannot be one of this board in these images.
    """
    ids, count = np.array(document.corner_ids), len(board.corners_m)
    if len(ids) != len(document.pixels_px) or not np.all(np.diff(ids) > 0) or ids[-1] >= count:
        raise InputError(
            f"{source}: {place}: corner_ids must ascend, be below {count} and as many as pixels_px; search again"
        )
    if document.index >= images:
        raise InputError(f"{source}: {place}.index: {document.index} of {images} images; search again")
    pixels = np.array(document.pixels_px)
    if np.any(pixels < -1.0) or np.any(pixels > document.size_px):
        raise InputError(f"{source}: {place}.pixels_px: a corner is outside its image; search again")
    return BoardCorners(
        document.index,
        document.name,
        None if document.time_ns is None else TimeNs(document.time_ns),
        document.size_px,
        ids,
        pixels,
        nan_if_none(document.blur_px),
    )


def runs_of(numbers: Iterable[int]) -> tuple[tuple[int, int], ...]:
    """Return the first and last of runs of numbers without a gap."""
    runs: list[tuple[int, int]] = []
    for number in sorted(numbers):
        if runs and runs[-1][1] == number - 1:
            runs[-1] = (runs[-1][0], number)
        else:
            runs.append((number, number))
    return tuple(runs)
