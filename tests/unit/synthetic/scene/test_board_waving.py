"""The board that is waved before the camera: where the truth says, and with nothing said of the lens in the recording."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.errors import OptionError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import open_recording
from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.synthetic.scene.stage import set_stage

WAVED_S = 5.0
OPTIONS = replace(
    PRESETS["intrinsics"],
    placements=2,
    dwell_s=3.5,
    width_px=400,
    height_px=250,
    camera_rate_hz=4.0,
    radar_rate_hz=2.0,
    waved_board_s=WAVED_S,
)


@pytest.fixture(scope="module")
def recording() -> SimulatedRecording:
    return simulate(OPTIONS)


@pytest.fixture(scope="module")
def folder(recording: SimulatedRecording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("waved")
    write_recording(recording, folder, containers=("mcap",))
    return folder


@pytest.mark.slow
def test_the_board_is_where_the_truth_says(recording):
    stage = recording.stage
    assert stage.waving is not None
    seen = []
    for frame, moment_s in zip(recording.frames(12), stage.frame_times.moment_s, strict=False):
        moving = stage.waving.at(float(moment_s))
        true = moving.camera.project(moving.camera_from_board @ moving.printed.corners_m)
        found, corners = cv2.findChessboardCorners(frame.pixels, (9, 6))
        if found:
            near = np.linalg.norm(corners.reshape(-1, 1, 2) - true[None], axis=2).min(axis=1)
            seen.append(np.median(near))
    assert len(seen) >= 6
    assert max(seen) < 1.0


def test_the_board_is_held_still_between_poses_and_moves_in_between(recording):
    waving = recording.stage.waving
    speeds = [
        float(np.linalg.norm(moving.motion.velocity_mps)) for s in (0.2, 0.7, 1.2, 1.7) if (moving := waving.at(s))
    ]
    assert speeds[0] == speeds[2] == 0.0
    assert min(speeds[1], speeds[3]) > 0.02
    middles = [
        moving.camera_from_board.translation_m for s in np.arange(0.0, 4.9, 0.02) if (moving := waving.at(float(s)))
    ]
    assert max(float(np.linalg.norm(two - one)) for one, two in pairwise(middles)) < 0.05
    assert waving.at(5.0) is None


def test_the_reflector_is_fetched_after_the_board_is_put_away(recording):
    story = recording.stage.story
    assert story.at(2.0).resting is None
    assert story.at(2.0).reflector_m[0] < 0.0
    assert story.lead_s > WAVED_S
    assert story.restings[0].start_s > story.lead_s
    assert np.linalg.norm(story.at(story.lead_s + 1e-3).person.place_m) > 1.0


@pytest.mark.slow
def test_nothing_in_the_recording_tells_of_the_lens(folder):
    with open_recording([folder / "recording_mcap"]) as recording:
        topics = {topic.name for topic in recording.topics}
    assert "/camera/image_raw/compressed" in topics
    assert "/camera/camera_info" not in topics
    truth = json.loads((folder / "truth.json").read_text())
    board = truth["board"]
    assert (board["kind"], board["columns"], board["rows"], board["square_m"]) == ("checkerboard", 9, 6, 0.02214)
    times = [board[name]["sec"] + board[name]["nanosec"] / NS_PER_S for name in ("start", "end")]
    assert times[1] - times[0] == pytest.approx(5.0)
    assert truth["placements"][0]["start"]["sec"] >= times[1]


def test_a_folder_without_ros_has_no_camera_file_either(recording, tmp_path):
    from calib_core.synthetic.files import write_plain_files

    write_plain_files(recording, tmp_path / "plain", [])
    assert not (tmp_path / "plain" / "camera.yaml").exists()


def test_a_board_needs_placements_after_it_and_no_islands():
    with pytest.raises(OptionError, match="placements"):
        SimulationOptions(placements=0, waved_board_s=WAVED_S)
    with pytest.raises(OptionError, match="islands"):
        SimulationOptions(islands=True, waved_board_s=WAVED_S)
    with pytest.raises(OptionError, match="waved_board_s"):
        SimulationOptions(waved_board_s=-1.0)


def test_without_a_board_the_story_is_as_before():
    plain = set_stage(replace(OPTIONS, waved_board_s=0.0))
    assert plain.waving is None
    assert plain.story.lead_s == 0.0
    assert plain.story.restings[0].start_s < 12.0
