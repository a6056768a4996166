"""boxes-1 and labels-1: what is written comes back, and what is wrong is said with its place."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.boxes import boxes_text, labels_text, read_labels
from calib_core.boxes.formats.own import own_boxes
from calib_core.errors import InputError
from calib_core.measurements import Box, Boxes, FrameBoxes, LabelledScan, ReturnLabels, TimeNs

TIMES = st.integers(0, 4_000_000_000_000_000_000).map(TimeNs)
EDGES = st.floats(-1e6, 1e6)
NAMES = st.text(st.characters(blacklist_categories=("Cs",)), max_size=20)


@st.composite
def one_box(draw: st.DrawFn) -> Box:
    left_px, right_px = sorted((draw(EDGES), draw(EDGES)))
    top_px, bottom_px = sorted((draw(EDGES), draw(EDGES)))
    return Box(left_px, top_px, right_px, bottom_px, draw(NAMES), draw(st.floats(0, 1)), draw(NAMES))


FRAMES = st.dictionaries(TIMES, st.lists(one_box(), max_size=3), max_size=4)
SIZES = st.none() | st.tuples(st.integers(1, 8000), st.integers(1, 8000))


@given(FRAMES, SIZES)
def test_boxes_that_are_written_come_back(frames, size):
    boxes = Boxes(tuple(FrameBoxes(time, tuple(frames[time])) for time in sorted(frames)), "boxes.json", size)

    assert own_boxes(json.loads(boxes_text(boxes)), "boxes.json") == boxes


@given(st.dictionaries(TIMES, st.lists(NAMES, max_size=5), max_size=4))
def test_labels_that_are_written_come_back(scans):
    labels = ReturnLabels(tuple(LabelledScan(time, tuple(scans[time])) for time in sorted(scans)), "labels.json")

    assert read_labels(labels_text(labels), "labels.json") == labels


FRAME = {"image_time": {"sec": 5, "nanosec": 0}, "boxes": [{"label": "person", "box_px": [1, 2, 3, 4]}]}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"schema": "cocalib/boxes-2"}, "schema: expected 'cocalib/boxes-1', found 'cocalib/boxes-2'"),
        ({"frames": [FRAME, FRAME]}, "frames[0] and frames[1] have the same stamp"),
        ({"frames": [{**FRAME, "boxes": [{"box_px": [3, 2, 1, 4]}]}]}, "frames[0].boxes[0].box_px: expected left, top"),
        ({"frames": [{**FRAME, "boxes": [{"box_px": [3, 2, 9]}]}]}, "frames[0].boxes[0].box_px"),
        ({"frames": [{**FRAME, "boxes_": []}]}, "unknown key; did you mean boxes?"),
        ({"frames": [{**FRAME, "boxes": [{"box_px": [1, 2, 3, float("nan")]}]}]}, "box_px[3]: nan"),
        ({"image_size_px": [0, 4]}, "image_size_px"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(change, words):
    document = {"schema": "cocalib/boxes-1", "image_size_px": [640, 480], "frames": [FRAME], **change}

    with pytest.raises(InputError) as error:
        own_boxes(document, "boxes.json")
    assert words in str(error.value)
