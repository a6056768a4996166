"""`cocalib evaluate`, and `cocalib check` of two calibrations on a recording: answer, JSON, codes, bad input."""

import json
import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.boxes import boxes_text, labels_text
from calib_core.measurements import TimeNs
from calib_core.recordings.containers.writing import (
    CameraInfoMessage,
    CloudMessage,
    CompressedImageMessage,
    RecordedMessage,
    write_ros2,
)
from tests.street import CAMERA, TRUE_POSE, Street, street, turned


def written(path: Path, scene: Street, *, late_s: float = 0.0) -> Path:
    """Write a street as an MCAP recording; all its images are the same."""
    jpeg = cv2.imencode(".jpg", np.full((CAMERA.height_px, CAMERA.width_px, 3), 90, np.uint8))[1].tobytes()
    messages = []
    for frame in scene.boxes:
        time = frame.image_time
        messages.append(RecordedMessage("/camera/image/compressed", time, CompressedImageMessage(time, "cam", jpeg)))
        messages.append(RecordedMessage("/camera/camera_info", time, CameraInfoMessage(time, "cam", CAMERA)))
    for index in range(len(scene.scans)):
        scan = scene.scans.scan(index)
        time = TimeNs(scan.time + round(late_s * 1e9))
        values = np.column_stack([scan.points_radar_m, scan.doppler_mps, np.full(len(scan), 20.0)])
        names = ("x", "y", "z", "velocity", "snr")
        messages.append(RecordedMessage("/radar/points", time, CloudMessage(time, "radar", names, values)))
    return write_ros2(path, iter(sorted(messages, key=lambda one: one.receive_time)), container="mcap")


def matrix_file(path: Path, angle_deg: float = 0.0) -> Path:
    np.savetxt(path, turned(TRUE_POSE, 1, angle_deg).as_matrix())
    return path


@pytest.fixture(scope="module")
def scene() -> Street:
    return street(people=3, seconds=30.0, seed=2, with_names=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, scene: Street) -> Path:
    """Return a folder with a recording, its boxes and labels, and calibrations right and turned by 3 deg."""
    place = tmp_path_factory.mktemp("street")
    written(place / "street.mcap", scene)
    (place / "boxes.json").write_text(boxes_text(scene.boxes))
    (place / "labels.json").write_text(labels_text(scene.labels))
    matrix_file(place / "right.txt")
    matrix_file(place / "turned.txt", 3.0)
    return place


@pytest.mark.slow
def test_residuals_come_first_and_say_what_they_rest_on(cocalib, solved):
    recording = solved.parent / "made.mcap"
    answer = cocalib("evaluate", solved, recording)
    first, held, *_ = answer.out.splitlines()

    assert answer.code == 0
    assert "(AED) " in first
    assert "8 placements" in first
    assert held.startswith("leave-one-out: AED ")
    document = json.loads(cocalib("evaluate", solved, recording, "--json").out)
    assert document["schema"] == "cocalib/evaluation-1"
    assert document["residuals"]["aed_px"] == pytest.approx(
        json.loads(solved.read_text())["metrics"]["aed_px"], abs=0.05
    )
    assert [len(document["residuals"][key]["distances_px"]) for key in ("held_out", "k_fold")] == [8, 8]
    assert document["boxes"] is None


def test_acc_is_never_alone_and_a_calibration_that_looks_elsewhere_is_doubted(cocalib, folder, tmp_path):
    on_it = (folder / "street.mcap", "--boxes", folder / "boxes.json")
    answer = cocalib("evaluate", folder / "right.txt", *on_it)
    assert answer.code == 0, answer.err
    assert answer.out.startswith("Acc: ")
    for said in (
        "Acc is flat in roll: it cannot see it",
        "Acc is not accuracy",
        "chance: turned by 10 deg to either side 0.",
    ):
        assert said in answer.out
    answer = cocalib("evaluate", matrix_file(tmp_path / "away.txt", 10.0), *on_it)
    assert answer.code == 3
    assert answer.out.startswith("Acc: 0.")
    assert "turned in yaw by" in answer.out
    quiet = cocalib("evaluate", matrix_file(tmp_path / "near.txt", 2.5), *on_it, "--json")
    assert quiet.code == 3
    assert "turned in yaw by" in quiet.err


@pytest.mark.slow
def test_the_json_has_the_documented_keys(cocalib, folder):
    arguments = ("evaluate", folder / "right.txt", folder / "street.mcap", "--boxes", folder / "boxes.json", "--json")
    plain = json.loads(cocalib(*arguments).out)
    truth = json.loads(cocalib(*arguments, "--labels", folder / "labels.json").out)
    page = Path("docs/evaluation.md").read_text()

    assert all(f"`{key}`" in page for key in [*plain, *plain["boxes"], *plain["boxes"]["frames"][0]])
    assert abs(plain["boxes"]["acc"] - truth["boxes"]["acc"]) < 0.1
    assert [one["axis"] for one in plain["boxes"]["sensitivity"]] == ["roll", "pitch", "yaw"]
    assert plain["boxes"]["sensitivity"][0]["flat"] is True
    assert "labels say which returns" in truth["boxes"]["rule"]


@pytest.mark.slow
def test_a_turned_calibration_is_told_from_the_right_one(cocalib, folder, tmp_path):
    where = ("--against", folder / "right.txt", "--recording", folder / "street.mcap", "--boxes", folder / "boxes.json")
    answer = cocalib("check", folder / "turned.txt", *where)
    assert answer.code == 1, answer.err
    assert re.match(r"A \(right.txt\) is better.*Acc", answer.out)
    assert "rotation: 3 deg apart" in answer.out
    document = json.loads(cocalib("check", folder / "turned.txt", *where, "--json").out)
    assert document["schema"] == "cocalib/check-1"
    assert document["on_recording"]["winner"] == "A"
    assert document["on_recording"]["acc"]["high"] < 0
    answer = cocalib("check", matrix_file(tmp_path / "close.txt", 0.03), *where)
    noise = "cannot tell which is better on this recording: the difference may be noise"
    assert answer.out.startswith((noise, "no diff"))


def test_a_calibration_that_was_solved_from_the_clicks_is_not_compared_by_them(cocalib, solved, tmp_path):
    pose = json.loads(solved.read_text())["camera_from_radar"]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose["rotation"], np.array(pose["translation_m"]) + np.array([0.1, 0.0, 0.0])
    np.savetxt(tmp_path / "other.txt", matrix)
    answer = cocalib("check", tmp_path / "other.txt", "--against", solved, "--recording", tmp_path / "made.mcap")

    assert answer.out.startswith("cannot tell")
    assert "calibration.json was solved" in answer.out


@pytest.mark.slow
def test_classes_are_chosen_and_renamed(cocalib, folder):
    where = ("evaluate", folder / "right.txt", folder / "street.mcap", "--boxes", folder / "boxes.json")

    named = cocalib(*where, "--class-map", "person=pedestrian", "--classes", "pedestrian")
    assert "  pedestrian: " in named.out
    wrong = cocalib(*where, "--classes", "car")
    assert (wrong.code, "'car'; there are: 'person'" in wrong.err) == (2, True)
    absent = cocalib(*where, "--classes", "car,person")
    assert "class 'car'" in absent.out
    assert "  person: " in absent.out
    assert "expected FROM=TO" in cocalib(*where, "--class-map", "person").err


def test_without_moving_returns_there_is_no_acc(cocalib, folder, scene, tmp_path):
    still = written(
        tmp_path / "still.mcap", replace(scene, scans=replace(scene.scans, doppler_mps=0 * scene.scans.doppler_mps))
    )
    answer = cocalib("evaluate", folder / "right.txt", still, "--boxes", folder / "boxes.json")

    assert answer.code == 1
    assert "no moving target" in answer.out


@pytest.mark.slow
def test_what_reading_the_boxes_took_for_granted_is_said(cocalib, folder, scene, tmp_path):
    found = [
        {"image_id": number, "category_id": 1, "score": 0.9, "bbox": [left, top, right - left, bottom - top]}
        for number, frame in enumerate(scene.boxes)
        for left, top, right, bottom in ((one.left_px, one.top_px, one.right_px, one.bottom_px) for one in frame.boxes)
    ]
    (tmp_path / "detections.json").write_text(json.dumps(found))
    where = (folder / "right.txt", folder / "street.mcap", "--boxes", tmp_path / "detections.json")
    document = json.loads(cocalib("evaluate", *where, "--json").out)
    notes = [one for one in document["warnings"] if one["code"] == "boxes-note"]

    assert any("number" in one["message"] for one in notes)
    assert all(one["message"].startswith("detections.json: ") for one in notes)
    assert f"warning: {notes[0]['message']}" in cocalib("evaluate", *where).out
    assert cocalib("evaluate", *where, "--report", tmp_path / "report.html").code in (0, 3)
    assert "boxes-note" in (tmp_path / "report.html").read_text()


def test_what_is_damaged_is_told_of_every_recording_that_is_judged(cocalib, made, solved, clicks_file):
    recording = made("cut")
    recording.write_bytes(recording.read_bytes()[:-9])
    answer = cocalib("evaluate", solved, recording, "--clicks", clicks_file)
    assert answer.code == 0
    assert "450 complete messages" in answer.err
