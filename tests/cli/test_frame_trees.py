"""`cocalib import`, `check` and `export` with the frame tree of a vehicle."""

import json
import os
import re
import stat
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from calib_core.interchange.importing import read_any
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.interchange.trees.reading import TreeFile, read_tree
from cocalib.cli import run
from tests.unit.interchange.trees import vehicles

KIND = "tf2_msgs/msg/TFMessage"
DRIVER = (
    ("camera_link", "camera_color_frame", (0.0, 0.015, 0.0), (0.0, 0.0, 0.0, 1.0)),
    ("camera_color_frame", "camera_color_optical_frame", (0.0, 0.0, 0.0), (-0.5, 0.5, -0.5, 0.5)),
)


@pytest.fixture
def calibration(project_root: Path, tmp_path: Path) -> Path:
    """A calibration of the frames radar_front and camera_front_optical_frame."""
    content = json.loads((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    content["frames"].update(radar="radar_front", camera="camera_front_optical_frame")
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


@pytest.fixture
def car(tmp_path: Path) -> Path:
    path = tmp_path / "car.urdf"
    path.write_text(vehicles.CAR_URDF, encoding="utf-8")
    return path


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A recording with the driver's /tf_static."""
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", KIND))
    types = store.types
    time = types["builtin_interfaces/msg/Time"](sec=1, nanosec=0)
    stamped = []
    for parent, child, shift, turn in DRIVER:
        header = types["std_msgs/msg/Header"](seq=0, stamp=time, frame_id=parent)
        vectors = types["geometry_msgs/msg/Vector3"](*shift), types["geometry_msgs/msg/Quaternion"](*turn)
        pose = types["geometry_msgs/msg/Transform"](*vectors)
        stamped.append(types["geometry_msgs/msg/TransformStamped"](header, child, pose))
    path = tmp_path / "drive.bag"
    with Writer(path) as writer:
        connection = writer.add_connection("/tf_static", KIND, typestore=store)
        writer.write(connection, 1, bytes(store.serialize_ros1(types[KIND](transforms=stamped), KIND)))
    return path


def test_import_names_the_flags_and_chains_what_they_choose(car, project_root, tmp_path, capsys):
    out = tmp_path / "imported.json"
    camera = project_root / "tests/golden/calibration-1.json"
    arguments = ["import", str(car), "--out", str(out), "--camera", str(camera)]

    assert run(arguments) == 2
    assert "--radar NAME and --camera-frame" in capsys.readouterr().err
    assert run([*arguments, "--radar", "radar_front", "--camera-frame", "camera_front_link"]) == 3
    file = read_calibration(out.read_text(encoding="utf-8"))
    assert (file.frames.radar, file.frames.camera) == ("radar_front", "camera_front_optical_frame")
    assert [one.name for one in file.provenance.inputs] == ["car.urdf"]


def test_check_chains_a_folder_and_a_recording(calibration, recording, tmp_path, capsys):
    kit = tmp_path / "kit"
    kit.mkdir()
    (kit / "sensors_calibration.yaml").write_text(vehicles.SENSORS_CALIBRATION, encoding="utf-8")
    (kit / "sensor_kit_calibration.yaml").write_text(vehicles.SENSOR_KIT_CALIBRATION, encoding="utf-8")

    assert run(["check", str(kit), "--camera-frame", "camera0/camera_link"]) in (0, 3)
    assert "chained over 3 joints" in capsys.readouterr().out
    assert run(["check", str(recording)]) == 2
    assert "named like a radar" in capsys.readouterr().err


@pytest.mark.slow
def test_into_prints_a_diff_and_writes_only_when_told(calibration, car, tmp_path, capsys):
    arguments = ["export", str(calibration), "--into", str(car)]

    assert run(arguments) == 0
    shown = capsys.readouterr()
    assert car.read_text(encoding="utf-8") == vehicles.CAR_URDF
    assert [line[0] for line in shown.out.splitlines()[3:] if line[0] in "+-"] == ["-", "+"]
    assert "joint camera_front_joint, roof_rack" in shown.err
    assert "nothing is written" in shown.err
    assert run([*arguments, "--out", str(tmp_path / "copy.urdf")]) == 0
    assert run([*arguments, "--write"]) == 0
    assert car.read_bytes() == (tmp_path / "copy.urdf").read_bytes()
    capsys.readouterr()
    frames = ["--radar", "radar_front", "--camera-frame", "camera_front_link"]
    assert run(["check", str(car), "--against", str(calibration), *frames]) == 0
    assert run([*arguments, "--to", "urdf"]) == 2
    assert "give one of them" in capsys.readouterr().err


def test_into_keeps_mode_and_owner_and_refuses_a_read_only_file(calibration, car, capsys):
    arguments = ["export", str(calibration), "--into", str(car), "--write"]
    car.chmod(0o444)

    assert run(arguments) == 2
    assert "is read-only" in capsys.readouterr().err
    assert car.read_text(encoding="utf-8") == vehicles.CAR_URDF
    car.chmod(0o664)
    owner = (1234, 2345) if os.getuid() == 0 else (os.getuid(), os.getgid())
    os.chown(car, *owner)
    assert run(arguments) == 0
    found = car.stat()
    assert car.read_text(encoding="utf-8") != vehicles.CAR_URDF
    assert (stat.S_IMODE(found.st_mode), found.st_uid, found.st_gid) == (0o664, *owner)


def test_into_respects_the_drivers_chain_of_a_recording(calibration, recording, tmp_path):
    cart = tmp_path / "cart.urdf"
    cart.write_text(vehicles.REALSENSE_URDF, encoding="utf-8")
    frames = ["--radar", "radar", "--camera-frame", "camera_color_optical_frame"]

    assert run(["export", str(calibration), "--into", str(cart), "--tree", str(recording), *frames, "--write"]) == 0
    expected = read_calibration(calibration.read_text(encoding="utf-8")).calibration.camera_from_radar
    frames[-1] = "camera_color_optical_frame"
    out = tmp_path / "again.json"
    assert run(["import", str(cart), str(recording), *frames, "--camera", str(calibration), "--out", str(out)]) == 3
    again = read_calibration(out.read_text(encoding="utf-8")).calibration.camera_from_radar
    np.testing.assert_allclose(again.as_matrix(), expected.as_matrix(), rtol=0, atol=1e-6)


def test_a_static_transform_leads_to_the_root_of_the_drivers_chain(calibration, recording, capsys):
    arguments = ["export", str(calibration), "--to", "tf2", "--tree", str(recording)]

    assert run([*arguments, "--camera-frame", "camera_color_optical_frame"]) == 0
    shown = capsys.readouterr()
    assert "--frame-id radar_front --child-frame-id camera_link" in shown.out
    assert "from radar_front to camera_link" in shown.err
    joint = read_tree([TreeFile(shown.out.encode(), "tf.sh")]).joints[0]
    assert (joint.parent, joint.child) == ("radar_front", "camera_link")


def test_frames_are_renamed_and_the_origin_stays(calibration, capsys):
    original, hashes = read_any(calibration.read_bytes()), []
    for names in ([], ["--radar", "bumper_radar", "--camera-frame", "cam0_optical"]):
        assert run(["export", str(calibration), "--to", "tf2", *names]) == 0
        text = capsys.readouterr().out
        hashes.append(re.findall(r"sha256 (\w+)", text))
    found = read_any(text)
    assert (found.frames.radar, found.frames.camera) == ("bumper_radar", "cam0_optical")
    assert hashes[0] == hashes[1]
    poses = [one.camera_from_radar.as_matrix() for one in (found, original)]
    np.testing.assert_allclose(*poses, rtol=0, atol=1e-9)


def test_an_expression_is_refused_with_its_line_and_the_numbers(calibration, car, capsys):
    car.write_text(vehicles.CAR_URDF.replace('"0.25 -0.02 0.11"', '"${x} -0.02 0.11"'), encoding="utf-8")
    assert run(["export", str(calibration), "--into", str(car)]) == 2
    words = r'car\.urdf:32: .*its origin is an expression.*Write there by hand: xyz="'
    assert re.search(words, capsys.readouterr().err)


def test_poses_in_a_common_frame_are_composed_and_chosen_by_name(tmp_path, capsys):
    """As Astyx has them, here with two cameras."""
    optical = np.array([[0.0, -1, 0, 0.2], [0, 0, -1, 1.0], [1, 0, 0, 0.5], [0, 0, 0, 1]])
    at = {"radar": np.eye(4), "camera_front": np.linalg.inv(optical), "camera_left": np.eye(4)}
    lens = {"K": [[900, 0, 640], [0, 900, 360], [0, 0, 1]]}
    sensors = [
        {"sensor_uid": name, "calib_data": {"T_to_ref_COS": pose.tolist(), **(lens if "cam" in name else {})}}
        for name, pose in at.items()
    ]
    file, out = tmp_path / "000000.json", tmp_path / "c.json"
    file.write_text(json.dumps({"sensors": sensors}))
    arguments = ["import", str(file), "--out", str(out), "--image-size", "1280", "720"]
    assert run(arguments) == 2
    assert "2 camera frames" in capsys.readouterr().err
    assert run([*arguments, "--camera", "camera_front", "--radar", "radar"]) == 3
    document = json.loads(out.read_text())
    np.testing.assert_allclose(document["camera_from_radar"]["translation_m"], optical[:3, 3], atol=1e-9)
    assert document["frames"] == {"radar": "radar", "camera": "camera_front"}
    assert document["evidence"] == "imported_assumed"
