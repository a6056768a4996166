"""Layouts of recordings, opened as a user does: nine of ten are read right, none is misread without a stated assumption."""

import pytest

from calib_core.recordings import describe, open_recording
from tests.corpus_layouts.layouts import LAYOUTS
from tests.corpus_layouts.reading import Reading, read
from tests.corpus_layouts.truth import Truth


@pytest.fixture(scope="module")
def truths(tmp_path_factory) -> dict[str, Truth]:
    return {name: write(tmp_path_factory.mktemp(name)) for name, write in LAYOUTS.items()}


@pytest.fixture(scope="module")
def readings(truths) -> dict[str, Reading]:
    return {name: read(truth) for name, truth in truths.items()}


def test_nine_of_ten_layouts_are_read_right(truths, readings):
    """A layout that leaves something open may be read the other way, if it is right as soon as the user says what it is."""
    print("\n".join(f"{name:26} {reading.outcome:18} {reading.why}" for name, reading in readings.items()))
    outcomes = [
        read(truths[name], truths[name].stated).outcome if truths[name].stated else reading.outcome
        for name, reading in readings.items()
    ]
    assert len(outcomes) >= 20
    assert {name: reading.why for name, reading in readings.items() if reading.outcome == "wrong"} == {}
    assert sum(outcome.startswith("right") for outcome in outcomes) >= 0.9 * len(outcomes)


def test_saying_what_a_layout_leaves_open_makes_it_right(truths):
    stated = {name: truth for name, truth in truths.items() if truth.stated is not None}
    assert len(stated) >= 3
    for name, truth in stated.items():
        reading = read(truth, truth.stated)
        assert reading.outcome == "right", f"{name}: {reading.outcome}: {reading.why}"


def test_what_a_layout_holds_and_is_not_read_is_named(truths):
    for name, what in (("view_of_delft", "radar_5frames"), ("nuscenes_mini", "sweeps"), ("kitti_raw_drive", "lidar")):
        with open_recording(list(truths[name].paths)) as recording:
            assert what in describe(recording), name


def test_a_refused_layout_names_what_was_looked_at(readings):
    for name, reading in readings.items():
        if reading.outcome == "refused":
            assert "looked at and not used" in reading.why, f"{name}: {reading.why}"
