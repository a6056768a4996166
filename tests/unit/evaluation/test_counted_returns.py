"""A frame's scan is the nearest by the recorded stamps, within half a scan period."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.evaluation.counted_returns import (
    Sightings,
    box_table,
    boxes_in_bearing,
    frame_scans,
    longest_gap_s,
    match_by_bearing,
)
from calib_core.measurements import NS_PER_S, Box, Boxes, Cuboid, FrameBoxes, TimeNs

SCANS = np.array([0, 100, 200, 300, 700], dtype=np.int64) * 1_000_000


def frames(*milliseconds: float) -> np.ndarray:
    return np.array([round(time * 1e6) for time in milliseconds], dtype=np.int64)


@pytest.mark.parametrize(
    ("times_ms", "scans", "limit", "taken"),
    [
        ((0, 49, 51, 250, 349, 351), SCANS, {}, [0, 0, 1, 2, 3, -1]),
        ((50, 150), SCANS, {}, [0, 1]),  # of two equally near the earlier
        ((351, 520), SCANS, {"max_gap_s": 0.2}, [3, 4]),
        ((1,), SCANS, {"max_gap_s": 0.0}, [-1]),
        ((1, 2), SCANS[:0], {}, [-1, -1]),
    ],
)
def test_the_nearest_scan_within_half_a_period_or_a_stated_limit_is_taken(times_ms, scans, limit, taken):
    assert frame_scans(frames(*times_ms), scans, **limit).tolist() == taken


def test_the_period_is_the_median_so_gaps_do_not_widen_it():
    assert longest_gap_s(SCANS) == 0.05


CAMERA = Camera("pinhole", 1000, 600, np.array([[800.0, 0.0, 499.5], [0.0, 800.0, 299.5], [0.0, 0.0, 1.0]]))
FRAMES = 40


def sightings(*paths: tuple[np.ndarray, np.ndarray]) -> Sightings:
    """Return one sighting per frame and target from azimuths [deg] and ranges [m]; NaN where it is not seen."""
    rows = [
        (frame, target, azimuth[frame], range_m[frame])
        for frame in range(FRAMES)
        for target, (azimuth, range_m) in enumerate(paths)
        if np.isfinite(azimuth[frame])
    ]
    frames, targets, azimuths, ranges = (np.array(column) for column in zip(*rows, strict=True))
    points = np.stack([ranges, np.zeros(len(rows)), np.zeros(len(rows))], axis=1)
    names = tuple(f"target-{i}" for i in range(len(paths)))
    return Sightings(
        names, frames, targets, np.deg2rad(azimuths), ranges, np.arange(len(rows)), points, np.full(len(rows), np.nan)
    )


def boxes(*paths: np.ndarray, width_px: float = 30.0, tracks: bool = True) -> Boxes:
    """Return boxes around the bearings [deg] of objects, positive to the left; NaN where an object has none."""
    frames = []
    for frame in range(FRAMES):
        found = []
        for number, bearing in enumerate(paths):
            if np.isfinite(bearing[frame]):
                column = 499.5 - 800.0 * np.tan(np.deg2rad(bearing[frame]))
                track = f"o{number}" if tracks else ""
                found.append(Box(column - width_px / 2, 250, column + width_px / 2, 350, "person", track=track))
        frames.append(FrameBoxes(TimeNs(frame * NS_PER_S // 10), tuple(found)))
    return Boxes(tuple(frames), "boxes.json")


def matched(found: Sightings, given: Boxes) -> dict[int, set[str]]:
    """Return the names of the boxes that each target was given."""
    table = box_table(given)
    matches = match_by_bearing(found, table, CAMERA)
    return {
        target: {table.names[box] if box >= 0 else "" for box in matches.boxes[found.targets == target].tolist()}
        for target in range(len(found.names))
    }


ACROSS = np.linspace(-25.0, 25.0, FRAMES)
STILL = np.full(FRAMES, 15.0)
FAR = np.full(FRAMES, 20.0)


def test_targets_find_their_boxes_whatever_the_camera_is_turned_by():
    for turn in (0.0, 12.0, -33.0, 90.0):
        found = sightings((ACROSS - turn, FAR), (STILL - turn, FAR))
        assert matched(found, boxes(ACROSS, STILL)) == {0: {"o0"}, 1: {"o1"}}


def test_the_turn_and_the_parallax_are_found():
    near = np.linspace(4.0, 20.0, FRAMES)
    bearing = ACROSS + 5.0 + np.rad2deg(0.4 / near)
    matches = match_by_bearing(sightings((ACROSS, near)), box_table(boxes(bearing)), CAMERA)

    expected = np.deg2rad(5.0) + 0.4 / near
    assert np.abs(matches.bearings.turn_rad + matches.bearings.parallax_m / near - expected).max() < np.deg2rad(1.0)


def test_two_who_cross_keep_their_boxes():
    found = sightings((ACROSS, FAR), (-ACROSS, FAR))
    assert matched(found, boxes(ACROSS, -ACROSS)) == {0: {"o0"}, 1: {"o1"}}


def test_a_target_is_given_one_box_track_over_its_life_and_not_the_nearest_box_of_each_frame():
    wobbling = ACROSS + np.where(np.arange(FRAMES) % 2, 1.5, -1.5)
    beside = ACROSS + 2.5
    assert matched(sightings((wobbling, FAR)), boxes(ACROSS, beside))[0] == {"o0"}


def test_a_box_has_one_target_and_the_other_stays_without():
    found = sightings((ACROSS, FAR), (ACROSS + 2.0, np.full(FRAMES, 40.0)), (STILL, FAR))
    assert matched(found, boxes(ACROSS, STILL)) == {0: {"o0"}, 1: {""}, 2: {"o1"}}


def test_a_target_far_from_the_cuboid_of_a_box_is_not_its_own():
    given = boxes(ACROSS)
    behind = sightings((ACROSS, np.full(FRAMES, 40.0)), (ACROSS + 1.0, FAR))
    assert matched(behind, given)[0] == {"o0"}
    frames = [
        replace(one, boxes=tuple(replace(box, cuboid=Cuboid((0.0, 0.0, 21.0), 0.5, 0.5, 0.0)) for box in one.boxes))
        for one in given
    ]
    assert matched(behind, replace(given, frames=tuple(frames))) == {0: {""}, 1: {"o0"}}


def test_parts_of_one_target_share_its_box():
    long_one = sightings((ACROSS, FAR), (ACROSS + 0.5, np.full(FRAMES, 23.0)))
    assert matched(long_one, boxes(ACROSS, width_px=60.0)) == {0: {"o0"}, 1: {"o0"}}


def test_a_match_holds_for_a_life_and_a_bearing_for_a_frame():
    astray = STILL.copy()
    astray[30:36] += 12.0
    found, table = sightings((ACROSS, FAR), (astray, FAR)), box_table(boxes(ACROSS, STILL))
    matches = match_by_bearing(found, table, CAMERA)
    in_bearing = boxes_in_bearing(matches, found, table, CAMERA)

    assert (matches.boxes >= 0).all()
    lost = np.flatnonzero(in_bearing < 0)
    assert found.frames[lost].tolist() == [*range(30, 36)]
    assert (found.targets[lost] == 1).all()
    assert (in_bearing == matches.boxes).sum() == len(in_bearing) - 6


def test_targets_that_follow_one_another_can_have_one_box():
    first, then = ACROSS.copy(), ACROSS.copy()
    first[20:], then[:24] = np.nan, np.nan
    assert matched(sightings((first, FAR), (then, FAR)), boxes(ACROSS)) == {0: {"o0"}, 1: {"o0"}}


def test_a_target_elsewhere_is_without_a_box_and_counts_only_if_it_is_in_the_image():
    inside, outside = np.full(FRAMES, -12.0), np.full(FRAMES, 50.0)
    found = sightings((ACROSS, FAR), (inside, FAR), (outside, FAR))
    matches = match_by_bearing(found, box_table(boxes(ACROSS)), CAMERA)

    assert (matches.boxes[found.targets > 0] == -1).all()
    assert matches.counts[found.targets == 1].all()
    assert not matches.counts[found.targets == 2].any()


def test_without_any_box_everything_counts():
    matches = match_by_bearing(sightings((ACROSS, FAR)), box_table(boxes()), CAMERA)
    assert matches.counts.all()
    assert matches.bearings is None


def test_boxes_without_tracks_are_followed_through_a_crossing():
    given = boxes(ACROSS, -ACROSS, tracks=False)
    table = box_table(given)
    left_to_right = [int(table.tracks[table.frames == frame][0]) for frame in range(FRAMES)]
    assert len(set(left_to_right)) == 1
    assert len(set(table.tracks.tolist())) == 2


def test_boxes_of_other_classes_are_other_objects():
    frames = tuple(
        FrameBoxes(TimeNs(frame), (Box(10, 10, 20, 20, label),)) for frame, label in enumerate(("car", "person", "car"))
    )
    assert box_table(Boxes(frames, "boxes.json")).tracks.tolist() == [0, 1, 0]
