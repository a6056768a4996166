"""Topics of boxes, written by rosbags: found by their fields, read, and matched to the frames they were made from."""

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.recordings import RecordingOptions, describe, inspect_recording
from tests.unit.recordings.box_messages import EXPECTED, FIRST_FRAME_NS, KINDS, recorded


@pytest.mark.parametrize("kind", KINDS)
def test_boxes_belong_to_the_frames_they_were_made_from(ros, write, jpeg, kind):
    path = write(ros, recorded(ros, jpeg, kind))

    with inspect_recording(path) as recording:
        boxes = recording.boxes("/boxes")
        words = describe(recording)

    label, score, track = KINDS[kind][2]
    assert boxes.times_ns.tolist() == [FIRST_FRAME_NS + at * 100_000_000 for at in (0, 2, 4)]
    for frame in boxes:
        (box,) = frame.boxes
        edges = (box.left_px, box.top_px, box.right_px, box.bottom_px)
        np.testing.assert_allclose(edges, (EXPECTED.left_px, EXPECTED.top_px, EXPECTED.right_px, EXPECTED.bottom_px))
        assert (box.label, box.score, box.track) == (label, score, track)
    assert "/boxes: boxes around" in words
    assert "problem" not in words


def test_boxes_find_frames_that_are_read_by_receive_times(write, ros2, jpeg):
    path = write(ros2, recorded(ros2, jpeg, "new"))

    with inspect_recording(path, RecordingOptions(clock="receive")) as recording:
        boxes = recording.boxes("/boxes")
        expected = recording.image_times[[0, 2, 4]].tolist()

    assert boxes.times_ns.tolist() == expected
    assert expected[0] == FIRST_FRAME_NS + 30_000_000


@pytest.mark.parametrize(
    ("topic", "shift_ns", "words"),
    [
        ("/missing", 0, "no messages of a topic /missing; topics with boxes: /boxes"),
        ("/radar/points", 0, "topic /radar/points (sensor_msgs/PointCloud2) has no boxes around objects"),
        ("/boxes", 40_000_000, "4 of 4 annotated frames have the stamp of no recorded frame"),
        ("/boxes", 10**13, "is it of another recording?"),
    ],
)
def test_other_topics_and_other_recordings_are_refused(write, ros1, jpeg, topic, shift_ns, words):
    path = write(ros1, recorded(ros1, jpeg, "new", shift_ns=shift_ns))

    with inspect_recording(path) as recording, pytest.raises(InputError) as error:
        recording.boxes(topic)
    assert words in str(error.value)
