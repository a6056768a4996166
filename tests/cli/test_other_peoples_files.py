"""Files in the forms that other people's tools write, made of the sample's own returns: their truth is known."""

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.geometry import RigidTransform
from calib_core.interchange.own.calibration_json import read_calibration

pytestmark = pytest.mark.real


@pytest.fixture
def cases(shared_data: Path) -> Path:
    folder = shared_data / "cases"
    if not folder.is_dir():
        pytest.skip("there are no files of other people's tools in ../shared/data/cases")
    return folder


def error_of(out: Path, sample: Path) -> tuple[float, float]:
    """Return how far a calibration is from the sample's truth [m, deg]."""
    true = json.loads((sample / "truth.json").read_text())["camera_from_radar"]
    truth = RigidTransform(np.array(true["rotation"]), np.array(true["translation_m"]))
    error = read_calibration(out.read_text()).calibration.camera_from_radar.error_from(truth)
    return float(np.linalg.norm(error[:3])), float(np.degrees(np.linalg.norm(error[3:])))


@pytest.mark.slow
def test_a_unit_of_the_speed_that_cannot_change_the_pose_is_a_note(cocalib, cases, sample, tmp_path):
    out = tmp_path / "c.json"
    paths = (cases / "07-speed-unit-unstated" / "radar", sample / "camera.bag")
    answer = cocalib("solve", *paths, "--clicks", sample / "clicks.json", "--out", out)
    assert answer.code == 0, answer.err
    assert "--confirm-assumptions" not in answer.err
    assert "rangerate" in answer.err
    assert [one["confirmed"] for one in json.loads(out.read_text())["provenance"]["assumptions"]] == [False]
    distance_m, turn_deg = error_of(out, sample)
    assert distance_m < 0.15
    assert turn_deg < 1.5


def test_rows_of_single_returns_are_split_into_scans_like_messages(cocalib, cases, sample):
    answer = cocalib("info", "--json", cases / "02-rostopic-echo-p-csv" / "radar.csv", sample / "camera.bag")
    radar = json.loads(answer.out)["radar"]
    assert radar["scans"] == 1849
    assert radar["longest_gap_s"] < 0.31


def test_messages_as_rostopic_echo_writes_them_are_a_table_of_returns(cocalib, cases, sample):
    answer = cocalib("info", "--json", cases / "01-rostopic-echo-text" / "radar.txt", sample / "camera.bag")
    radar = json.loads(answer.out)["radar"]
    assert radar["scans"] == 7
    assert [row["column"] for row in radar["columns"]][:3] == ["x", "y", "z"]


@pytest.mark.parametrize(
    ("case", "name", "flat"),
    [
        ("50-npy-pairs", "pairs.npz", False),
        ("52-pairs-without-z", "pairs.csv", True),
        ("56-mm-decimal-comma", "pairs.csv", False),
        ("60-pairs-of-a-click-tool", "point_pairs.txt", True),
    ],
)
def test_pairs_in_the_spellings_of_other_tools_give_the_pose(cocalib, cases, sample, tmp_path, case, name, flat):
    out = tmp_path / "c.json"
    answer = cocalib("solve", "--pairs", cases / case / name, "--camera", cases / case / "camera.yaml", "--out", out)
    assert answer.code == 0, answer.err
    assert flat or error_of(out, sample) < (0.15, 1.5)
    calibration = read_calibration(out.read_text()).calibration
    assert sum(pair.inlier for pair in calibration.pairs) == 20
    assert ("assumed" in {one.code for one in calibration.warnings}) == (case.startswith("60"))


@pytest.mark.slow
def test_a_radar_whose_clock_is_another_time_scale_is_named_and_can_be_corrected(cocalib, cases, sample, tmp_path):
    out, bags = tmp_path / "c.json", (cases / "09-clock-37-s" / "radar.bag", sample / "camera.bag")
    answer = cocalib("solve", *bags, "--clicks", sample / "clicks.json", "--out", out)
    assert answer.code in (0, 3)
    assert "TAI and UTC" in answer.out
    assert "--radar-late -37" in answer.out
    answer = cocalib("solve", *bags, "--clicks", sample / "clicks.json", "--out", out, "--radar-late", "-37")
    assert answer.code == 0
    assert "--radar-late -37" in answer.err
    assert error_of(out, sample) < (0.15, 1.5)


@pytest.mark.slow
def test_a_cloud_with_y_forward_is_named_with_the_axes_to_type(cocalib, cases, sample, tmp_path):
    bags, axes = (cases / "12-y-forward-cloud" / "radar.bag", sample / "camera.bag"), "right,forward,up"
    answer = cocalib("info", *bags)
    assert "radar-looks-left" in answer.out
    assert f"--radar-axes {axes}" in answer.out
    assert "radar-looks-left" not in cocalib("info", *bags, "--radar-axes", axes).out
    assert "radar-looks-left" not in cocalib("info", sample / "radar.bag", sample / "camera.bag").out
    solve = ("solve", *bags, "--clicks", sample / "clicks.json", "--out", tmp_path / "c.json")
    assert f"--radar-axes {axes}" in cocalib(*solve).out
    assert cocalib(*solve, "--radar-axes", axes).code == 0
    assert error_of(tmp_path / "c.json", sample) < (0.15, 1.5)


def test_a_camera_matrix_times_a_pose_is_named(cocalib, cases):
    case = cases / "40-projection-times-pose"
    answer = cocalib("import", case / "calib_camera_radar.txt", "--camera", case / "camera.yaml")
    assert answer.code == 2
    assert "inverse(K)" in answer.err


@pytest.mark.slow
def test_a_folder_of_calibrations_beside_images_gives_their_intrinsics(cocalib, cases, tmp_path):
    folder = shutil.copytree(cases / "47-folder-with-calib" / "set", tmp_path / "set")
    images = folder / "image"
    images.mkdir()
    blank = cv2.imencode(".jpg", np.zeros((600, 960, 3), np.uint8))[1].tobytes()
    for file in (folder / "radar").glob("*.csv"):
        (images / f"{file.stem}.jpg").write_bytes(blank)
    summary = json.loads(cocalib("info", "--json", folder).out)
    assert summary["camera"]["matrix_px"][0][0] == pytest.approx(798.85, abs=0.01)
    assert summary["radar"]["scans"] == 40


@pytest.mark.parametrize(("name", "words"), [("idl", "--map"), ("pb", "descriptor"), ("flat", "flatc")])
def test_a_radar_topic_that_is_not_read_has_its_reason(cocalib, cases, name, words):
    (topic,) = json.loads(cocalib("info", "--json", cases / "34-foxglove-schemas" / f"{name}.mcap").out)["topics"]
    assert words in topic["problem"]


@pytest.mark.slow
def test_returns_that_a_driver_has_moved_into_the_vehicles_frame_are_taken_back_by_the_mount(
    cocalib, cases, sample, tmp_path
):
    bags = (cases / "16-returns-in-base-link" / "radar.bag", sample / "camera.bag")
    assert "radar-in-vehicle-frame" in cocalib("info", *bags).out
    solve = ("solve", *bags, "--clicks", sample / "clicks.json", "--out", tmp_path / "c.json")
    answer = cocalib(*solve)
    assert "'base_link'" in answer.out
    assert "verdict: coarse" in answer.out
    assert "verdict: usable" in cocalib(*solve, "--radar-mount", *["3.7", "0", "0.6", "0", "0", "0"]).out
    assert error_of(tmp_path / "c.json", sample) < (0.15, 1.5)
