"""The sentences about a recording that is still being written."""

import numpy as np
import pytest

from calib_core.diagnostics.next_placement import Coverage, Place
from calib_core.results import NextPlacement
from cocalib.view import Pace, advice_words, pace_words


@pytest.mark.parametrize(
    ("pace", "words"),
    [
        (Pace("live"), "Following."),
        (Pace("live", age_s=0.42), "Following: the newest frame was 0.4 s old when it arrived."),
        (
            Pace("live", every_s=2.13, age_s=2.5),
            "Following: the newest frame was 2.5 s old when it arrived; the recorder writes every 2.1 s.",
        ),
        (Pace("live", every_s=0.2), "Following."),
        (
            Pace("quiet", quiet_s=12.4),
            "Nothing has been written for 12 s: the recorder has stopped or pauses. What it has written is kept.",
        ),
        (Pace("complete"), "The recording is complete."),
        (Pace("ended", problem="Drive.mcap: was truncated."), "Drive.mcap: was truncated."),
    ],
)
def test_the_pace_is_said_with_its_delay(pace, words):
    assert pace_words(pace) == words


def best(position: tuple[float, float, float], *, may_stop: bool) -> NextPlacement:
    return NextPlacement(np.array(position), np.array([1.0, 2.0]), 1.2, may_stop)


@pytest.mark.parametrize(
    ("coverage", "advised", "words"),
    [
        (
            Coverage(11, Place("left", 10.0, 15.0), one_height=False),
            None,
            "11 of 20 placements; next: to the left, 10 to 15 m away.",
        ),
        (
            Coverage(22, Place("right", 2.0, 5.0), one_height=True),
            None,
            "22 placements; next: to the right, 2 to 5 m away, on a box: all are at one height.",
        ),
        (
            Coverage(21, None, one_height=False),
            None,
            "21 placements, near and far and on both sides: enough for a calibration.",
        ),
        (
            Coverage(6, Place("left", 2.0, 5.0), one_height=False),
            best((8.0, -3.0, 0.0), may_stop=False),
            "6 placements; next: 8.0 m ahead, 3.0 m to the right.",
        ),
        (
            Coverage(1, None, one_height=False),
            best((8.0, 0.1, 0.0), may_stop=True),
            "1 placement: no further one would reduce the pose uncertainty noticeably.",
        ),
    ],
)
def test_the_next_placement_is_said_in_one_sentence(coverage, advised, words):
    assert advice_words(coverage, advised) == words
