"""The real road recording with its published calibration: what moves in it is 204 m away, too far to count."""

import json
from pathlib import Path

import numpy as np
import pytest

from calib_core.boxes import boxes_text
from calib_core.geometry import RigidTransform
from calib_core.measurements import Box, Boxes, FrameBoxes, TimeNs
from calib_core.recordings import open_recording
from cocalib.cli import run

pytestmark = pytest.mark.real


@pytest.fixture
def published(shared_data: Path, tmp_path: Path) -> tuple[Path, Path, Path]:
    """Return the recording, the published pose as a bare matrix, and boxes that a person drew in two frames."""
    place = shared_data / "real_radar_camera_road"
    recording = place / "pjlab_radar_camera.bag"
    if not recording.is_file():
        pytest.skip("the road recording is not there")
    matrix = np.array(json.loads((place / "published_calibration.json").read_text())["T_radar_to_camera"])
    pose = RigidTransform(np.linalg.svd(matrix[:3, :3])[0] @ np.linalg.svd(matrix[:3, :3])[2], matrix[:3, 3])
    np.savetxt(tmp_path / "published.txt", pose.as_matrix())
    with open_recording(recording) as opened:
        times = opened.image_times[[1, 4]].tolist()
    drawn = tuple(FrameBoxes(TimeNs(time), (Box(900, 560, 1000, 640, "car", track="car-1"),)) for time in times)
    (tmp_path / "boxes.json").write_text(boxes_text(Boxes(drawn, "boxes.json", (1920, 1200))))
    return recording, tmp_path / "published.txt", tmp_path / "boxes.json"


def test_without_clicks_and_boxes_there_is_nothing_to_judge_by(published, capsys):
    recording, pose, _ = published

    assert run(["evaluate", str(pose), str(recording)]) == 1
    assert "no clicks or boxes" in capsys.readouterr().err


def test_with_boxes_it_says_that_nothing_moves_within_reach(published, capsys):
    recording, pose, boxes = published

    assert run(["evaluate", str(pose), str(recording), "--boxes", str(boxes)]) == 1
    out = capsys.readouterr().out
    assert "no moving target" in out
    assert "within 200 m" in out
    other = pose.with_name("other.txt")
    other.write_bytes(pose.read_bytes())
    assert run(["check", str(pose), "--against", str(other), "--recording", str(recording), "--boxes", str(boxes)]) == 0
    out = capsys.readouterr().out
    assert out.startswith("cannot tell")
    assert "no clicks or boxes" in out
    assert "20 m: 0 px" in out
