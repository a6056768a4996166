"""Boxes are followed a few pictures at a time, the newest first, and what was followed is kept."""

import numpy as np
import pytest

from calib_core.errors import InputError
from cocalib.session.boxes_in_frames import Start, Stretch
from cocalib.web.channel.boxes import BoxFollower
from tests.unit.boxes.test_tracking import edges, picture

WAY = [(60 + 3.0 * step, 100.0) for step in range(60)]


class Pictures:
    """The moving rectangle; counts which pictures are decoded."""

    def __init__(self, scale: float = 1.0, broken: int | None = None) -> None:
        self.read: list[int] = []
        self._scale = scale
        self._broken = broken

    def __call__(self, frame: int) -> tuple[np.ndarray, float]:
        self.read.append(frame)
        if frame == self._broken:
            raise InputError(f"frame {frame + 1} cannot be decoded")
        return picture(WAY[frame], seed=frame), self._scale


def follower(pictures: Pictures) -> BoxFollower:
    return BoxFollower(pictures, lambda: len(WAY))


def stretch(first: int, last: int) -> Stretch:
    return Stretch(Start(first, edges(WAY[first])), last)


def test_a_box_is_followed_to_the_end_of_its_stretch_and_no_farther():
    pictures = Pictures()
    work = follower(pictures)
    work.want([stretch(5, 20)])
    while not work.is_done:
        work.go_on(0.0)
    found = work.followed[Start(5, edges(WAY[5]))]
    assert [box.frame for box in found.boxes] == [*range(6, 21)]
    assert found.boxes[-1].edges_px == pytest.approx(edges(WAY[20]), abs=2.0)
    assert max(pictures.read) == 20
    assert work.progress == (15, 15)


def test_a_longer_stretch_goes_on_where_the_shorter_one_ended():
    pictures = Pictures()
    work = follower(pictures)
    work.want([stretch(0, 10)])
    work.go_on(60.0)
    before = len(pictures.read)
    work.want([stretch(0, 14)])
    assert not work.is_done
    work.go_on(60.0)
    assert pictures.read[before:] == [11, 12, 13, 14]


def test_the_last_of_those_wanted_comes_first_and_others_are_dropped():
    pictures = Pictures()
    work = follower(pictures)
    work.want([stretch(0, 30), stretch(40, 45)])
    work.go_on(0.0)
    assert min(pictures.read) == 40
    work.want([stretch(0, 30)])
    work.go_on(0.0)
    assert list(work.followed) == [Start(0, edges(WAY[0]))]


@pytest.mark.parametrize(("broken", "count", "words"), [(None, 3, "stopped"), (8, 7, "frame 9 cannot be decoded")])
def test_stopping_and_a_frame_that_cannot_be_decoded_end_the_box_with_the_reason(broken, count, words):
    work = follower(Pictures(broken=broken))
    work.want([stretch(0, 40)])
    for _ in range(3 if broken is None else 40):
        work.go_on(0.0)
    work.stop()
    assert work.is_done
    [found] = work.followed.values()
    assert len(found.boxes) == count
    assert words in found.ended


def test_boxes_of_halved_pictures_are_those_of_the_recorded_ones():
    work = follower(Pictures(scale=0.5))
    left, top, right, bottom = (2 * (value + 0.5) - 0.5 for value in edges(WAY[0]))
    start = Start(0, (left, top, right, bottom))
    work.want([Stretch(start, 20)])
    work.go_on(60.0)
    expected = [2 * (value + 0.5) - 0.5 for value in edges(WAY[20])]
    assert work.followed[start].boxes[-1].edges_px == pytest.approx(expected, abs=3.0)
