"""Boxes in every frame, from what was stated and what was followed."""

import json
from collections.abc import Mapping

import numpy as np
import pytest

from calib_core.boxes import boxes_text
from calib_core.errors import InputError
from calib_core.measurements import Box, Boxes, FrameBoxes, TimeNs
from cocalib.session import BoxEdges, BoxKeyframe, BoxTrack, RecordingFacts, Session, apply
from cocalib.session.boxes_in_frames import (
    MOST_FRAMES,
    Followed,
    PlacedBox,
    Start,
    boxes_loaded,
    carried_boxes,
    carried_tracks,
    stretches_of,
)
from cocalib.workspace import read_sent_boxes

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


def test_a_box_is_carried_to_the_end_and_no_stretch_is_longer_than_the_limit():
    [stretch] = stretches_of(track((3, BOX)), FACTS)
    assert (stretch.start, stretch.last, stretch.is_cut) == (Start(3, BOX), 29, False)
    long = RecordingFacts("long", 33_000_000 * np.arange(2000), width_px=640, height_px=480)
    car = BoxTrack("b1", "car", (BoxKeyframe(TimeNs(0), BOX),))
    [stretch] = stretches_of(car, long)
    assert (stretch.last, stretch.is_cut) == (MOST_FRAMES, True)
    [one] = carried_tracks([car], long, moving(0, MOST_FRAMES, BOX, 0.1))
    assert f"after {MOST_FRAMES} frames" in one.note
    assert one.is_complete


def test_drift_is_taken_out_evenly_up_to_the_next_stated_box():
    target: BoxEdges = (160.0, 60.0, 200.0, 160.0)  # followed to 150, 50: off by 10 in both directions
    [one] = carried_tracks([track((0, BOX), (10, target))], FACTS, moving(0, 10, BOX, 5.0))
    assert [box.frame for box in one.boxes] == [*range(11)]
    assert one.boxes[0].edges_px == BOX
    assert one.boxes[5].edges_px == (130.0, 55.0, 170.0, 155.0)
    assert one.boxes[10].edges_px == target
    assert [box.kind for box in one.boxes] == ["stated", *["followed"] * 9, "stated"]
    assert one.note == ""


def test_a_box_that_is_lost_says_where_and_why_or_goes_straight_to_the_next_stated_one():
    [one] = carried_tracks([track((4, BOX))], FACTS, moving(4, 6, BOX, 2.0, ended="it leaves the picture"))
    assert one.boxes[-1].frame == 10
    assert "Ends in frame 11: it leaves the picture" in one.note
    assert one.at(11) is None
    target: BoxEdges = (200.0, 50.0, 240.0, 150.0)
    [one] = carried_tracks([track((0, BOX), (10, target))], FACTS, moving(0, 2, BOX, 2.0, ended="it is hidden"))
    assert [box.kind for box in one.boxes[:4]] == ["stated", "followed", "followed", "between"]
    assert one.at(6).edges_px == pytest.approx((152.0, 50.0, 192.0, 150.0))
    assert one.at(6).confidence == 0.0


def test_hidden_ends_a_box_until_it_is_stated_again():
    again: BoxEdges = (300.0, 50.0, 340.0, 150.0)
    stated = track((0, BOX), (5, None), (12, again))
    [first, second] = stretches_of(stated, FACTS)
    assert (first.last, first.next_edges_px, second.start.frame) == (4, None, 12)
    [one] = carried_tracks([stated], FACTS, {**moving(0, 9, BOX, 1.0), **moving(12, 17, again, 1.0)})
    assert [box.frame for box in one.boxes] == [*range(5), *range(12, 30)]
    assert one.note == ""


def test_what_was_followed_before_a_correction_is_used_again():
    followed = moving(0, 29, BOX, 5.0)
    target: BoxEdges = (150.0, 50.0, 190.0, 150.0)
    [one] = carried_tracks([track((0, BOX), (10, target))], FACTS, followed)
    assert [box.frame for box in one.boxes] == [*range(11)]
    assert not one.is_complete  # what follows the correction is yet to come


def test_boxes_of_a_file_stay_in_their_frames_and_empty_frames_count():
    loaded = track((2, BOX), (4, BOX), is_carried=False)
    carried = carried_tracks([loaded], FACTS)
    assert [box.frame for box in carried[0].boxes] == [2, 4]
    assert carried[0].is_complete
    boxes = carried_boxes(carried, Session(boxes=(loaded,), empty_frames=(at(3),)), FACTS)
    assert [(frame.image_time, len(frame.boxes)) for frame in boxes] == [(at(2), 1), (at(3), 0), (at(4), 1)]
    assert boxes.image_size_px == (640, 480)
    [box] = boxes.frames[0].boxes
    assert (box.label, box.track, box.left_px, box.bottom_px) == ("person", "b1", 100.0, 150.0)


def boxes(*frames: FrameBoxes) -> Boxes:
    return Boxes(frames, "boxes.json", (640, 480))


def kept(found: Boxes) -> Boxes:
    """The boxes after they were loaded into a session and written again."""
    session = apply(Session(), boxes_loaded(found, FACTS), FACTS)
    return carried_boxes(carried_tracks(session.boxes, FACTS), session, FACTS)


def test_boxes_and_empty_frames_of_our_own_file_come_back():
    person = [(Box(10.0 + frame, 20.0, 60.0 + frame, 200.0, "person", track="person-1"),) for frame in range(3)]
    car = (Box(300.0, 200.0, 420.0, 260.0, "car", track="car-7"),)
    in_frames = {0: person[0], 1: (*person[1], *car), 3: (), 4: person[2]}
    given = boxes(*(FrameBoxes(at(frame), found) for frame, found in in_frames.items()))
    found = read_sent_boxes(boxes_text(given).encode(), "boxes.json", FACTS)
    assert kept(found).frames == given.frames


def test_boxes_without_tracks_are_objects_of_their_own():
    alone = tuple(Box(x, 20.0, x + 40.0, 120.0, "person") for x in (10.0, 100.0))
    session = apply(Session(), boxes_loaded(boxes(FrameBoxes(at(2), alone), FrameBoxes(at(3), alone)), FACTS), FACTS)
    assert [track.id for track in session.boxes] == ["b1", "b2", "b3", "b4"]
    assert session.next_box == 5


def test_one_name_for_two_boxes_of_a_frame_or_for_two_classes_is_told_apart():
    places = ((10.0, 60.0, "person"), (200.0, 260.0, "person"), (400.0, 460.0, "car"))
    same = tuple(Box(left, 20.0, right, 200.0, label, track="7") for left, right, label in places)
    loaded = boxes_loaded(boxes(FrameBoxes(at(0), same)), FACTS)
    assert len({track.id for track in loaded.tracks}) == 3
    assert sorted(track.label for track in loaded.tracks) == ["car", "person", "person"]


def test_what_is_beyond_the_picture_is_cut_off_and_a_sliver_is_left_out():
    cut = Box(-30.0, 400.0, 60.0, 900.0, "person", track="a")
    sliver = Box(-80.0, 100.0, 1.0, 200.0, "person", track="b")
    loaded = boxes_loaded(boxes(FrameBoxes(at(1), (cut, sliver)), FrameBoxes(at(2), (sliver,))), FACTS)
    [track] = loaded.tracks
    assert track.keyframes[0].edges_px == (-0.5, 400.0, 60.0, 479.5)
    assert loaded.empty_frames == (at(2),)


def test_boxes_of_another_recording_and_other_files_are_refused_in_words():
    elsewhere = boxes(FrameBoxes(TimeNs(1_500_000_000_000_000_000), (Box(10.0, 20.0, 60.0, 200.0, "person"),)))
    for data in (boxes_text(elsewhere).encode(), b"%PDF-1.4", b"", json.dumps({"schema": "cocalib/clicks-1"}).encode()):
        with pytest.raises(InputError):
            read_sent_boxes(data, "../boxes.json", FACTS)
