"""Layouts of recordings, opened as a user does: nine of ten are read right, none is misread without a stated assumption."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.evaluation.box_acc import judged_by_boxes
from calib_core.geometry import RigidTransform
from calib_core.recordings import describe, open_recording
from cocalib.evaluation.boxes import find_boxes
from cocalib.evaluation.evaluating import evidence_in
from tests.corpus_layouts.layouts import LAYOUTS
from tests.corpus_layouts.reading import Reading, read
from tests.corpus_layouts.truth import Truth

OfLayout = TypeVar("OfLayout")


class Made(dict[str, OfLayout]):
    """What is made of a layout by its name when it is asked for."""

    def __init__(self, make: Callable[[str], OfLayout]) -> None:
        self._make = make

    def __missing__(self, name: str) -> OfLayout:
        self[name] = self._make(name)
        return self[name]


@pytest.fixture(scope="module")
def truths(tmp_path_factory) -> Made[Truth]:
    return Made(lambda name: LAYOUTS[name](tmp_path_factory.mktemp(name)))


@pytest.fixture(scope="module")
def readings(truths) -> Made[Reading]:
    return Made(lambda name: read(truths[name]))


@pytest.mark.slow
def test_nine_of_ten_layouts_are_read_right(truths, readings):
    """A layout that leaves something open may be read the other way, if it is right as soon as the user says what it is."""
    found = {name: readings[name] for name in LAYOUTS}
    print("\n".join(f"{name:26} {reading.outcome:18} {reading.why}" for name, reading in found.items()))
    outcomes = [
        read(truths[name], truths[name].stated).outcome if truths[name].stated else reading.outcome
        for name, reading in found.items()
        if len(truths[name].image_times_ns)
    ]
    assert len(outcomes) >= 20
    assert {name: reading.why for name, reading in found.items() if reading.outcome == "wrong"} == {}
    assert sum(outcome.startswith("right") for outcome in outcomes) >= 0.9 * len(outcomes)


@pytest.mark.parametrize("name", ["polar_without_comments", "lists_and_dates", "kitti_raw_drive"])
def test_saying_what_a_layout_leaves_open_makes_it_right(truths, name):
    assert truths[name].stated is not None
    reading = read(truths[name], truths[name].stated)
    assert reading.outcome == "right", reading.why


def test_what_a_layout_holds_and_is_not_read_is_named(truths):
    for name, what in (("view_of_delft", "radar_5frames"), ("nuscenes_mini", "sweeps"), ("kitti_raw_drive", "lidar")):
        with open_recording(list(truths[name].paths)) as recording:
            assert what in describe(recording), name


@pytest.mark.slow
def test_a_refused_layout_names_what_was_looked_at(readings):
    for name in LAYOUTS:
        if readings[name].outcome == "refused":
            assert "and not used" in readings[name].why, f"{name}: {readings[name].why}"


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("radiate", "velo_lidar (12 lidar clouds"),
        ("k_radar", "os2-64 (10 lidar clouds"),
        ("k_radar", "radar_zyx_cube (10 .mat files, of no form that is read"),
    ],
)
def test_sets_without_returns_are_refused_and_their_lidars_are_no_radars(readings, name, what):
    assert readings[name].outcome == "refused"
    assert what in readings[name].why
    assert "and not used" in readings[name].why


@pytest.mark.parametrize(
    ("name", "labels", "position_m"),
    [
        ("view_of_delft", "lidar/training/label_2", (0.05, 1.2, -0.4)),
        ("tj4dradset", "label_2", (0.02, 0.6, -0.1)),
        ("nuscenes_mini", "v1.0-mini", (0.0, 1.0, 1.7)),
    ],
)
def test_the_published_pose_is_right_and_a_turned_one_wrong_by_the_cuboids_of_a_set(truths, name, labels, position_m):
    ahead = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    turn = np.array([[np.cos(0.2), 0.0, np.sin(0.2)], [0.0, 1.0, 0.0], [-np.sin(0.2), 0.0, np.cos(0.2)]])
    with open_recording(list(truths[name].paths)) as recording:
        boxes = find_boxes(str(truths[name].paths[0] / labels), recording)
        camera = recording.camera()
        found = evidence_in(recording, camera, boxes=boxes)
    assert {warning.code for warning in found.warnings} <= {"boxes-note"}
    right = judged_by_boxes(RigidTransform(ahead, np.array(position_m)), camera, found.returns)
    turned = judged_by_boxes(RigidTransform(turn @ ahead, turn @ np.array(position_m)), camera, found.returns)
    assert right.acc > 0.8
    assert turned.acc < 0.1
    assert len(right.objects) >= 30


def test_labels_of_a_form_that_is_not_read_are_refused(truths):
    with (
        open_recording(list(truths["astyx"].paths)) as recording,
        pytest.raises(InputError, match="no known file of boxes"),
    ):
        find_boxes(str(truths["astyx"].paths[0] / "groundtruth_obj3d"), recording)
