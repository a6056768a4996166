"""The search: which pictures are looked at, which views are chosen, and what is said about the others."""

from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.intrinsics import Board, BoardSearch, SearchProgress, board_search, search_boards
from calib_core.intrinsics.board_search import PictureOrder
from calib_core.measurements import TimeNs, Unsolvable

BOARD = Board("checkerboard", 5, 4, 0.03)


def drawn(
    shift: float = 0.0, *, tilt: float = 0.0, board: Board = BOARD, size: tuple[int, int] = (320, 240)
) -> np.ndarray:
    """Draw a board; it moves to the right with the shift [px] and turns with the tilt."""
    squares = np.add.outer(np.arange(board.rows + 1), np.arange(board.columns + 1)) % 2
    flat = np.kron(np.where(squares, 30, 220), np.ones((40, 40))).astype(np.uint8)
    flat = cv2.copyMakeBorder(flat, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=220)
    height, width = flat.shape
    before = np.float32([[0, 0], [width, 0], [width, height], [0, height]])
    after = before * 0.55 + np.float32([10 + shift, 15])
    after[1] += [-20 * tilt, 15 * tilt]
    after[2] += [-20 * tilt, -15 * tilt]
    shown = cv2.warpPerspective(flat, cv2.getPerspectiveTransform(before, after), size, borderValue=120)
    return cv2.cvtColor(cv2.GaussianBlur(shown, (0, 0), 0.7), cv2.COLOR_GRAY2BGR)


@dataclass
class Drawn:
    """Pictures that are drawn when they are asked for."""

    draw: list[Callable[[], np.ndarray]]
    rate_hz: float | None = None
    asked: list[int] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.draw)

    def name(self, index: int, /) -> str:
        return f"picture {index}"

    def time_ns(self, index: int, /) -> TimeNs | None:
        return None if self.rate_hz is None else TimeNs(round(index * 1e9 / self.rate_hz))

    def picture(self, index: int, /) -> np.ndarray:
        self.asked.append(index)
        return self.draw[index]()


def several() -> list[Callable[[], np.ndarray]]:
    return [lambda s=s, t=t: drawn(s, tilt=t) for s, t in ((0, 0.0), (25, 0.5), (50, 1.0), (60, 1.5), (10, 1.3))]


def searched(pictures: Drawn, board: Board = BOARD) -> BoardSearch:
    search = search_boards(pictures, board)
    assert isinstance(search, BoardSearch), search
    return search


def test_every_picture_of_a_few_is_searched_and_every_good_one_chosen() -> None:
    told: list[SearchProgress] = []
    search = search_boards(Drawn(several()), BOARD, progress=told.append)
    assert isinstance(search, BoardSearch)
    assert [view.index for view in search.views] == [0, 1, 2, 3, 4]
    assert search.complete
    assert search.left_out == ()
    assert [one.searched for one in told] == [1, 2, 3, 4, 5]
    assert told[-1].coverage is not None
    assert told[-1].coverage.counts.sum() == 100


def test_what_is_not_used_is_named_with_the_reason() -> None:
    def unreadable() -> np.ndarray:
        raise RecordingError("the file is cut off")

    other = Board("checkerboard", 7, 5, 0.03)
    odd = [
        lambda: cv2.GaussianBlur(drawn(25, tilt=0.5), (0, 0), 3.0),
        lambda: cv2.GaussianBlur(drawn(50, tilt=1.0), (0, 0), 0.8),
        unreadable,
        lambda: np.full((240, 320, 3), 90, dtype=np.uint8),
        lambda: drawn(-10, board=other),
    ]
    search = searched(Drawn([*several(), *odd]))
    assert [view.index for view in search.views] == [0, 1, 2, 3, 4]
    reasons = {one.index: one.reason for one in search.left_out}
    assert reasons[5].startswith("blurred: edges are ")
    assert reasons[6].startswith("the same view as picture 2")
    assert reasons[7] == "it cannot be read: the file is cut off"
    assert "is seen in it as a whole" in reasons[8]
    assert reasons[9] == "it shows a board of 7 x 5 inner corners"


@pytest.mark.parametrize(
    ("draw", "code", "words"),
    [
        (
            [lambda: np.zeros((240, 320, 3), np.uint8)] * 3,
            "no-board",
            "none of 3 pictures shows a checkerboard of 5 x 4",
        ),
        ([lambda: drawn(board=Board("checkerboard", 6, 4, 0.03))] * 3, "other-board", "show 6 x 4 inner corners"),
        ([*several(), *[lambda: drawn(size=(330, 250))] * 3], "mixed-sizes", "5 of 320 x 240, 3 of 330 x 250"),
        ([], "no-pictures", "there are no pictures"),
    ],
)
def test_a_search_without_a_result_says_why(draw: list[Callable[[], np.ndarray]], code: str, words: str) -> None:
    found = search_boards(Drawn(draw), BOARD)
    assert isinstance(found, Unsolvable)
    assert found.code == code
    assert words in found.reason
    assert found.hint


def test_a_few_pictures_of_another_size_are_named_and_the_rest_is_used() -> None:
    search = searched(Drawn([*several(), lambda: drawn(size=(330, 250))]))
    assert len(search.views) == 5
    assert search.left_out[0].reason == "it has 330 x 250 pixels, not 320 x 240"


def test_a_cancelled_search_goes_on_where_it_ended() -> None:
    first = Drawn(several())
    told: list[SearchProgress] = []
    part = search_boards(first, BOARD, progress=told.append, stopped=lambda: len(told) == 2)
    assert isinstance(part, BoardSearch)
    assert not part.complete
    again = Drawn(several())
    whole = search_boards(again, BOARD, known=part.found, searched=part.indices)
    assert isinstance(whole, BoardSearch)
    assert sorted(again.asked) == sorted(set(range(5)) - set(part.indices))
    assert [view.index for view in whole.views] == [0, 1, 2, 3, 4]
    assert whole.complete


def test_a_long_recording_is_searched_where_the_board_is(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = range(30_000, 31_800)  # a minute of half an hour

    def find(picture: np.ndarray, board: Board) -> tuple[np.ndarray, np.ndarray] | None:
        number = int(picture[0, 0, 0])
        return (np.arange(20), board.corners_m[:, :2] * 1e3 + [number % 97, number % 89]) if number in shown else None

    monkeypatch.setattr(board_search, "find_board", find)
    monkeypatch.setattr(board_search, "blur_px", lambda *_: 1.0)
    draw = [lambda index=index: np.full((4, 4, 1), index, dtype=np.int64) for index in range(54_000)]
    pictures = Drawn(draw, rate_hz=30.0)
    search = searched(pictures)
    assert len(pictures.asked) <= 420
    assert len([index for index in pictures.asked if index in shown]) > 100
    assert 30 <= len(search.views) <= 60
    assert not any("as a whole" in one.reason for one in search.left_out)


def test_a_search_for_a_board_that_is_another_one_ends_early() -> None:
    other = Board("checkerboard", 6, 4, 0.03)
    pictures = Drawn([lambda: drawn(board=other)] * 100)
    found = search_boards(pictures, BOARD)
    assert isinstance(found, Unsolvable)
    assert found.code == "other-board"
    assert len(pictures.asked) < 50


def test_one_picture_that_seems_to_show_the_board_does_not_hide_that_the_others_show_another() -> None:
    other = Board("checkerboard", 6, 4, 0.03)
    found = search_boards(Drawn([drawn, *[lambda s=s: drawn(4.0 * s, board=other) for s in range(7)]]), BOARD)
    assert isinstance(found, Unsolvable)
    assert found.code == "other-board"
    assert found.reason.startswith("1 of 8 pictures shows a checkerboard of 5 x 4 inner corners; 7 of the 7 ")
    assert found.hint.startswith("state 6x4 ")


def test_a_copy_of_a_picture_is_the_same_view_and_no_less_sharp() -> None:
    search = searched(Drawn([*several(), several()[2]]))
    assert [(one.index, one.reason) for one in search.left_out] == [(5, "the same view as picture 2")]


def test_the_first_pictures_of_a_long_recording_are_far_apart() -> None:
    order = PictureOrder(54_000, lambda index: TimeNs(index * 33_333_333))
    first = order.next_batch(())[:8]
    assert min(abs(a - b) for number, a in enumerate(first) for b in first[:number]) > 4_000
    assert order.next_batch(()) == []
    assert PictureOrder(0, lambda _: None).next_batch(()) == []
