"""What the page is offered when a calibration does not state what its numbers mean."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.recordings import Recording
from cocalib.hypothesis_sheet import OpenMeaning
from cocalib.opening.choice import MeaningPick
from cocalib.opening.opened import GivenCalibration, calibration_warnings
from cocalib.web.channel.open_meaning import drawn_meaning, meaning_rows

POSE = RigidTransform(np.eye(3), [0.4, 0.1, -0.2])
"""Of a camera's body frame in the radar, or the other way round."""


@pytest.fixture
def sample(recording: Recording) -> Recording:
    return recording


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "extrinsic.json"
    path.write_text(json.dumps({"front": {"T": POSE.as_matrix().tolist()}}))
    return path


def _open_meaning(file: Path, recording: Recording) -> OpenMeaning:
    shown = GivenCalibration.read(file).shown(recording.camera(), MeaningPick())
    assert shown.reference is None
    assert shown.meaning is not None
    return shown.meaning


def test_the_rows_are_the_likely_meanings_with_their_place(file, sample):
    rows = meaning_rows(_open_meaning(file, sample))
    assert rows.name == "extrinsic.json"
    assert {row.meaning for row in rows.rows[:2]} == {"camera_from_radar,body,m", "radar_from_camera,body,m"}
    assert {row.place for row in rows.rows} == {"front.T"}
    assert all(row.score.endswith("%") and row.mounting.startswith("the camera looks") for row in rows.rows)


def test_nothing_is_offered_without_such_a_calibration():
    assert meaning_rows(None).rows == ()


def test_each_row_is_drawn_differently_over_a_frame(file, sample):
    meaning = _open_meaning(file, sample)
    first, second = (
        cv2.imdecode(np.frombuffer(drawn_meaning(meaning, sample, f"number={number}&frame=40"), np.uint8), 1)
        for number in (0, 1)
    )
    assert first.shape == second.shape
    assert (np.abs(first.astype(int) - second.astype(int)).max(axis=2) > 60).sum() > 100


@pytest.mark.parametrize(
    "query", ["", "number=99&frame=1", "number=0&frame=999999", "number=-1&frame=0", "number=x&frame=²"]
)
def test_what_does_not_exist_is_refused(file, sample, query):
    with pytest.raises(InputError, match="no such meaning or frame"):
        drawn_meaning(_open_meaning(file, sample), sample, query)


def test_the_picked_meaning_is_the_calibration(file, sample):
    pick = MeaningPick("radar_from_camera,body,m", "front.T")
    shown = GivenCalibration.read(file).shown(sample.camera(), pick).reference
    camera_radar_m = shown.calibration.camera_from_radar.inverse().translation_m
    assert np.abs(camera_radar_m - POSE.translation_m).max() < 1e-9
    assumed = [warning.facts["message"] for warning in shown.calibration.warnings if warning.code == "assumed"]
    assert any("picked by hand" in message for message in assumed)


def test_what_is_shown_with_an_assumption_says_so_and_can_be_picked_again(file, sample):
    camera = sample.camera()
    assert camera is not None
    pick = MeaningPick("radar_from_camera,body,rfu,m", "front.T")
    shown = GivenCalibration.read(file).shown(camera, pick)
    assert [row.meaning for row in meaning_rows(shown.meaning).rows if row.is_shown] == [pick.meaning]
    (warning,) = calibration_warnings(file.name, shown)
    assert warning.code == "calibration-picked"
    assert warning.facts["message"].startswith("extrinsic.json ")


def test_a_format_that_leaves_something_open_is_shown_with_what_was_assumed(tmp_path, sample):
    camera, path = sample.camera(), tmp_path / "calib.txt"
    assert camera is not None
    rows = " ".join(map(str, np.array([[0, -1, 0, 0], [0, 0, -1, 0.1], [1, 0, 0, 0]], float).ravel()))
    path.write_text("P2: 700 0 320 0 0 700 240 0 0 0 1 0\nR0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam: " + rows + "\n")
    shown = GivenCalibration.read(path).shown(camera)
    assert shown.meaning is None
    (warning,) = calibration_warnings(path.name, shown)
    assert warning.code == "calibration-assumed"
    assert warning.facts["message"].startswith("calib.txt ")
