"""Boxes of a file become tracks of the session, and come back as they were."""

import json

import numpy as np
import pytest

from calib_core.boxes import boxes_text
from calib_core.detections import Box, Boxes, FrameBoxes
from calib_core.errors import InputError
from calib_core.measurements import TimeNs
from cocalib.box_tracks.carried import carried_boxes, carried_tracks
from cocalib.box_tracks.loading import boxes_loaded, read_sent_boxes
from cocalib.session import RecordingFacts, Session, apply

FACTS = RecordingFacts("drive", 1_700_000_000_000_000_000 + 100_000_000 * np.arange(6), width_px=640, height_px=480)


def at(frame: int) -> TimeNs:
    return TimeNs(int(FACTS.image_times[frame]))


def boxes(*frames: FrameBoxes) -> Boxes:
    return Boxes(frames, "boxes.json", (640, 480))


def kept(found: Boxes) -> Boxes:
    """The boxes after they were loaded into a session and written again."""
    session = apply(Session(), boxes_loaded(found, FACTS), FACTS)
    return carried_boxes(carried_tracks(session.boxes, FACTS), session, FACTS)


def test_boxes_and_empty_frames_of_our_own_file_come_back() -> None:
    person = [Box(10.0 + frame, 20.0, 60.0 + frame, 200.0, "person", track="person-1") for frame in range(3)]
    car = Box(300.0, 200.0, 420.0, 260.0, "car", track="car-7")
    given = boxes(
        FrameBoxes(at(0), (person[0],)),
        FrameBoxes(at(1), (person[1], car)),
        FrameBoxes(at(3), ()),
        FrameBoxes(at(4), (person[2],)),
    )
    found = read_sent_boxes(boxes_text(given).encode(), "boxes.json", FACTS)
    assert kept(found).frames == given.frames


def test_boxes_without_tracks_are_objects_of_their_own() -> None:
    alone = tuple(Box(x, 20.0, x + 40.0, 120.0, "person") for x in (10.0, 100.0))
    session = apply(Session(), boxes_loaded(boxes(FrameBoxes(at(2), alone), FrameBoxes(at(3), alone)), FACTS), FACTS)
    assert [track.id for track in session.boxes] == ["b1", "b2", "b3", "b4"]
    assert session.next_box == 5


def test_one_name_for_two_boxes_of_a_frame_or_for_two_classes_is_told_apart() -> None:
    same = (
        Box(10.0, 20.0, 60.0, 200.0, "person", track="7"),
        Box(200.0, 20.0, 260.0, 200.0, "person", track="7"),
        Box(400.0, 20.0, 460.0, 200.0, "car", track="7"),
    )
    loaded = boxes_loaded(boxes(FrameBoxes(at(0), same)), FACTS)
    assert len({track.id for track in loaded.tracks}) == 3
    assert sorted(track.label for track in loaded.tracks) == ["car", "person", "person"]


def test_what_is_beyond_the_picture_is_cut_off_and_a_sliver_is_left_out() -> None:
    cut = Box(-30.0, 400.0, 60.0, 900.0, "person", track="a")
    sliver = Box(-80.0, 100.0, 1.0, 200.0, "person", track="b")
    loaded = boxes_loaded(boxes(FrameBoxes(at(1), (cut, sliver)), FrameBoxes(at(2), (sliver,))), FACTS)
    [track] = loaded.tracks
    assert track.keyframes[0].edges_px == (-0.5, 400.0, 60.0, 479.5)
    assert loaded.empty_frames == (at(2),)


def test_boxes_of_another_recording_and_other_files_are_refused_in_words() -> None:
    elsewhere = boxes(FrameBoxes(TimeNs(1_500_000_000_000_000_000), (Box(10.0, 20.0, 60.0, 200.0, "person"),)))
    for data in (boxes_text(elsewhere).encode(), b"%PDF-1.4", b"", json.dumps({"schema": "cocalib/clicks-1"}).encode()):
        with pytest.raises(InputError):
            read_sent_boxes(data, "../boxes.json", FACTS)
