"""A calibration board: where its corners are in its own plane."""

import re
from functools import lru_cache
from typing import Annotated, Literal, TypeAlias

import numpy as np
from msgspec import Meta, Struct

from calib_core.arrays import Indices, Points3
from calib_core.errors import InputError
from calib_core.json_forms import Positive

BoardKind: TypeAlias = Literal["checkerboard", "charuco", "aprilgrid"]
_MOST = 100
_TAGS = "DICT_APRILTAG_36h11"
_MARKERS = "DICT_5X5_250"
_TAG_SPACING = 0.3
_MARKER_SHARE = 0.75
_COUNTED = {
    "checkerboard": "inner corners along a row and along a column, such as 9x6 for a board of 10 x 7 squares",
    "charuco": "squares along a row and along a column, such as 8x11",
    "aprilgrid": "tags along a row and along a column, such as 6x6",
}


class Board(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A calibration board: columns and rows as on the command line, lengths in meters.

    Attributes:
        kind: a checkerboard, a ChArUco board (a checkerboard with markers in its white squares), or Kalibr's AprilGrid.
        columns: inner corners along a row of a checkerboard, squares of a ChArUco board, tags of a grid.
        rows: the same along a column.
        square_m: side of a square [m]; of a tag for a grid.
        marker_m: side of a marker in a ChArUco board [m]; the distance between the sides of two tags of a grid [m].
        dictionary: of the markers, as OpenCV names it, such as "DICT_5X5_100".
    """

    kind: BoardKind
    columns: Annotated[int, Meta(ge=1, le=1000)]
    rows: Annotated[int, Meta(ge=1, le=1000)]
    square_m: Positive
    marker_m: Annotated[float, Meta(ge=0.0, le=1e9)] = 0.0
    dictionary: Annotated[str, Meta(max_length=200)] = ""

    @property
    def corners_m(self) -> Points3:
        """The corners in the board's frame, by id: (n, 3) [m]; x along its rows, y along its columns, z into the board.

        Of a checkerboard row by row from the upper left; of a ChArUco board as OpenCV numbers them; of a grid four for each
        tag, from its upper left corner clockwise, with tag 0 at the lower left and the next row of tags above it.
        """
        return _corners_m(self)

    @property
    def edges(self) -> Indices:
        """Pairs of corners (k, 2) with an edge between black and white from one to the other; along rows first."""
        return _edges(self)

    @property
    def text(self) -> str:
        """Say which board it is."""
        what = {"checkerboard": "inner corners", "charuco": "squares", "aprilgrid": "tags"}[self.kind]
        return f"{self.kind} of {self.columns} x {self.rows} {what}"


@lru_cache(maxsize=16)
def _corners_m(board: Board) -> Points3:
    if board.kind == "aprilgrid":
        tag, corner = np.divmod(np.arange(4 * board.columns * board.rows), 4)
        row, column = np.divmod(tag, board.columns)
        pitch = board.square_m + board.marker_m
        x = pitch * column + board.square_m * np.isin(corner, (1, 2))
        y = pitch * (board.rows - 1 - row) + board.square_m * np.isin(corner, (2, 3))
        corners = np.stack([x, y, np.zeros(len(x))], axis=1)
    else:
        columns, rows = _inner_corners(board)
        row, column = np.divmod(np.arange(rows * columns), columns)
        corners = board.square_m * np.stack([column, row, np.zeros_like(row)], axis=1).astype(np.float64)
    corners.flags.writeable = False
    return corners


@lru_cache(maxsize=16)
def _edges(board: Board) -> Indices:
    if board.kind == "aprilgrid":
        first = 4 * np.arange(board.columns * board.rows)[:, None]
        along, across = np.array([[0, 1], [3, 2]]), np.array([[0, 3], [1, 2]])
        return np.concatenate([(first[:, :, None] + sides).reshape(-1, 2) for sides in (along, across)])
    columns, rows = _inner_corners(board)
    number = np.arange(rows * columns).reshape(rows, columns)
    along = np.stack([number[:, :-1], number[:, 1:]], axis=-1).reshape(-1, 2)
    across = np.stack([number[:-1], number[1:]], axis=-1).reshape(-1, 2)
    return np.concatenate([along, across])


def _inner_corners(board: Board) -> tuple[int, int]:
    less = 0 if board.kind == "checkerboard" else 1
    return board.columns - less, board.rows - less


def board_of_size(
    size: str,
    square_mm: float,
    kind: BoardKind = "checkerboard",
    *,
    marker_mm: float | None = None,
    tag_spacing: float | None = None,
    dictionary: str | None = None,
) -> Board:
    """Return the board that a size such as "9x6" names.

    Args:
        size: columns and rows, as the kind counts them.
        square_mm: side of a square, or of a tag of a grid [mm].
        kind: of the board.
        marker_mm: side of a marker of a ChArUco board [mm]; None takes three quarters of a square.
        tag_spacing: distance between two tags of a grid over the side of a tag, as Kalibr states it; None takes 0.3.
        dictionary: of the markers, as OpenCV names it, with or without "DICT_".

    Raises:
        InputError: the size, the side of a square, or what belongs to another kind of board.
    """
    match = re.fullmatch(r"\s*(\d{1,3})\s*[xX,*]\s*(\d{1,3})\s*", size)
    least = 2 if kind == "checkerboard" else 1 if kind == "aprilgrid" else 3
    if not match:
        raise InputError(f"board {size!r}: give its {_COUNTED[kind]}")
    if not all(least <= int(number) <= _MOST for number in match.groups()):
        raise InputError(f"board {size!r}: both numbers are from {least} to {_MOST}; give its {_COUNTED[kind]}")
    columns, rows = int(match[1]), int(match[2])
    if kind == "checkerboard" and min(columns, rows) < 3 and max(columns, rows) < 4:
        raise InputError(f"board {size!r}: too few corners to tell a lens; use one with at least 4 x 3 inner corners")
    if not 0.1 <= square_mm <= 10_000.0:
        raise InputError(f"squares of {square_mm:g} mm: give the side of a square in millimeters, from 0.1 to 10000")
    _refuse_foreign(kind, marker_mm=marker_mm, tag_spacing=tag_spacing, dictionary=dictionary)
    square_m = square_mm / 1e3
    if kind == "checkerboard":
        return Board(kind, columns, rows, square_m)
    if kind == "aprilgrid":
        return Board(
            kind,
            columns,
            rows,
            square_m,
            square_m * _share(tag_spacing, _TAG_SPACING),
            _dictionary(dictionary or _TAGS),
        )
    marker_m = square_m * _MARKER_SHARE if marker_mm is None else marker_mm / 1e3
    if not 0.0 < marker_m < square_m:
        raise InputError(
            f"markers of {1e3 * marker_m:g} mm in squares of {square_mm:g} mm: a marker is smaller than its square"
        )
    board = Board(kind, columns, rows, square_m, marker_m, _dictionary(dictionary or _MARKERS))
    return board


def _refuse_foreign(kind: BoardKind, **given: float | str | None) -> None:
    """Refuse what says nothing about a kind of board."""
    known = {"checkerboard": (), "charuco": ("marker_mm", "dictionary"), "aprilgrid": ("tag_spacing", "dictionary")}[
        kind
    ]
    for name, value in given.items():
        if value is not None and name not in known:
            raise InputError(f"{name.replace('_', ' ')}: a {kind} has none; leave it out, or name the kind of board")


def _share(value: float | None, usual: float) -> float:
    if value is None:
        return usual
    if not 0.0 < value <= 5.0:
        raise InputError(f"tag spacing {value:g}: give the gap between two tags over the side of a tag, such as 0.3")
    return value


def _dictionary(name: str) -> str:
    import cv2

    full = name.strip()
    full = full if full.upper().startswith("DICT_") else f"DICT_{full}"
    known = {one.upper(): one for one in dir(cv2.aruco) if one.startswith("DICT_")}
    if full.upper() not in known:
        raise InputError(
            f"dictionary {name!r}: not one of OpenCV's; such as DICT_4X4_50, DICT_5X5_250 or DICT_APRILTAG_36h11"
        )
    return known[full.upper()]
