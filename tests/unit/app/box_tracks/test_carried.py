"""Boxes in every frame, from what was stated and what was followed."""

from collections.abc import Mapping

import numpy as np
import pytest

from calib_core.measurements import TimeNs
from cocalib.box_tracks.carried import Followed, PlacedBox, carried_boxes, carried_tracks
from cocalib.box_tracks.stretches import MOST_FRAMES, Start, stretches_of
from cocalib.session import BoxEdges, BoxKeyframe, BoxTrack, RecordingFacts, Session

FACTS = RecordingFacts("drive", 1_700_000_000_000_000_000 + 100_000_000 * np.arange(30), width_px=640, height_px=480)


def at(frame: int) -> TimeNs:
    return TimeNs(int(FACTS.image_times[frame]))


def track(*stated: tuple[int, BoxEdges | None], is_carried: bool = True) -> BoxTrack:
    return BoxTrack("b1", "person", tuple(BoxKeyframe(at(frame), edges) for frame, edges in stated), is_carried)


def moving(first: int, count: int, start: BoxEdges, step_px: float, ended: str = "") -> Mapping[Start, Followed]:
    """A box that moves to the right as it is followed."""
    left, top, right, bottom = start
    boxes = (
        PlacedBox(first + place, (left + place * step_px, top, right + place * step_px, bottom), "followed", 0.9)
        for place in range(1, count + 1)
    )
    return {Start(first, start): Followed(tuple(boxes), ended)}


BOX: BoxEdges = (100.0, 50.0, 140.0, 150.0)


def test_a_box_is_carried_to_the_end_and_no_stretch_is_longer_than_the_limit() -> None:
    [stretch] = stretches_of(track((3, BOX)), FACTS)
    assert (stretch.start, stretch.last, stretch.is_cut) == (Start(3, BOX), 29, False)
    long = RecordingFacts("long", 33_000_000 * np.arange(2000), width_px=640, height_px=480)
    [stretch] = stretches_of(BoxTrack("b1", "car", (BoxKeyframe(TimeNs(0), BOX),)), long)
    assert (stretch.last, stretch.is_cut) == (MOST_FRAMES, True)
    [one] = carried_tracks(
        [BoxTrack("b1", "car", (BoxKeyframe(TimeNs(0), BOX),))], long, moving(0, MOST_FRAMES, BOX, 0.1)
    )
    assert f"after {MOST_FRAMES} frames" in one.note
    assert one.is_complete


def test_drift_is_taken_out_evenly_up_to_the_next_stated_box() -> None:
    target: BoxEdges = (160.0, 60.0, 200.0, 160.0)  # followed to 150, 50: off by 10 in both directions
    [one] = carried_tracks([track((0, BOX), (10, target))], FACTS, moving(0, 10, BOX, 5.0))
    assert [box.frame for box in one.boxes] == [*range(11)]
    assert one.boxes[0].edges_px == BOX
    assert one.boxes[5].edges_px == (130.0, 55.0, 170.0, 155.0)
    assert one.boxes[10].edges_px == target
    assert [box.kind for box in one.boxes] == ["stated", *["followed"] * 9, "stated"]
    assert one.note == ""


def test_a_box_that_was_lost_goes_straight_to_the_next_stated_one() -> None:
    target: BoxEdges = (200.0, 50.0, 240.0, 150.0)
    [one] = carried_tracks([track((0, BOX), (10, target))], FACTS, moving(0, 2, BOX, 2.0, ended="it is hidden"))
    assert [box.kind for box in one.boxes[:4]] == ["stated", "followed", "followed", "between"]
    assert one.at(6).edges_px == pytest.approx((152.0, 50.0, 192.0, 150.0))
    assert one.at(6).confidence == 0.0


def test_a_box_that_is_lost_says_where_and_why() -> None:
    [one] = carried_tracks([track((4, BOX))], FACTS, moving(4, 6, BOX, 2.0, ended="it leaves the picture"))
    assert one.boxes[-1].frame == 10
    assert "Ends in frame 11: it leaves the picture" in one.note
    assert one.at(11) is None


def test_hidden_ends_a_box_until_it_is_stated_again() -> None:
    again: BoxEdges = (300.0, 50.0, 340.0, 150.0)
    stated = track((0, BOX), (5, None), (12, again))
    [first, second] = stretches_of(stated, FACTS)
    assert (first.last, first.next_edges_px, second.start.frame) == (4, None, 12)
    [one] = carried_tracks([stated], FACTS, {**moving(0, 9, BOX, 1.0), **moving(12, 17, again, 1.0)})
    assert [box.frame for box in one.boxes] == [*range(5), *range(12, 30)]
    assert one.note == ""


def test_what_was_followed_before_a_correction_is_used_again() -> None:
    followed = moving(0, 29, BOX, 5.0)
    target: BoxEdges = (150.0, 50.0, 190.0, 150.0)
    [one] = carried_tracks([track((0, BOX), (10, target))], FACTS, followed)
    assert [box.frame for box in one.boxes] == [*range(11)]
    assert not one.is_complete  # what follows the correction is yet to come


def test_boxes_of_a_file_stay_in_their_frames_and_empty_frames_count() -> None:
    loaded = track((2, BOX), (4, BOX), is_carried=False)
    carried = carried_tracks([loaded], FACTS)
    assert [box.frame for box in carried[0].boxes] == [2, 4]
    assert carried[0].is_complete
    boxes = carried_boxes(carried, Session(boxes=(loaded,), empty_frames=(at(3),)), FACTS)
    assert [(frame.image_time, len(frame.boxes)) for frame in boxes] == [(at(2), 1), (at(3), 0), (at(4), 1)]
    assert boxes.image_size_px == (640, 480)
    [box] = boxes.frames[0].boxes
    assert (box.label, box.track, box.left_px, box.bottom_px) == ("person", "b1", 100.0, 150.0)
