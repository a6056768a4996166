"""Readers of other tools' files: variants of each shape, what they refuse, and what they take for granted."""

import io
import json
import zipfile
from typing import Any

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.exporting import export
from calib_core.interchange.importing import read_any, read_any_file
from calib_core.interchange.pose_parts import direction_by_facing
from calib_core.interchange.trees.frame_choice import WantedFrames

FORWARD = [0.1, -0.2, 0.3, -0.5, 0.5, -0.5, 0.5]  # a camera that looks along the radar's x axis, x y z qx qy qz qw
POSITION, TURN = FORWARD[:3], FORWARD[3:]
KOIDE3 = {
    "camera": {
        "camera_model": "plumb_bob",
        "intrinsics": [500.0, 501.0, 320.0, 240.0],
        "distortion_coeffs": [-0.1, 0.02, 1e-3, -1e-3, 0.0],
    },
    "results": {"T_lidar_camera": FORWARD},
}
MATRIX = [[0, 0, 1, 0.1], [-1, 0, 0, -0.2], [0, -1, 0, 0.3], [0, 0, 0, 1]]
ECHO = "At time 0.0\n- Translation: [{}]\n- Rotation: in Quaternion [{}]\n"


def refusal(content: str | dict[str, Any]) -> str:
    with pytest.raises(InputError) as refused:
        read_any(content if isinstance(content, str) else json.dumps(content), "file")
    assert str(refused.value).startswith("file:")
    return str(refused.value)


def echo(position: list[float], turn: list[float], more: str = "") -> str:
    return ECHO.format(", ".join(map(str, position)), ", ".join(map(str, turn))) + more


def labelled(systems: dict[str, Any], streams: dict[str, Any] | None = None) -> dict[str, Any]:
    return {"openlabel": {"coordinate_systems": systems, "streams": streams or {}}}


def placed(parent: str, matrix: Any = None) -> dict[str, Any]:
    return {"type": "sensor_cs", "parent": parent, "pose_wrt_parent": {"matrix4x4": np.ravel(matrix).tolist()}}


def extrinsic(sensor: str, target: str, matrix: Any = MATRIX) -> dict[str, Any]:
    return {"sensor_name": sensor, "target_sensor_name": target, "param": {"sensor_calib": {"data": matrix}}}


def test_without_our_statement_a_file_is_read_the_same_and_its_meaning_is_assumed(file):
    ours = export(file, "matrix").data.decode()
    bare = read_any("\n".join(line for line in ours.splitlines() if not line.startswith("#")))
    whole = read_any(ours)

    np.testing.assert_array_equal(bare.camera_from_radar.as_matrix(), whole.camera_from_radar.as_matrix())
    assert (whole.assumptions, whole.evidence, bare.evidence) == ((), "clicked", None)
    assert bare.assumptions
    assert bare.check_point is None


def test_a_lens_without_an_image_size_is_completed_with_it():
    found = read_any(json.dumps(KOIDE3))
    assert found.camera is None
    camera = found.camera_for((640, 480))
    assert (camera.model, camera.width_px, camera.height_px) == ("plumb_bob", 640, 480)
    np.testing.assert_array_equal(camera.matrix_px, [[500.0, 0.0, 320.0], [0.0, 501.0, 240.0], [0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(camera.distortion, KOIDE3["camera"]["distortion_coeffs"])


def test_a_lens_of_another_kind_is_left_out_with_a_note():
    found = read_any(json.dumps(KOIDE3 | {"camera": KOIDE3["camera"] | {"camera_model": "omnidir"}}))
    assert (found.camera, found.matrix_px) == (None, None)
    assert any("omnidir" in note for note in found.notes)


def test_a_foxglove_camera_calibration_tells_which_frame_is_the_cameras_and_its_lens():
    transform = {
        "parent_frame_id": "front",
        "child_frame_id": "eye",
        "translation": dict(zip("xyz", POSITION, strict=True)),
        "rotation": dict(zip("xyzw", TURN, strict=True)),
    }
    camera = {
        "frame_id": "eye",
        "width": 640,
        "height": 480,
        "distortion_model": "plumb_bob",
        "D": [0.1, 0.0, 0.0, 0.0, 0.0],
    }
    camera |= {"K": [500.0, 0.0, 320.0, 0.0, 501.0, 240.0, 0.0, 0.0, 1.0]}
    found = read_any(json.dumps({"FrameTransform": transform, "CameraCalibration": camera}))
    assert (found.format, found.frames, found.assumptions) == ("foxglove", FrameNames("front", "eye"), ())
    assert (found.camera.width_px, found.camera.distortion[0]) == (640, 0.1)
    np.testing.assert_allclose(found.pose.as_written().translation_m, POSITION)


def test_of_several_extrinsics_the_one_of_the_radar_is_taken():
    content = {"a": extrinsic("lidar", "front_camera"), "b": extrinsic("front_camera", "front_radar")}
    found = read_any(json.dumps(content))
    assert (found.pose.direction, found.frames and found.frames.radar) == ("radar_from_camera", "front_radar")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"a": extrinsic("radar", "camera", np.transpose(MATRIX).tolist())}, "the matrix is transposed"),
        ({"a": extrinsic("radar", "camera", [[1, 0], [0, 1]])}, "expected 16 numbers, found 4"),
        ({"a": extrinsic("radar", "camera", np.diag([1, 1, -1, 1]).tolist())}, "mirrored"),
        (
            {"a": extrinsic("radar", "camera_1"), "b": extrinsic("radar", "camera_2")},
            "2 of them between a radar and a camera",
        ),
        ({"results": {"T_lidar_camera": [1, 2, 3]}}, "expected 7 numbers, found 3"),
        ({"results": {"T_lidar_camera": [0, 0, 0, 1, 1, 1, 1]}}, "has length 2, not 1"),
        (labelled({"radar": placed("a", np.eye(4)), "camera": placed("b", MATRIX)}), "not connected"),
        (labelled({"radar": placed("camera", np.eye(4)), "camera": placed("radar", MATRIX)}), "form a circle"),
        (
            labelled({"radar": placed("", np.eye(4)), "cam1": placed("", MATRIX), "cam2": placed("", MATRIX)}),
            "2 camera frames",
        ),
        (labelled({"camera": placed("", np.eye(4))}), "is no radar by its name"),
        (
            labelled({"radar": placed("", np.eye(4)), "camera": {"pose_wrt_parent": {"euler_angles": [0, 0, 0]}}}),
            "neither",
        ),
        (
            labelled(
                {"radar": placed("", np.eye(4)), "camera": placed("radar", MATRIX)},
                {"camera": {"stream_properties": {"intrinsics_pinhole": {"camera_matrix_3x4": [1.0] * 12}}}},
            ),
            "a projection with a pose in it",
        ),
        (
            {"transforms": [{"parent_frame_id": "base", "child_frame_id": name} for name in ("camera", "radar")]},
            "transforms[0].translation: missing",
        ),
    ],
)
def test_json_of_another_tool_that_cannot_be_read_is_refused_in_words(content, words):
    assert words in refusal(content)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (echo(POSITION, TURN) + echo([0.2, -0.2, 0.3], TURN), "changes from one print to the next"),
        (echo(POSITION, TURN, "- Rotation: in RPY (degree) [1, 2, 3]\n"), "disagree"),
        (echo(POSITION, [0, 0, 0, 1]), "names no frames"),
        ("$ tf2_echo base_link camera\n" + echo(POSITION, TURN), "--radar base_link"),
        ("$ tf2_echo base_link radar\n" + echo(POSITION, TURN), "--camera-frame base_link"),
        (echo([0.1, 0.2], TURN), "Translation: expected 3 numbers, found 2"),
        ("12.5 0.1 -0.2 0.3 0 0 0 1\n", "convert the file with cocalib import"),
        ("calib_time: 1\nR: 1 0 0 0 1 0 0 0 1\nR: 1 0 0 0 1 0 0 0 1\nT: 0 0 0\n", "R appears twice"),
        ("calib_time: 1\nR: 1 0 0 0 1 0 0 0 1\nT: 0 0\n", "T: expected 3 numbers, found 2"),
        ("P2: 0 0 0 0 0 0 0 0 0 0 0 0\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n", "no camera matrix"),
        ("transformation: {x: 0}\nparameters: {tracking_base_frame: camera}\n", "has no name; name both"),
        ("a: 1\n---\nb: 2\n", "contains 2 YAML documents"),
        ("CameraExtrinsicMat: [1, 2]\n", "expected 16 numbers, found 2"),
    ],
)
def test_text_of_another_tool_that_cannot_be_read_is_refused_in_words(content, words):
    assert words in refusal(content)


def test_the_command_above_an_echo_tells_which_way_it_goes():
    text = echo(POSITION, TURN)
    forth = read_any(f"$ ros2 run tf2_ros tf2_echo radar camera_optical_frame\n{text}")
    back = read_any(f"$ ros2 run tf2_ros tf2_echo camera_optical_frame radar\n{text}")
    np.testing.assert_allclose(
        forth.camera_from_radar.as_matrix() @ back.camera_from_radar.as_matrix(), np.eye(4), atol=1e-12
    )
    assert forth.assumptions == back.assumptions == ()


def test_the_oldest_hand_eye_file_has_its_parameters_at_the_top():
    numbers = dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), FORWARD, strict=True))
    text = "eye_on_hand: true\nrobot_effector_frame: radar\ntracking_base_frame: camera_optical\ntransformation:\n"
    found = read_any(text + "".join(f"  {key}: {value}\n" for key, value in numbers.items()))
    assert found.format == "easy_handeye"
    np.testing.assert_allclose(found.pose.translation_m, POSITION)


def test_where_a_camera_looks_tells_the_direction_only_if_one_direction_fits():
    radar_from_camera = np.array(MATRIX, dtype=float)[:3, :3]
    sideways = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert direction_by_facing(radar_from_camera) == "radar_from_camera"
    assert direction_by_facing(radar_from_camera.T) == "camera_from_radar"
    assert direction_by_facing(sideways @ radar_from_camera) is None
    assert direction_by_facing(np.eye(3)) is None


def test_a_corrected_rig_keeps_unknown_corrections_out():
    sensors = [
        {"name": "r", "protocol": "radar", "nominalSensor2Rig_FLU": {"roll-pitch-yaw": [0, 0, 0], "t": [0, 0, 0]}},
        {"name": "c", "protocol": "camera", "nominalSensor2Rig_FLU": {"roll-pitch-yaw": [0, 0, 0], "t": [0, 0, 1]}},
    ]
    sensors[1]["correction_rig_T"] = [0, 0, 0.5]
    found = read_any(json.dumps({"rig": {"sensors": sensors}}))
    np.testing.assert_allclose(found.pose.translation_m, [0, 0, 1.5])
    assert "corrections" in found.assumptions[0]
    sensors[1]["correction_other_R"] = [0, 0, 0.5]
    assert "correction_other_R is not zero" in refusal({"rig": {"sensors": sensors}})


def test_a_log_line_before_the_text_is_not_taken_for_json():
    text = "[INFO] [1.5] [tf2_echo]: Waiting for transform radar ->  camera_optical: no\n" + echo(POSITION, TURN)
    assert read_any(text).format == "tf-echo"
    assert "not JSON" in refusal("[1, 2")


def test_a_stereo_pair_is_not_taken_for_radar_and_camera():
    matrices = "".join(
        f"{key}: !!opencv-matrix\n   rows: 3\n   cols: {len(values) // 3}\n   dt: d\n   data: {values}\n"
        for key, values in {
            "M1": [5.0] * 9,
            "M2": [5.0] * 9,
            "R": [1, 0, 0, 0, 1, 0, 0, 0, 1],
            "T": [-0.1, 0, 0],
        }.items()
    )
    assert "a stereo pair (M2)" in refusal("%YAML:1.0\n---\n" + matrices)


def test_openlabels_radar_of_another_stream_type_is_found_by_its_name():
    systems = {
        name: {"type": "sensor_cs", "parent": "car", "pose_wrt_parent": {"matrix4x4": np.ravel(matrix).tolist()}}
        for name, matrix in (("RADAR_FRONT", np.eye(4)), ("CAM_FRONT", MATRIX))
    }
    label = labelled(systems, {"RADAR_FRONT": {"type": "other"}, "CAM_FRONT": {"type": "camera"}})
    np.testing.assert_allclose(read_any(json.dumps(label)).pose.as_written().as_matrix(), MATRIX)


def test_a_folder_of_colmaps_text_files_is_read_as_its_archive(tmp_path, file):
    unpacked = zipfile.ZipFile(io.BytesIO(export(file, "colmap").data))
    unpacked.extractall(tmp_path)

    found = read_any_file(tmp_path)

    np.testing.assert_allclose(found.camera.matrix_px, file.calibration.camera.matrix_px, rtol=1e-12)
    assert found.evidence == file.rests_on
    assert found.assumptions == ()
    np.testing.assert_allclose(
        found.camera_from_radar.as_matrix(), file.calibration.camera_from_radar.as_matrix(), rtol=0, atol=1e-12
    )
    images = tmp_path / "images.txt"
    images.write_text("".join(line for line in images.read_text().splitlines(keepends=True) if line[0] != "#"))
    assert "its world frame" in read_any_file(images).assumptions[0]
    pose, points = images.read_text().splitlines()[0], "10.5 20.5 -1 30.0 40.0 7"
    images.write_text(f"{pose}\n{points}\n")
    np.testing.assert_array_equal(read_any_file(images).pose.rotation, found.pose.rotation)
    images.write_text(images.read_text() * 2)
    with pytest.raises(InputError, match="contains 2 images"):
        read_any_file(images)


def test_kittis_folder_is_read_and_its_imu_refused(tmp_path):
    numbers = "calib_time: 1\nR: 0 -1 0 0 0 -1 1 0 0\nT: 0.1 0.2 0.3\n"
    (tmp_path / "calib_imu_to_velo.txt").write_text(numbers)
    (tmp_path / "calib_velo_to_cam.txt").write_text(numbers)

    np.testing.assert_array_equal(read_any_file(tmp_path).pose.translation_m, [0.1, 0.2, 0.3])
    with pytest.raises(InputError, match=r"between IMU and Velodyne.*give calib_velo_to_cam.txt"):
        read_any_file(tmp_path / "calib_imu_to_velo.txt")


def _published(parent: str, child: str, position: list[float]) -> str:
    numbers = " ".join(map(str, position + TURN))
    return f"ros2 run tf2_ros static_transform_publisher {numbers} {parent} {child}\n"


@pytest.mark.parametrize("other", ["base_link", "velodyne", "imu_link", "novatel"])
def test_the_camera_in_the_vehicle_or_another_sensor_is_not_taken_for_the_radars(other):
    text = _published(other, "camera_optical", POSITION)
    assert f"{other!r} is no radar" in refusal(text)
    assert f"--radar {other}" in refusal(text)
    named = read_any(text, "file", WantedFrames(other))
    np.testing.assert_allclose(named.pose.as_written().translation_m, POSITION)
    transform = {
        "parent_frame_id": other,
        "child_frame_id": "camera_optical",
        "translation": dict(zip("xyz", POSITION, strict=True)),
        "rotation": dict(zip("xyzw", TURN, strict=True)),
    }
    assert "no radar by its" in refusal(transform)
    assert read_any(json.dumps(transform), "file", WantedFrames(other)).frames.radar == other


def test_the_frame_that_is_a_camera_by_name_is_never_the_radars():
    found = read_any(_published("camera_optical", "front_sensor", POSITION))
    assert (found.frames.radar, found.frames.camera) == ("front_sensor", "camera_optical")
    assert found.pose.direction == "camera_from_radar"
    assert "assumed 'front_sensor'" in found.assumptions[0]


def test_an_echo_with_too_few_decimals_is_refused_with_how_to_print_more():
    assert "too few decimals" in refusal(echo(POSITION, [0.6, -0.4, 0.4, -0.5]))


def test_nuscenes_says_which_of_two_unnamed_sensors_is_taken_for_the_radar():
    pose = {"translation": [0, 0, 1], "rotation": [0.5, -0.5, 0.5, -0.5]}
    camera = pose | {"camera_intrinsic": [[500, 0, 320], [0, 500, 240], [0, 0, 1]]}
    found = read_any(json.dumps([camera, {"translation": [0, 0, 0], "rotation": [1, 0, 0, 0], "camera_intrinsic": []}]))
    assert any("sensor without camera_intrinsic" in text for text in found.assumptions)
    named = camera | {"rotation": {"x": -0.5, "y": 0.5, "z": -0.5, "w": 0.5}}
    by_names = read_any(json.dumps([named, {"translation": [0, 0, 0], "rotation": [1, 0, 0, 0]}]))
    np.testing.assert_array_equal(by_names.pose.rotation, found.pose.rotation)


def test_the_order_of_nuscenes_rotations_is_told_by_what_stands_upright():
    level, forward = [0.999, 0.01, -0.02, 0.04], [0.51, -0.49, 0.5, -0.5]  # of a radar and of a camera, w x y z
    level, forward = (list(np.array(one) / np.linalg.norm(one)) for one in (level, forward))
    intrinsic = {"camera_intrinsic": [[500, 0, 320], [0, 500, 240], [0, 0, 1]]}

    def found(camera: list[float], *radar: list[float]):
        records = [{"translation": [0, 0, 1], "rotation": camera, **intrinsic}]
        return read_any(json.dumps(records + [{"translation": [3, 0, 0.5], "rotation": one} for one in radar]))

    right = found(forward, level)
    assert not any("x y z w" in one for one in right.assumptions)
    last = found([*forward[1:], forward[0]], [*level[1:], level[0]])
    assert any("in the order x y z w" in one for one in last.assumptions)
    np.testing.assert_allclose(last.camera_from_radar.as_matrix(), right.camera_from_radar.as_matrix(), atol=1e-9)
    alone = found(forward)
    assert any("check which order" in one for one in alone.assumptions)
    np.testing.assert_allclose(alone.pose.rotation, forward)


# COLMAP's camera models: each becomes the right lens, and no coefficient is lost.


@pytest.fixture
def read(file):
    exported = zipfile.ZipFile(io.BytesIO(export(file, "colmap").data))

    def read(model: str, *coefficients: float) -> Camera:
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            archive.writestr("images.txt", exported.read("images.txt"))
            numbers = " ".join(map(str, coefficients))
            archive.writestr("cameras.txt", f"1 {model} 640 480 500 501 320 240 {numbers}\n")
        return read_any(packed.getvalue(), "colmap.zip").camera

    return read


@pytest.mark.parametrize(
    ("model", "coefficients", "lens", "kept"),
    [
        ("PINHOLE", (), "pinhole", []),
        ("OPENCV", (0.1, 0.2, 0.3, 0.4), "plumb_bob", [0.1, 0.2, 0.3, 0.4]),
        ("FULL_OPENCV", (0.1, 0.2, 0.3, 0.4, 0.5, 0.0, 0.0, 0.0), "plumb_bob", [0.1, 0.2, 0.3, 0.4, 0.5]),
        ("FULL_OPENCV", (0.1,) * 8, "rational_polynomial", [0.1] * 8),
        ("OPENCV_FISHEYE", (0.1, 0.2, 0.3, 0.4), "equidistant", [0.1, 0.2, 0.3, 0.4]),
    ],
)
def test_each_camera_model_becomes_the_smallest_lens_that_fits_it(read, model, coefficients, lens, kept):
    camera = read(model, *coefficients)
    assert (camera.model, camera.distortion.tolist()) == (lens, kept)


@pytest.mark.parametrize(
    ("model", "coefficients", "words"),
    [
        ("OPENCV", (0.1,) * 6, "plumb_bob takes 4 or 5 distortion coefficients, found 6"),
        ("PINHOLE", (0.1,), "pinhole takes 0 distortion coefficients, found 1"),
        ("FULL_OPENCV", (0.1,) * 7, "rational_polynomial takes 8 distortion coefficients, found 7"),
        ("THIN_PRISM_FISHEYE", (), "not supported; known: PINHOLE, OPENCV, FULL_OPENCV, OPENCV_FISHEYE"),
    ],
)
def test_coefficients_without_a_place_are_refused_and_not_dropped(read, model, coefficients, words):
    with pytest.raises(InputError, match=words):
        read(model, *coefficients)
