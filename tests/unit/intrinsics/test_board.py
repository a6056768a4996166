"""Boards: where their corners are, and how they are named."""

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.intrinsics import Board, BoardKind, board_of_size


def test_a_checkerboard_is_named_by_its_inner_corners() -> None:
    board = board_of_size(" 9X6 ", 22.14)
    assert (board.columns, board.rows, board.square_m) == (9, 6, 0.02214)
    np.testing.assert_allclose(board.corners_m[10], [0.02214, 0.02214, 0.0])
    assert len(board.corners_m) == 54


def test_a_grid_counts_its_tags_from_the_lower_left_and_their_corners_clockwise() -> None:
    board = board_of_size("3x2", 50.0, "aprilgrid", tag_spacing=0.2)
    corners = board.corners_m[:, :2]
    np.testing.assert_allclose(corners[:4], [[0.0, 0.06], [0.05, 0.06], [0.05, 0.11], [0.0, 0.11]], atol=1e-12)
    np.testing.assert_allclose(corners[4] - corners[0], [0.06, 0.0], atol=1e-12)
    np.testing.assert_allclose(corners[12] - corners[0], [0.0, -0.06], atol=1e-12)


@pytest.mark.parametrize(
    "board",
    [
        Board("checkerboard", 5, 4, 0.03),
        Board("charuco", 5, 4, 0.03, 0.02, "DICT_5X5_100"),
        Board("aprilgrid", 3, 2, 0.03, 0.01, "DICT_APRILTAG_36h11"),
    ],
)
def test_edges_are_as_long_as_a_square(board: Board) -> None:
    ends = board.corners_m[board.edges]
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), 0.03)
    assert len({tuple(sorted(edge)) for edge in board.edges.tolist()}) == len(board.edges)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("9", 22.0), "inner corners along a row .* such as 9x6"),
        (("9x", 22.0), "inner corners"),
        (("1x6", 22.0), "inner corners"),
        (("3x2", 22.0), "too few corners"),
        (("9x6", 0.0), "side of a square in millimetres"),
        (("9x6", float("nan")), "side of a square in millimetres"),
        (("2x2", 22.0, "charuco"), "squares along a row"),
    ],
)
def test_what_is_no_board_is_refused(arguments: tuple[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        board_of_size(*arguments)


@pytest.mark.parametrize(
    ("kind", "given", "words"),
    [
        ("charuco", {"marker_mm": 30.0}, "a marker is smaller than its square"),
        ("charuco", {"dictionary": "DICT_9X9"}, "not one of OpenCV's"),
        ("charuco", {"tag_spacing": 0.3}, "a charuco has none"),
        ("checkerboard", {"marker_mm": 10.0}, "a checkerboard has none"),
        ("aprilgrid", {"tag_spacing": 0.0}, "gap between two tags"),
    ],
)
def test_what_belongs_to_another_board_is_refused(kind: BoardKind, given: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        board_of_size("6x6", 25.0, kind, **given)  # type: ignore[arg-type]


def test_a_dictionary_may_be_named_without_its_prefix() -> None:
    assert board_of_size("6x6", 25.0, "charuco", dictionary="4x4_50").dictionary == "DICT_4X4_50"
