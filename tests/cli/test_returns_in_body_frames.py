"""The sample's returns as a driver publishes them that moves them into the vehicle's frame, with the mount in /tf_static."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.recordings import RecordingOptions, open_recording
from calib_core.recordings.containers.writing import CloudMessage, RecordedMessage, TransformMessage, write_ros2
from calib_core.recordings.radar.returns_origin import mount_of

CORNER = (3.4, 0.8, 0.5, 0.0, 0.0, 45.0)
FLAGS = ("--radar-mount", *map(str, CORNER))


@pytest.fixture(scope="module")
def published(sample: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Return a function that writes the sample's returns, moved or not, under a frame's name, with transforms or without."""
    with open_recording(sample / "radar.bag", require=("radar",)) as recording:
        scans = recording.radar_scans()

    def write(frame: str, *, moved: bool, transforms: bool) -> Path:
        mount = mount_of(CORNER)
        made = []
        poses = {"radar_front": mount_of((3.9, 0.0, 0.5, 0.0, 0.0, 0.0)), "radar_left": mount}
        for name, pose in poses.items() if transforms else ():
            time = scans.scan(0).time
            made.append(RecordedMessage("/tf_static", time, TransformMessage(time, "base_link", name, pose)))
        for number in range(len(scans)):
            scan = scans.scan(number)
            points = mount @ scan.points_radar_m if moved else scan.points_radar_m
            values = np.column_stack([points, scan.snr_db, scan.doppler_mps])
            cloud = CloudMessage(scan.time, frame, ("x", "y", "z", "intensity", "velocity"), values)
            made.append(RecordedMessage("/radar_left/points", scan.time, cloud))
        return write_ros2(tmp_path_factory.mktemp("published") / "radar.mcap", made)

    return write


def error_of(out: Path, sample: Path) -> tuple[float, float]:
    """Return how far a calibration is from the sample's truth [m, deg]."""
    true = json.loads((sample / "truth.json").read_text())["camera_from_radar"]
    pose = read_calibration(out.read_text()).calibration.camera_from_radar
    apart = np.linalg.norm(pose.translation_m - np.array(true["translation_m"]))
    turn = pose.rotation.T @ np.array(true["rotation"])
    return float(apart), float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))))


@pytest.mark.slow
def test_returns_are_taken_back_by_the_bags_own_transforms(cocalib, published, sample, tmp_path):
    radar, out = published("base_link", moved=True, transforms=True), tmp_path / "c.json"
    answer = cocalib("solve", radar, sample / "camera.bag", "--clicks", sample / "clicks.json", "--out", out)
    assert answer.code == 0, answer.err
    assert "yaw 45.00" in answer.err
    document = json.loads(out.read_text())
    assert document["frames"]["radar"] == "radar_left"
    assert document["vehicle"]["frame"] == "base_link"
    assert document["vehicle"]["radar_mount"] == pytest.approx(CORNER)
    assert document["verdict"]["level"] in ("good", "usable")
    assert "radar-in-vehicle-frame" not in [warning["code"] for warning in document["warnings"]]
    distance_m, turn_deg = error_of(out, sample)
    assert distance_m < 0.1
    assert turn_deg < 1.5
    again = cocalib("solve", "--pairs", out, "--out", tmp_path / "again.json")
    assert again.code == 0
    assert json.loads((tmp_path / "again.json").read_text())["vehicle"] == document["vehicle"]


@pytest.mark.slow
def test_without_transforms_the_mount_is_asked_for_and_given(cocalib, published, sample, tmp_path):
    radar, out = published("base_link", moved=True, transforms=False), tmp_path / "c.json"
    solve = ("solve", radar, sample / "camera.bag", "--clicks", sample / "clicks.json")
    answer = cocalib(*solve, "--out", out)
    assert json.loads(out.read_text())["verdict"]["level"] == "coarse"
    assert "--radar-frame body --radar-mount" in answer.out
    assert "--radar-frame sensor" in answer.out
    assert cocalib(*solve, "--out", out, *FLAGS).code == 0
    assert json.loads(out.read_text())["verdict"]["level"] in ("good", "usable")
    assert error_of(out, sample)[0] < 0.1
    assert cocalib(*solve, *FLAGS[:-1], "nan").code == 2


@pytest.mark.slow
@pytest.mark.parametrize(("frame", "moved"), [("base_link", False), ("radar_left", True)])
def test_a_name_that_the_returns_contradict_is_coarse_until_somebody_decides(
    cocalib, published, sample, tmp_path, frame, moved
):
    radar = published(frame, moved=moved, transforms=True)
    solve = ("solve", radar, sample / "camera.bag", "--clicks", sample / "clicks.json")
    document = json.loads(cocalib(*solve).out)
    assert document["verdict"]["level"] == "coarse"
    assert "radar-in-vehicle-frame" in [warning["code"] for warning in document["warnings"]]
    assert "vehicle" not in document
    out = tmp_path / "c.json"
    assert cocalib(*solve, "--radar-frame", "body" if moved else "sensor", "--out", out).code == 0
    assert json.loads(out.read_text())["verdict"]["level"] in ("good", "usable")
    assert error_of(out, sample)[0] < 0.1


def test_a_recording_file_states_the_frame_and_the_mount(cocalib, published):
    radar = published("base_link", moved=True, transforms=False)
    assert cocalib("info", radar, "--write", "--radar-frame", "body", *FLAGS).code == 0
    text = (radar.parent / "recording.toml").read_text()
    assert 'radar_frame = "body"' in text
    with open_recording(radar, require=("radar",)) as recording:
        origin = recording.returns_origin
        assert origin is not None
        assert origin.moved_by is not None
        moved = recording.radar_scans().points_radar_m
        assert not recording.has_plain_clouds
    with open_recording(radar, RecordingOptions(no_recording_file=True), require=("radar",)) as recording:
        as_published = recording.radar_scans().points_radar_m
    np.testing.assert_allclose(mount_of(CORNER) @ moved, as_published, atol=1e-9)


@pytest.mark.slow
def test_an_export_into_the_recording_takes_the_returns_back_as_the_calibration_did(
    cocalib, published, sample, tmp_path
):
    bags = (published("base_link", moved=True, transforms=False), sample / "camera.bag")
    calibration, out = tmp_path / "c.json", tmp_path / "all.mcap"
    assert cocalib("solve", *bags, "--clicks", sample / "clicks.json", "--out", calibration, *FLAGS).code == 0
    answer = cocalib("export", calibration, "--to", "mcap", "--recording", *bags, "--out", out)
    assert answer.code == 0, answer.err
    written = RecordingOptions(radar_topic="/cocalib/radar_points")
    with open_recording(out, written) as recording, open_recording(sample / "radar.bag", require=("radar",)) as own:
        assert recording.radar_frame == "cocalib_radar"
        points = recording.radar_scans().points_radar_m[:50]
        np.testing.assert_allclose(points, own.radar_scans().points_radar_m[:50], atol=1e-5)
