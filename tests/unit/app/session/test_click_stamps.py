"""Clicks of a file whose stamps are no frame's: moved to the nearest frame and told, or refused."""

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.measurements import ReflectorClick, TimeNs
from cocalib.session.click_stamps import clicks_at_frames

START_NS = 1_700_000_000_123_456_789
IMAGE_TIMES = START_NS + 100_000_000 * np.array([0, 1, 2, 3, 50, 51, 52, 53])


def click(time_ns: int, name: str = "c1") -> ReflectorClick:
    return ReflectorClick(TimeNs(time_ns), name, 1.0, 2.0)


def test_clicks_with_the_stamps_of_frames_stay_as_they_are():
    clicks = tuple(click(int(time), f"c{index}") for index, time in enumerate(IMAGE_TIMES))
    found = clicks_at_frames(clicks, IMAGE_TIMES, source="clicks.json")
    assert found.clicks == clicks
    assert found.notes == ()


@pytest.mark.parametrize("off_ns", [-1_000, 1_211, 50_000_000, -50_000_000, -789, 211])
def test_a_click_within_half_a_frame_interval_is_moved_to_its_frame_and_told(off_ns):
    found = clicks_at_frames([click(int(IMAGE_TIMES[4]) + off_ns)], IMAGE_TIMES, source="clicks.json")
    assert found.clicks == (click(int(IMAGE_TIMES[4])),)
    assert len(found.notes) == (off_ns not in (-789, 211)), "what was rounded to microseconds needs no word"
    for line in found.notes:
        assert line.startswith("click c1 at 1700000005.")
        assert "frame 5 at 1700000005.123456789" in line


@pytest.mark.parametrize("time_ns", [START_NS + 2_000_000_000, int(IMAGE_TIMES[-1]) + 51_000_000])
def test_a_click_where_frames_are_missing_is_refused_with_the_nearest_one_named(time_ns):
    with pytest.raises(
        InputError, match=r"clicks.json: click c1 .* the nearest is frame \d at .* more than half a frame"
    ):
        clicks_at_frames([click(time_ns)], IMAGE_TIMES, source="clicks.json")


def test_one_foreign_click_is_set_aside_and_told_and_half_of_them_are_refused():
    own = [click(int(time), f"c{index}") for index, time in enumerate(IMAGE_TIMES[:3])]
    foreign = [click(START_NS + 60 * 10**9 + index, f"f{index}") for index in range(3)]
    found = clicks_at_frames([*own, foreign[0]], IMAGE_TIMES, source="clicks.json")
    assert found.clicks == tuple(own)
    (note,) = found.notes
    assert note.startswith("click f0 at")
    assert note.endswith("and is set aside")
    with pytest.raises(InputError, match=r"clicks.json: click f0 .* give the clicks of this recording"):
        clicks_at_frames([*own, *foreign], IMAGE_TIMES, source="clicks.json")


def test_with_one_frame_only_its_own_stamp_fits():
    assert clicks_at_frames([click(START_NS)], IMAGE_TIMES[:1], source="clicks.json").notes == ()
    with pytest.raises(InputError, match="the nearest is frame 1"):
        clicks_at_frames([click(START_NS + 1)], IMAGE_TIMES[:1], source="clicks.json")


def test_clicks_in_the_images_of_another_topic_are_refused_with_its_name():
    others = {"/left": IMAGE_TIMES + 20_000_000, "/right": IMAGE_TIMES + 30_000_000}
    clicks = [click(int(time) + 30_000_000, f"c{index}") for index, time in enumerate(IMAGE_TIMES)]
    with pytest.raises(InputError, match=r"clicks.json: its clicks .* of /right, .* --image-topic /right,"):
        clicks_at_frames(clicks, IMAGE_TIMES, source="clicks.json", others=lambda: others)
    assert len(clicks_at_frames([*clicks, click(START_NS)], IMAGE_TIMES, source="c", others=lambda: others).notes) == 8
