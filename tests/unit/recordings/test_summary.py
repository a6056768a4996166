"""The time for which radar and camera both have data."""

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S
from calib_core.recordings import describe, inspect_recording
from calib_core.recordings.summary import shared_time


def at(*parts):
    """Return stamps at 10 Hz in parts of (begin, length) [s]."""
    steps = [np.arange(round(length * 10) + 1) * 10**8 + round(begin * NS_PER_S) for begin, length in parts]
    return np.concatenate(steps).astype(np.int64)


@pytest.mark.parametrize(
    ("radar", "camera", "seconds", "stretches"),
    [
        (at((0, 10)), at((2, 20)), 8.0, 1),
        (at((0, 40), (4040, 40)), at((0, 40), (4040, 40)), 80.0, 2),
        (at((0, 4000)), at((0, 40), (3000, 40)), 80.0, 2),
        (at((0, 10)), at((20, 10)), 0.0, 0),
        (at((0, 10)), at((0, 4), (4.8, 5.2)), 9.2, 1),
        (at((0, 0)), at((0, 5)), 0.0, 1),
        (at((0, 5)), np.zeros(0, dtype=np.int64), 0.0, 0),
        (np.zeros(3, dtype=np.int64), np.zeros(2, dtype=np.int64), 0.0, 1),
    ],
    ids=["overlap", "pauses of both", "pauses of one", "apart", "a dropout", "one scan", "no camera", "equal times"],
)
def test_the_time_of_both_leaves_out_pauses(radar, camera, seconds, stretches):
    for a, b in ((radar, camera), (camera, radar)):
        found = shared_time(a, b)
        assert found.seconds == pytest.approx(seconds)
        assert found.stretches == stretches


def test_a_pause_of_an_hour_is_not_counted_as_data_of_both(ros1, write, plain, jpeg):
    rows = plain(ros1, jpeg, n=20)
    late = plain(ros1, jpeg, n=20, radar_shift_ns=3600 * NS_PER_S, camera_shift_ns=3600 * NS_PER_S)
    later = [(topic, time + 3600 * NS_PER_S, message) for topic, time, message in late]
    with inspect_recording(write(ros1, [*rows, *later])) as recording:
        text = describe(recording)
    assert "radar and camera both have data for 3.7 s, in 2 stretches" in text


def test_sensors_that_never_have_data_together_are_told(ros1, write, plain, jpeg):
    rows = plain(ros1, jpeg, n=20, radar_shift_ns=-9 * NS_PER_S)
    rows = [(topic, time - (9 * NS_PER_S if "radar" in topic else 0), message) for topic, time, message in rows]
    with inspect_recording(write(ros1, rows)) as recording:
        assert "radar and camera never have data at the same time" in describe(recording)
