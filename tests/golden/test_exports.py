"""One published transform in every format, against numbers worked out apart from this code, read by other people's readers.

The transform is the one the paper's authors print with their code: rvec 1.30927651 -1.29183232 1.09104368,
tvec -0.00115773 -0.0608874 -0.01496503. Expected numbers are given to the digits that were printed.
"""

import io
import shlex
import zipfile

import numpy as np
import pytest
from ruamel.yaml import YAML
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.exporting import export
from calib_core.interchange.formats.registry import FORMATS, format_named
from calib_core.interchange.importing import read_any

RADAR_FROM_CAMERA_M = [0.006418, 0.000900, -0.062374]
QUATERNION_XYZW = [-0.536832, 0.529679, -0.447351, 0.480758]
RPY_RAD = [-1.708788, 0.028995, -1.532137]
LINK_QUATERNION_XYZW = [0.013127, 0.069200, 0.020280, 0.997310]
LINK_RPY_RAD = [0.029273, 0.137933, 0.042686]
CAMERA_FROM_RADAR_XYZ_M = [-0.001158, -0.060887, -0.014965]
CAMERA_FROM_RADAR_XYZW = [0.536832, -0.529679, 0.447351, 0.480758]
ROWS = [
    [0.03863361, -0.99883281, -0.02899066, -0.00115773],
    [-0.13856096, 0.02337719, -0.99007796, -0.06088740],
    [0.98960007, 0.04226726, -0.13749609, -0.01496503],
]
P_RADAR_M, P_CAMERA_M = [5.0, 1.0, -0.5], [-0.792327, -0.235276, 5.044051]
PIXEL_PX = [212.918515, 239.443277]
SIX = {"atol": 6e-7, "rtol": 0}
EIGHT = {"atol": 6e-9, "rtol": 0}


def text_of(file: CalibrationFile, name: str) -> str:
    return export(file, name, rectified=format_named(name).is_for_rectified).data.decode()


def yaml_of(text: str) -> dict:
    return YAML(typ="safe", pure=True).load(text)


def test_the_published_vectors_are_what_they_say(file):
    pose = file.calibration.camera_from_radar

    np.testing.assert_allclose(pose.as_matrix()[:3], ROWS, **EIGHT)
    np.testing.assert_allclose((pose @ np.array([P_RADAR_M]))[0], P_CAMERA_M, **SIX)
    np.testing.assert_allclose(file.calibration.reproject(np.array([P_RADAR_M]))[0], PIXEL_PX, **SIX)
    np.testing.assert_allclose(pose.translation_m, CAMERA_FROM_RADAR_XYZ_M, **SIX)
    np.testing.assert_allclose(Rotation.from_matrix(pose.rotation).as_quat(), CAMERA_FROM_RADAR_XYZW, **SIX)


@pytest.mark.parametrize(
    "form", [form.name for form in FORMATS if form.comment in ("#", "<!-- -->") and form.name != "colmap"]
)
def test_a_file_that_may_hold_comments_says_frames_equation_and_check_point(file, form):
    text = text_of(file, form)

    assert "p_camera = R p_radar + t" in text
    assert 'radar frame "radar"' in text
    assert 'camera frame "camera_optical"' in text
    assert "m -> p_camera [-0.792327" in text
    assert "-> pixel [212.918515" in text


def test_the_command_publishes_the_camera_in_the_radar_frame(file):
    command = text_of(file, "tf2").partition("ros2 run")[2].replace("\\\n", " ")

    words = shlex.split(command)

    assert words[:2] == ["tf2_ros", "static_transform_publisher"]
    said = dict(zip(words[2::2], words[3::2], strict=True))
    np.testing.assert_allclose([float(said[f"--{axis}"]) for axis in "xyz"], RADAR_FROM_CAMERA_M, **SIX)
    np.testing.assert_allclose([float(said[f"--q{axis}"]) for axis in "xyzw"], QUATERNION_XYZW, **SIX)
    assert (said["--frame-id"], said["--child-frame-id"]) == ("radar", "camera_optical")


def test_the_python_launch_file_is_a_node_with_these_arguments(file, monkeypatch):
    import sys
    import types

    built = {}
    launch, launch_ros, actions = (
        types.ModuleType("launch"),
        types.ModuleType("launch_ros"),
        types.ModuleType("actions"),
    )
    launch.LaunchDescription = list
    actions.Node = lambda **given: built.update(given)
    for name, module in (("launch", launch), ("launch_ros", launch_ros), ("launch_ros.actions", actions)):
        monkeypatch.setitem(sys.modules, name, module)
    scope: dict = {}
    exec(compile(text_of(file, "tf2-launch-py"), "radar_camera.launch.py", "exec"), scope)

    scope["generate_launch_description"]()

    assert (built["package"], built["executable"]) == ("tf2_ros", "static_transform_publisher")
    numbers = [float(word) for word in built["arguments"][1:14:2]]
    np.testing.assert_allclose(numbers, RADAR_FROM_CAMERA_M + QUATERNION_XYZW, **SIX)
    assert built["arguments"][-4:] == ["--frame-id", "radar", "--child-frame-id", "camera_optical"]


def test_kalibr_gets_the_matrix_and_four_coefficients(file):
    cam0 = yaml_of(text_of(file, "kalibr"))["cam0"]

    np.testing.assert_allclose(cam0["T_cam_radar"], [*ROWS, [0, 0, 0, 1]], **EIGHT)
    assert cam0["intrinsics"] == [554.4203610, 556.5392197, 299.0464167, 265.1770865]
    assert cam0["distortion_coeffs"] == [-0.3941065568, 0.1667170599, -0.0035270543, 0.0018664127]
    assert (cam0["camera_model"], cam0["distortion_model"], cam0["resolution"]) == ("pinhole", "radtan", [640, 480])


def test_kitti_has_its_seven_lines_in_order(file):
    lines = [line.split(": ") for line in text_of(file, "kitti").splitlines()[:7]]

    assert [key for key, _ in lines] == ["P0", "P1", "P2", "P3", "R0_rect", "Tr_velo_to_cam", "Tr_imu_to_velo"]
    values = {key: np.array(numbers.split(), dtype=float) for key, numbers in lines}
    np.testing.assert_allclose(values["Tr_velo_to_cam"].reshape(3, 4), ROWS, **EIGHT)
    np.testing.assert_allclose(
        values["P2"], [554.420361, 0, 299.046417, 0, 0, 556.53922, 265.177087, 0, 0, 0, 1, 0], **SIX
    )
    np.testing.assert_array_equal(values["R0_rect"].reshape(3, 3), np.eye(3))


def test_view_of_delft_s_own_calibration_is_read():
    text = "P2: 1495.468642 0 961.272442 0 0 1495.468642 624.89592 0 0 0 1 0\nTr_velo_to_cam: " + (
        "-0.013857 -0.9997468 0.01772762 0.05283124 0.10934269 -0.01913807 -0.99381983 0.98100483 "
        "0.99390751 -0.01183297 0.1095802 1.44445002"
    )

    pose = read_any(text).camera_from_radar

    np.testing.assert_allclose(pose.translation_m, [0.05283124, 0.98100483, 1.44445002], rtol=1e-12)
    np.testing.assert_allclose(pose.rotation[0], [-0.013857, -0.9997468, 0.01772762], atol=1e-6)
    camera = read_any(text).camera_for((1936, 1216))
    assert (camera.model, camera.width_px, camera.matrix_px[0, 2]) == ("pinhole", 1936, 961.272442)


def test_the_second_camera_of_kitti_is_posed_with_its_offset():
    p2 = np.array([[721.5, 0, 609.6, 44.9], [0, 721.5, 172.9, 0.2], [0, 0, 1, 0.003]])
    rotation = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    pose = np.hstack([rotation, [[0.1], [0.2], [-0.3]]])
    text = f"P2: {' '.join(map(str, p2.ravel()))}\nTr_velo_to_cam: {' '.join(map(str, pose.ravel()))}\n"
    point_m = np.array([12.0, 1.5, -0.4, 1.0])

    found = read_any(text)

    camera = found.camera_for((1242, 375))
    column, row, scale = p2 @ [*(pose @ point_m), 1.0]
    np.testing.assert_allclose(
        camera.project(found.camera_from_radar @ point_m[None, :3])[0], [column / scale, row / scale], atol=1e-9
    )


def test_opencv_reads_its_file_and_projects_the_check_point(file, tmp_path):
    import cv2

    path = tmp_path / "radar_camera.yml"
    path.write_bytes(export(file, "opencv").data)
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    read = {key: storage.getNode(key).mat() for key in ("camera_matrix", "distortion_coefficients", "R", "T", "rvec")}
    point = storage.getNode("check_point_radar_m").mat()

    np.testing.assert_allclose(read["R"], np.array(ROWS)[:, :3], **EIGHT)
    np.testing.assert_allclose(read["rvec"].ravel(), [1.30927651, -1.29183232, 1.09104368], **EIGHT)
    pixels, _ = cv2.projectPoints(
        point.reshape(1, 1, 3), read["rvec"], read["T"], read["camera_matrix"], read["distortion_coefficients"]
    )
    np.testing.assert_allclose(pixels.ravel(), PIXEL_PX, **SIX)
    assert storage.getNode("radar_frame").string() == "radar"
    assert int(storage.getNode("image_width").real()) == 640


def test_apollo_gets_the_pose_of_the_child(file):
    content = yaml_of(text_of(file, "apollo"))

    assert (content["header"]["frame_id"], content["child_frame_id"]) == ("radar", "camera_optical")
    transform = content["transform"]
    np.testing.assert_allclose([transform["translation"][k] for k in "xyz"], RADAR_FROM_CAMERA_M, **SIX)
    np.testing.assert_allclose([transform["rotation"][k] for k in "xyzw"], QUATERNION_XYZW, **SIX)


def test_matlab_counts_pixels_from_one(file):
    content = loadmat(io.BytesIO(export(file, "matlab").data), simplify_cells=True)

    np.testing.assert_allclose(content["camera_from_radar"]["A"][:3], ROWS, **EIGHT)
    np.testing.assert_allclose(content["camera"]["PrincipalPoint"], [300.0464167, 266.1770865], rtol=1e-12)
    assert content["camera"]["ImageSize"].tolist() == [480, 640]
    assert content["frames"] == {"radar": "radar", "camera": "camera_optical"}
    assert content["check_point"]["radar_m"].tolist() == P_RADAR_M


def test_loadtxt_reads_the_matrix(file):
    np.testing.assert_allclose(np.loadtxt(io.StringIO(text_of(file, "matrix")))[:3], ROWS, **EIGHT)


def test_colmap_puts_the_principal_point_half_a_pixel_on(file):
    archive = zipfile.ZipFile(io.BytesIO(export(file, "colmap").data))
    camera, image = (
        next(line for line in archive.read(name).decode().splitlines() if line and not line.startswith("#")).split()
        for name in ("cameras.txt", "images.txt")
    )

    assert camera[1:4] == ["OPENCV", "640", "480"]
    np.testing.assert_allclose([float(n) for n in camera[6:8]], [299.5464167, 265.6770865], rtol=1e-12)
    np.testing.assert_allclose([float(n) for n in image[1:5]], np.roll(CAMERA_FROM_RADAR_XYZW, 1), **SIX)
    np.testing.assert_allclose([float(n) for n in image[5:8]], CAMERA_FROM_RADAR_XYZ_M, **SIX)


@pytest.mark.parametrize(
    "command",
    [
        "ros2 run tf2_ros static_transform_publisher --x 0.006418 --y 0.000900 --z -0.062374 --qx -0.536832 --qy 0.529679 "
        "--qz -0.447351 --qw 0.480758 --frame-id radar --child-frame-id camera_optical",
        "ros2 run tf2_ros static_transform_publisher --x=0.006418 --y=0.0009 --z=-0.062374 --roll=-1.708788 --pitch=0.028995 "
        "--yaw=-1.532137 --frame-id=radar --child-frame-id=camera_optical",
        "ros2 run tf2_ros static_transform_publisher 0.006418 0.0009 -0.062374 -1.532137 0.028995 -1.708788 radar camera_optical",
        "rosrun tf static_transform_publisher 0.006418 0.0009 -0.062374 -0.536832 0.529679 -0.447351 0.480758 "
        "/radar /camera_optical 100",
        "rosrun tf2_ros static_transform_publisher -0.001158 -0.060887 -0.014965 0.536832 -0.529679 0.447351 0.480758 "
        "camera_optical radar",
        "static_transform_publisher --x 0.006418 --y 0.0009 --z -0.062374 --roll 0.029273 --pitch 0.137933 --yaw 0.042686 "
        "--frame-id radar --child-frame-id camera_link",
    ],
    ids=["named", "named-rpy", "positional-yaw-pitch-roll", "ros1-with-period", "camera-as-parent", "body-frame"],
)
def test_every_way_to_write_the_command_means_the_same(command):
    pose = read_any(command).camera_from_radar

    np.testing.assert_allclose(pose.as_matrix()[:3], ROWS, atol=3e-6)
