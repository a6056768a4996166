"""Written recordings: another reader finds in them exactly what was simulated."""

import csv
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from calib_core.errors import InputError, RecordingError
from calib_core.measurements import RadarScan, TimeNs
from calib_core.radar import polar_from_cartesian
from calib_core.recordings.containers.writing import RadarReturnMessage, RecordedMessage, write_ros1_bag
from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import SimulatedFrame, SimulatedRecording, simulate
from calib_core.synthetic.rig import OTHER_OFFSET_M

_SIZE = {"width_px": 128, "height_px": 80, "camera_rate_hz": 1.0, "radar_rate_hz": 5.0}
OPTIONS = SimulationOptions(placements=2, dwell_s=4.0, seed=5, **_SIZE)


@pytest.fixture(scope="module")
def recording() -> SimulatedRecording:
    return simulate(OPTIONS)


@pytest.fixture(scope="module")
def folder(recording: SimulatedRecording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("recording")
    write_recording(recording, target, ("ros1", "mcap", "db3"))
    return target


@pytest.fixture(scope="module")
def scans(recording: SimulatedRecording) -> tuple[RadarScan, ...]:
    return tuple(scan for antenna in recording.stage.antennas for scan in recording.scans_of(antenna))


@pytest.fixture(scope="module")
def frames(recording: SimulatedRecording) -> tuple[SimulatedFrame, ...]:
    return tuple(recording.frames())


def _messages(paths: list[Path], topic: str) -> Iterator[tuple[int, Any]]:
    with AnyReader(paths, default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, time, raw in reader.messages([c for c in reader.connections if c.topic == topic]):
            yield time, reader.deserialize(raw, connection.msgtype)


def _stamp(message: Any) -> int:
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


def _cloud(message: Any) -> np.ndarray:
    return np.frombuffer(message.data.tobytes(), dtype="<f4").reshape(message.width, len(message.fields))


@pytest.mark.slow
def test_a_ros_1_radar_bag_has_one_message_per_return_and_point_ids_that_restart_in_each_scan(scans, folder):
    messages = [message for _, message in _messages([folder / "radar.bag"], "/ti_mmwave/radar_scan")]
    assert [m.point_id for m in messages] == [i for scan in scans for i in range(len(scan))]
    assert [_stamp(m) for m in messages if m.point_id == 0] == [int(scan.time) for scan in scans if len(scan)]
    points = np.array([[m.x, m.y, m.z] for m in messages])
    assert np.array_equal(points, np.concatenate([scan.points_radar_m for scan in scans]))
    assert np.array_equal([m.velocity for m in messages], np.concatenate([scan.doppler_mps for scan in scans]))
    assert np.array_equal([m.intensity for m in messages], np.concatenate([scan.snr_db for scan in scans]))
    assert [m.range for m in messages] == pytest.approx(np.linalg.norm(points, axis=1), rel=1e-6)
    assert [m.bearing for m in messages] == pytest.approx(np.rad2deg(np.arctan2(points[:, 1], points[:, 0])), rel=1e-5)
    assert {m.doppler_bin for m in messages if m.velocity == 0.0} == {16}


@pytest.mark.parametrize("container", ["mcap", "db3"])
def test_ros_2_bags_hold_the_same_scans_as_clouds_and_open_as_folder_and_as_file(scans, folder, container):
    inside = folder / f"recording_{container}"
    for path in (inside, inside / f"recording_{container}.{container}"):
        clouds = [message for _, message in _messages([path], "/ti_mmwave/radar_scan_pcl")]
        assert [_stamp(cloud) for cloud in clouds] == [int(scan.time) for scan in scans]
        for cloud, scan in zip(clouds, scans, strict=True):
            values = _cloud(cloud)
            assert [f.name for f in cloud.fields] == ["x", "y", "z", "intensity", "velocity"]
            assert np.array_equal(values[:, :3].astype(float), scan.points_radar_m)
            assert np.array_equal(values[:, 4].astype(float), scan.doppler_mps)
    assert (inside / "metadata.yaml").is_file()


@pytest.mark.parametrize("name", ["camera.bag", "recording_mcap", "recording_db3"])
def test_every_container_holds_the_rendered_frames_with_both_stamps(frames, folder, name):
    images = list(_messages([folder / name], "/camera/image_raw/compressed"))
    assert [time for time, _ in images] == [int(frame.receive_time) for frame in frames]
    for (_, message), frame in zip(images, frames, strict=True):
        data = message.data.tobytes()
        assert _stamp(message) == int(frame.time)
        assert data == frame.jpeg(OPTIONS.jpeg_quality)
        decoded = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR)
        assert decoded.shape == (80, 128, 3)
        assert np.abs(decoded.astype(float) - frame.pixels).mean() < 6.0


def test_camera_info_carries_the_intrinsics(recording, folder):
    infos = [message for _, message in _messages([folder / "camera.bag"], "/camera/camera_info")]
    assert len(infos) == len(list(_messages([folder / "camera.bag"], "/camera/image_raw/compressed")))
    assert np.array_equal(infos[0].K.reshape(3, 3), recording.camera.matrix_px)
    assert np.array_equal(infos[0].D, recording.camera.distortion)
    assert (infos[0].distortion_model, infos[0].width, infos[0].height) == ("plumb_bob", 128, 80)


@pytest.mark.slow
def test_an_imaging_radar_writes_clouds_to_ros_1_too(tmp_path):
    recording = simulate(replace(OPTIONS, placements=1, radar="imaging", camera_rate_hz=1.0))
    write_recording(recording, tmp_path)
    clouds = [message for _, message in _messages([tmp_path / "radar.bag"], "/ti_mmwave/radar_scan_pcl")]
    assert len(clouds) == len(recording.scans)


def test_truth_and_clicks_agree_with_the_simulation(recording, folder):
    truth = json.loads((folder / "truth.json").read_text())
    clicks = json.loads((folder / "clicks.json").read_text())
    assert truth["schema"] == "cocalib/truth-1"
    assert np.array_equal(truth["camera_from_radar"]["rotation"], recording.camera_from_radar.rotation)
    assert np.array_equal(truth["camera_from_radar"]["translation_m"], recording.camera_from_radar.translation_m)
    for entry, placement in zip(truth["placements"], recording.placements, strict=True):
        assert entry["start"]["sec"] * 10**9 + entry["start"]["nanosec"] == placement.start
        np.testing.assert_allclose(entry["pixel_px"], placement.pixel_px, rtol=0, atol=1e-6)
    assert clicks["schema"] == "cocalib/clicks-1"
    assert [entry["image_time"] for entry in clicks["clicks"]] == [e["best_image_time"] for e in truth["placements"]]


def test_a_recording_is_never_overwritten(recording, folder):
    with pytest.raises(RecordingError, match=r"radar\.bag already exists"):
        write_recording(recording, folder)


def test_a_bag_reads_back(tmp_path):
    body = RadarReturnMessage(TimeNs(7), "radar", 0, 1.0, -2.0, 0.5, 2.25, -0.5, 12, -63.5, 21.0)
    path = write_ros1_bag(tmp_path / "one.bag", [RecordedMessage("/radar", TimeNs(9), body)])
    [(time, message)] = _messages([path], "/radar")
    assert time == 9
    assert (message.x, message.y, message.z, message.velocity, message.doppler_bin) == (1.0, -2.0, 0.5, -0.5, 12)


@pytest.mark.slow
def test_a_folder_without_ros_has_dated_images_and_every_return(recording, scans, frames, tmp_path):
    write_recording(recording, tmp_path, ("csv",))
    images = sorted((tmp_path / "recording_csv" / "camera").iterdir())
    for path, frame in zip(images, frames, strict=True):
        when = datetime.strptime(path.stem, "img_%Y-%m-%d_%H-%M-%S-%f").replace(tzinfo=UTC)
        assert abs(when.timestamp() - frame.time / 1e9) < 2e-6
    rows = list(csv.reader((tmp_path / "recording_csv" / "radar.csv").read_text().splitlines(), delimiter=";"))[1:]
    azimuths_deg = np.concatenate([np.rad2deg(polar_from_cartesian(scan.points_radar_m)[:, 1]) for scan in scans])
    np.testing.assert_allclose([float(row[3]) for row in rows], azimuths_deg, atol=1e-6)


@pytest.mark.slow
def test_a_second_camera_is_written_into_the_same_recording(tmp_path):
    recording = simulate(replace(OPTIONS, camera_rate_hz=1.0, other_camera=True))
    other = recording.other_camera
    assert other is not None
    write_recording(recording, tmp_path)
    for name, one in (("camera", recording), ("camera_2", other)):
        times = [
            _stamp(message) for _, message in _messages([tmp_path / "camera.bag"], f"/{name}/image_raw/compressed")
        ]
        assert times == one.stage.frame_times.header_ns.tolist()
    truth = json.loads((tmp_path / "truth_2.json").read_text())
    assert truth["camera_from_radar"]["translation_m"] == other.camera_from_radar.translation_m.tolist()
    clicks = json.loads((tmp_path / "clicks_2.json").read_text())
    assert len(clicks["clicks"]) == len(other.clicks) == OPTIONS.placements


def test_the_second_camera_sees_the_same_placements_from_its_own_rig():
    options = replace(OPTIONS, placements=8, other_camera=True)
    recording = simulate(options)
    other = recording.other_camera
    assert np.linalg.norm(other.stage.rig.camera_position_radar_m - OTHER_OFFSET_M) < 0.06
    assert len(other.placements) == 8
    for here, there in zip(recording.placements, other.placements, strict=True):
        assert np.array_equal(here.position_radar_m, there.position_radar_m)
        assert other.camera.in_image(there.pixel_px[None])[0]
    assert simulate(OPTIONS).other_camera is None


def test_a_folder_of_images_has_no_room_for_a_second_camera(tmp_path):
    recording = simulate(replace(OPTIONS, other_camera=True))
    with pytest.raises(InputError, match="write a recording of two cameras as ros1, mcap or db3"):
        write_recording(recording, tmp_path / "new", ("csv",))
    assert not (tmp_path / "new").exists()


# Presets: each can be simulated, differs from the default, and gives way to what is asked for.


SMALL = {"placements": 4, "dwell_s": 3.5, "radar_rate_hz": 2.0, "camera_rate_hz": 4.0}


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_is_a_recording_of_its_own(name):
    options = PRESETS[name]
    assert (options == SimulationOptions()) == (name == "default")
    small = replace(options, **SMALL)
    recording = simulate(small)
    assert len(recording.placements) == small.standing_places
    assert len(recording.clicks) >= 4
    assert len(next(recording.scans_of(recording.stage.antennas[0]))) > 0


def test_the_page_describes_every_preset_and_no_other(project_root):
    page = (project_root / "docs" / "simulation.md").read_text()
    assert re.findall(r"^\| `([a-z0-9-]+)` \|", page, flags=re.MULTILINE) == list(PRESETS)
