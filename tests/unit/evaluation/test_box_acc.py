"""Acc: by hand, by an independent script, and why a turned calibration does not profit."""

import dataclasses

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.evaluation.box_acc import AXES, grouped_error, judged_by_boxes
from calib_core.evaluation.counted_returns import counted_returns, renamed_classes
from calib_core.evaluation.target_tracking import find_targets
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import (
    NS_PER_S,
    Box,
    Boxes,
    FrameBoxes,
    LabelledScan,
    RadarScans,
    ReturnLabels,
    TimeNs,
)
from tests.box_figures import box_figures
from tests.independent_acc import acc as independent_acc
from tests.scans import scan_of
from tests.street import CAMERA, OPTICAL_FROM_RADAR, TRUE_POSE, Street, street, turned

AHEAD = RigidTransform(OPTICAL_FROM_RADAR, np.zeros(3))
PINHOLE = Camera("pinhole", 200, 100, np.array([[100.0, 0.0, 100.0], [0.0, 100.0, 50.0], [0.0, 0.0, 1.0]]))


@pytest.fixture(scope="module")
def crowd() -> Street:
    return street(people=3, seconds=30.0, seed=2)


def by_hand() -> tuple[RadarScans, Boxes, ReturnLabels]:
    """Return three frames: a person with 2 of 3 returns inside, one with 0 of 1, a car with 1 of 1 and a person with 1 of 1.

    A point at (10, y, z) is at column 100 - 10 y and row 50 - 10 z.
    """
    scans = RadarScans.from_scans(
        [
            scan_of(1.0, [(10, 1, 0), (10, 1.2, 0), (10, 3, 0), (10, -5, 0)], doppler_mps=1.0),
            scan_of(2.0, [(10, 0, 0)], doppler_mps=1.0),
            scan_of(3.0, [(20, 0, 0), (10, 4, 1)], doppler_mps=1.0),
        ]
    )
    labels = ReturnLabels(
        (
            LabelledScan(TimeNs(1 * NS_PER_S), ("a", "a", "a", "")),
            LabelledScan(TimeNs(2 * NS_PER_S), ("a",)),
            LabelledScan(TimeNs(3 * NS_PER_S), ("c", "b")),
        ),
        "labels.json",
    )
    frames = (
        FrameBoxes(TimeNs(NS_PER_S), (Box(88, 40, 90, 60, "person", track="a"),)),
        FrameBoxes(TimeNs(2 * NS_PER_S), (Box(0, 0, 99, 99, "person", track="a"),)),
        FrameBoxes(
            TimeNs(3 * NS_PER_S), (Box(100, 50, 100, 50, "car", track="c"), Box(50, 30, 70, 50, "person", track="b"))
        ),
    )
    return scans, Boxes(frames, "boxes.json", (200, 100)), labels


def test_acc_is_the_mean_share_of_frames_and_zero_frames_stay():
    scans, boxes, labels = by_hand()
    figures = box_figures(AHEAD, PINHOLE, scans, boxes, labels=labels)

    assert [(frame.inside, frame.returns) for frame in figures.frames] == [(2, 3), (0, 1), (2, 2)]
    assert figures.acc == pytest.approx((2 / 3 + 0 + 1) / 3)
    assert figures.acc_without_zero_frames == pytest.approx((2 / 3 + 1) / 2)
    by_class = {one.label: one for one in figures.classes}
    assert by_class["person"].acc == pytest.approx((2 / 3 + 0 + 1) / 3)
    assert (by_class["car"].acc, by_class["car"].frames) == (1.0, 1)


def test_returns_name_their_frames_also_after_a_frame_without_returns_and_boxes():
    scans, boxes, labels = by_hand()
    first = TimeNs(NS_PER_S // 2)
    scans = RadarScans.from_scans([scan_of(0.5, []), *(scans.scan(number) for number in range(3))])
    boxes = dataclasses.replace(boxes, frames=(FrameBoxes(first, ()), *boxes.frames))
    labels = dataclasses.replace(labels, scans=(LabelledScan(first, ()), *labels.scans))
    figures = box_figures(AHEAD, PINHOLE, scans, boxes, labels=labels)
    assert figures.returns is not None
    assert [frame.returns for frame in figures.frames] == [3, 1, 2]
    assert np.bincount(figures.returns.frames).tolist() == [3, 1, 2]


def test_only_the_targets_own_box_counts():
    scans, boxes, labels = by_hand()
    swapped = dataclasses.replace(
        boxes,
        frames=(
            *boxes.frames[:2],
            FrameBoxes(
                boxes.frames[2].image_time,
                tuple(dataclasses.replace(box, track={"b": "c", "c": "b"}[box.track]) for box in boxes.frames[2].boxes),
            ),
        ),
    )
    assert box_figures(AHEAD, PINHOLE, scans, swapped, labels=labels).frames[2].inside == 0


def test_a_target_without_a_box_stays_in_the_denominator():
    scans, boxes, labels = by_hand()
    fewer = dataclasses.replace(
        boxes,
        frames=(
            *boxes.frames[:2],
            FrameBoxes(boxes.frames[2].image_time, tuple(box for box in boxes.frames[2].boxes if box.track == "b")),
        ),
    )
    figures = box_figures(AHEAD, PINHOLE, scans, fewer, labels=labels)

    assert (figures.frames[2].inside, figures.frames[2].returns) == (1, 2)
    assert {one.label: one.returns for one in figures.classes}[""] == 1


def test_only_classes_that_are_asked_for_count_and_their_names_must_exist():
    scans, boxes, labels = by_hand()
    cars = box_figures(AHEAD, PINHOLE, scans, boxes, labels=labels, classes=("car",))

    assert cars.acc == 1.0
    assert sum(frame.returns for frame in cars.frames) == 1
    absent = box_figures(AHEAD, PINHOLE, scans, boxes, labels=labels, classes=("lorry", "car"))
    assert [frame.returns for frame in absent.frames] == [frame.returns for frame in cars.frames]
    with pytest.raises(InputError, match=r"no box is of the class 'lorry'.*'car', 'person'"):
        box_figures(AHEAD, PINHOLE, scans, boxes, labels=labels, classes=("lorry",))
    assert renamed_classes(boxes, {"person": "pedestrian"}).labels == ("car", "pedestrian")
    with pytest.raises(InputError, match="'lorry' to be renamed"):
        renamed_classes(boxes, {"lorry": "car"})


@pytest.mark.parametrize("angle_deg", [0.0, 0.7])
def test_an_independent_script_finds_the_same_acc(angle_deg):
    scene = street(people=3, seconds=15.0, seed=3, with_names=True)
    pose = turned(TRUE_POSE, 1, angle_deg)
    ours = box_figures(pose, CAMERA, scene.scans, scene.boxes, labels=scene.labels)
    frames = [
        (frame.image_time, {box.track: (box.left_px, box.top_px, box.right_px, box.bottom_px) for box in frame.boxes})
        for frame in scene.boxes
    ]
    scans = [
        (
            int(scene.scans.times_ns[i]),
            [
                (*point, name)
                for point, name in zip(scene.scans.scan(i).points_radar_m.tolist(), one.tracks, strict=True)
            ],
        )
        for i, one in enumerate(scene.labels.scans)
    ]
    matrix = CAMERA.matrix_px
    theirs = independent_acc(
        pose.rotation.tolist(),
        pose.translation_m.tolist(),
        (matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]),
        CAMERA.distortion[:4].tolist(),
        frames,
        scans,
        50_000_000,
    )
    assert ours.acc is not None
    assert abs(100.0 * ours.acc - theirs) < 0.1


def test_own_targets_say_how_many_returns_have_no_box_and_that_the_loss_is_unknown(crowd):
    fewer = dataclasses.replace(
        crowd.boxes, frames=tuple(dataclasses.replace(frame, boxes=frame.boxes[:1]) for frame in crowd.boxes)
    )
    figures = box_figures(TRUE_POSE, CAMERA, crowd.scans, fewer)
    boxless = np.isnan(figures.returns.boxes_px).any(axis=1).mean()
    assert boxless > 0.1
    assert figures.rule.count(f"{100.0 * boxless:.1f} ") == 1
    assert "cannot tell" in figures.rule
    assert "%" not in box_figures(AHEAD, PINHOLE, *by_hand()[:2], labels=by_hand()[2]).rule


@pytest.mark.slow
def test_which_returns_count_and_their_boxes_do_not_depend_on_the_calibration(crowd):
    targets = find_targets([crowd.scans]).tracks
    figures = [
        box_figures(pose, CAMERA, crowd.scans, crowd.boxes, targets=targets)
        for pose in (TRUE_POSE, turned(TRUE_POSE, 1, 10.0), turned(TRUE_POSE, 0, -4.0), turned(TRUE_POSE, 1, 180.0))
    ]
    first = figures[0].returns
    assert first is not None
    for other in figures[1:]:
        assert np.array_equal(first.boxes_px, other.returns.boxes_px, equal_nan=True)
        assert np.array_equal(first.points_radar_m, other.returns.points_radar_m)
    assert figures[3].acc == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("angle_deg", [-10.0, 10.0])
def test_a_calibration_turned_by_ten_degrees_scores_near_chance(crowd, axis, angle_deg):
    targets = find_targets([crowd.scans]).tracks
    right = box_figures(TRUE_POSE, CAMERA, crowd.scans, crowd.boxes, targets=targets)
    wrong = box_figures(turned(TRUE_POSE, axis, angle_deg), CAMERA, crowd.scans, crowd.boxes, targets=targets)

    assert right.acc is not None
    assert right.acc > 0.8
    assert right.area_chance is not None
    assert 0.002 < right.area_chance < 0.02
    assert wrong.acc is not None
    assert wrong.acc < 0.03


def test_a_small_turn_never_gains_more_than_noise(crowd):
    targets = find_targets([crowd.scans]).tracks
    figures = box_figures(TRUE_POSE, CAMERA, crowd.scans, crowd.boxes, targets=targets)
    yaw = next(curve for curve in figures.sensitivity if curve.axis == "yaw")

    assert max(yaw.acc) - dict(zip(yaw.angles_deg, yaw.acc, strict=True))[0.0] < 0.02
    assert yaw.acc[0] < figures.acc - 0.15
    assert yaw.acc[-1] < figures.acc - 0.15
    assert next(curve for curve in figures.sensitivity if curve.axis == "roll").is_flat


def test_the_radars_own_targets_give_about_what_the_truth_gives():
    scene = street(people=2, seconds=30.0, seed=5, with_names=True)
    by_truth = box_figures(TRUE_POSE, CAMERA, scene.scans, scene.boxes, labels=scene.labels)
    unnamed = dataclasses.replace(
        scene.boxes,
        frames=tuple(
            dataclasses.replace(frame, boxes=tuple(dataclasses.replace(box, track="") for box in frame.boxes))
            for frame in scene.boxes
        ),
    )
    by_radar = box_figures(TRUE_POSE, CAMERA, scene.scans, unnamed)

    assert by_truth.acc is not None
    assert by_radar.acc is not None
    assert abs(by_truth.acc - by_radar.acc) < 2.0 * np.hypot(by_truth.acc_standard_error, by_radar.acc_standard_error)


def keyframes(boxes: Boxes, step: int = 20) -> Boxes:
    return dataclasses.replace(boxes, frames=boxes.frames[::step])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 6))
def test_returns_in_cuboids_give_about_what_the_truth_gives_on_keyframes(seed):
    scene = street(people=3, seconds=60.0, seed=seed, with_names=True, with_cuboids=True)
    boxes = keyframes(scene.boxes)
    by_cuboid = counted_returns(CAMERA, scene.scans, boxes, None)
    acc = judged_by_boxes(TRUE_POSE, CAMERA, by_cuboid).acc
    by_labels = box_figures(TRUE_POSE, CAMERA, scene.scans, boxes, labels=scene.labels).acc
    assert by_cuboid.bearings.turn_rad == pytest.approx(np.deg2rad(6.0), abs=np.deg2rad(2.0))
    assert acc == pytest.approx(by_labels, abs=0.06)
    assert judged_by_boxes(turned(TRUE_POSE, 1, 10.0), CAMERA, by_cuboid).acc < 0.1


@pytest.mark.slow
def test_cuboids_of_another_recording_give_no_figure():
    scene, other = (street(people=3, seconds=60.0, seed=seed, with_cuboids=True) for seed in (1, 7))
    counted = counted_returns(CAMERA, scene.scans, keyframes(other.boxes), None)
    assert not len(counted.frames)
    assert counted.bearings is None


def test_the_standard_error_takes_neighbouring_frames_together():
    times = np.arange(400, dtype=np.int64) * 100_000_000
    rng = np.random.default_rng(1)
    alone = rng.normal(0.0, 1.0, 400)
    in_tens = np.repeat(rng.normal(0.0, 1.0, 20), 20)  # 2 s each

    assert grouped_error(alone, times)[0] == pytest.approx(1.0 / np.sqrt(400), rel=0.6)
    assert grouped_error(in_tens, times)[0] == pytest.approx(1.0 / np.sqrt(20), rel=0.5)
    assert np.isnan(grouped_error(alone[:5], times[:5])[0])


def test_groups_are_counted_by_the_frames_alone():
    times = np.arange(135) * NS_PER_S // 2
    rng = np.random.default_rng(3)
    counts = {grouped_error(rng.normal(size=135) * scale, times)[1] for scale in (0.0, 1.0) for _ in range(20)}
    assert counts == {7}, "of 10 s, in 67 s"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axis", "deg"), [("yaw", 5.0), ("yaw", -9.0), ("pitch", 2.5), ("pitch", -6.0), ("roll", 6.0), ("yaw", 0.0)]
)
def test_a_turned_calibration_is_found_with_its_axis_its_size_and_an_interval(crowd, axis, deg):
    turn_rad = np.deg2rad(deg) * np.array(AXES[axis])
    pose = RigidTransform(rotation_exp(turn_rad), np.zeros(3)) @ TRUE_POSE
    found = {one.axis: one for one in box_figures(pose, CAMERA, crowd.scans, crowd.boxes).sensitivity}
    highest = max(found.values(), key=lambda one: max(one.acc))
    if deg:
        assert highest.axis == axis
    assert found[axis].best_deg == pytest.approx(-deg, abs=1.5 if axis == "roll" else 0.5)
    assert found[axis].low_deg < -deg < found[axis].high_deg
    assert abs(found[axis].best_deg) < max(map(abs, found[axis].angles_deg))


def test_boxes_of_another_recording_are_refused(crowd):
    later = dataclasses.replace(
        crowd.boxes,
        frames=tuple(
            dataclasses.replace(frame, image_time=TimeNs(frame.image_time + 3600 * NS_PER_S)) for frame in crowd.boxes
        ),
    )
    with pytest.raises(InputError, match=r"no annotated frame is within 0.05 s of a radar scan, the nearest is 3.57e"):
        counted_returns(CAMERA, crowd.scans, later, ())


def test_labels_of_another_recording_are_refused():
    scans, boxes, labels = by_hand()
    with pytest.raises(InputError, match="has no labels for the scan at 3"):
        box_figures(AHEAD, PINHOLE, scans, boxes, labels=ReturnLabels(labels.scans[:2], "labels.json"))
    short = ReturnLabels((*labels.scans[:2], LabelledScan(labels.scans[2].radar_time, ("c",))), "labels.json")
    with pytest.raises(InputError, match=r"labels 1 returns of the scan at 3.000 s, which has 2"):
        box_figures(AHEAD, PINHOLE, scans, boxes, labels=short)


def test_behind_the_camera_and_beyond_the_lens_nothing_is_inside():
    scans, boxes, labels = by_hand()
    everywhere = dataclasses.replace(
        boxes,
        frames=tuple(
            FrameBoxes(
                frame.image_time,
                tuple(dataclasses.replace(box, left_px=0, top_px=0, right_px=199, bottom_px=99) for box in frame.boxes),
            )
            for frame in boxes
        ),
    )
    assert box_figures(AHEAD, PINHOLE, scans, everywhere, labels=labels).acc == 1.0
    assert box_figures(turned(AHEAD, 1, 180.0), PINHOLE, scans, everywhere, labels=labels).acc == 0.0
    folding = Camera("plumb_bob", 200, 100, PINHOLE.matrix_px, np.array([-0.3, 0.0, 0.0, 0.0, 0.0]))
    assert box_figures(turned(AHEAD, 1, 80.0), folding, scans, everywhere, labels=labels).acc == 0.0
