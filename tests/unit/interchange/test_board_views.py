"""Views of a board are kept bit for bit, and a file that cannot be right is refused in words."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.interchange.own.board_views_json import (
    BoardViews,
    PictureSource,
    read_board_views,
    runs_of,
    write_board_views,
)
from calib_core.intrinsics import BoardCorners, board_of_size
from calib_core.measurements import TimeNs

BOARD = board_of_size("9x6", 22.14)
SOURCE = PictureSource("board.mp4", 9, 64 * "a")


def kept() -> BoardViews:
    pixels = np.random.default_rng(2).uniform(0.0, 470.0, (54, 2))
    views = (
        BoardCorners(1, "frame 2", TimeNs(1_700_000_000_123_456_789), (640, 480), np.arange(54), pixels, 1.25),
        BoardCorners(4, "frame 5", None, (640, 480), np.array([0, 7, 53]), pixels[:3]),
    )
    return BoardViews(BOARD, SOURCE, views, runs_of({0, 1, 2, 4, 7}))


def test_views_come_back_as_they_were() -> None:
    text = write_board_views(kept())
    found = read_board_views(text)
    assert (found.board, found.source, found.searched) == (BOARD, SOURCE, ((0, 2), (4, 4), (7, 7)))
    assert found.searched_indices() == (0, 1, 2, 4, 7)
    for view, same in zip(kept().views, found.views, strict=True):
        assert np.array_equal(view.pixels_px, same.pixels_px)
        assert np.array_equal(view.corner_ids, same.corner_ids)
        assert (view.name, view.time_ns, view.index) == (same.name, same.time_ns, same.index)
    assert found.views[0].blur_px == 1.25
    assert np.isnan(found.views[1].blur_px)
    assert write_board_views(found) == text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda document: document["views"][0].update(index=9), r"views\[0\].index: 9 of 9 pictures"),
        (lambda document: document["views"][1].update(corner_ids=[0, 7, 54]), "be below 54"),
        (lambda document: document["views"][1].update(corner_ids=[7, 0, 5]), "must ascend"),
        (lambda document: document["views"][1].update(index=1), "two are of the same picture"),
        (lambda document: document["views"][1]["pixels_px"].__setitem__(0, [900, 5]), "outside its picture"),
        (lambda document: document.update(searched=[[3, 20]]), r"searched\[0\]: 3 to 20 of 9 pictures"),
        (lambda document: document.update(serched=[]), "unknown key"),
    ],
)
def test_a_file_that_cannot_be_right_is_refused(change: Callable[[dict[str, Any]], None], words: str) -> None:
    document = json.loads(write_board_views(kept()))
    change(document)
    with pytest.raises(InputError, match=words):
        read_board_views(json.dumps(document), "views.json")


def test_views_of_another_board_or_of_other_pictures_are_refused() -> None:
    with pytest.raises(InputError, match=r"22\.14 mm, but the board is a checkerboard of 8 x 6"):
        kept().require_same(board_of_size("8x6", 22.14), SOURCE, file="views.json")
    with pytest.raises(InputError, match="give the same pictures"):
        kept().require_same(BOARD, PictureSource("board.mp4", 9, 64 * "b"), file="views.json")
