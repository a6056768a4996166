"""Every format for intrinsics: written, read by us and by readers that are not ours, and refused in words."""

import io
import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from calib_core.camera import CAMERA_MODELS, Camera, CameraCovariance
from calib_core.errors import InputError
from calib_core.interchange import CAMERA_FORMATS, CameraFile, camera_content, read_camera
from calib_core.synthetic import typical_camera

WITHOUT = {  # lens models that a format has no name for
    "mrcal": {"equidistant"},
    "kitti": {"equidistant", "rational_polynomial"},
    "matlab": {"equidistant", "rational_polynomial"},
    "kalibr": {"rational_polynomial"},
}


def read_back(content: str | bytes) -> Camera:
    data = content if isinstance(content, bytes) else content.encode()
    return CameraFile("camera", data).camera()


@pytest.mark.parametrize("model", CAMERA_MODELS)
@pytest.mark.parametrize("to", CAMERA_FORMATS)
def test_what_is_written_is_read_again(to: str, model: str) -> None:
    camera = typical_camera(model)  # type: ignore[arg-type]
    if model in WITHOUT.get(to, ()):
        with pytest.raises(InputError, match=r"write|export|(have|has) no"):
            camera_content(camera, to)
        return
    again = read_back(camera_content(camera, to))
    points = np.random.default_rng(1).uniform([-0.5, -0.4, 1.0], [0.5, 0.4, 3.0], (50, 3))
    assert (again.width_px, again.height_px) == (camera.width_px, camera.height_px)
    np.testing.assert_allclose(again.project(points), camera.project(points), atol=1e-9)


@settings(max_examples=25)
@given(
    st.sampled_from([name for name in CAMERA_FORMATS if name != "json"]),
    st.lists(st.floats(-0.2, 0.2, allow_subnormal=False), min_size=5, max_size=5),
    st.floats(50.0, 5000.0),
)
def test_a_plumb_bob_survives_every_format_to_the_last_digit(to: str, distortion: list[float], focal_px: float) -> None:
    if to == "kalibr":
        distortion[4] = 0.0
    matrix = np.array([[focal_px, 0.0, 321.25], [0.0, focal_px * 1.01, 238.5], [0.0, 0.0, 1.0]])
    camera = Camera("plumb_bob", 640, 480, matrix, np.array(distortion))
    again = read_back(camera_content(camera, to))
    kept = np.zeros(5)
    kept[: len(again.distortion)] = again.distortion
    np.testing.assert_array_equal(kept, camera.distortion)
    np.testing.assert_allclose(again.matrix_px, camera.matrix_px, rtol=1e-15)


@pytest.mark.parametrize("to", ["opencv", "opencv-xml", "opencv-json"])
def test_opencv_reads_its_own_formats(to: str, tmp_path: Path) -> None:
    camera, path = typical_camera("plumb_bob"), tmp_path / f"camera{CAMERA_FORMATS[to].suffix}"
    path.write_text(str(camera_content(camera, to)), encoding="utf-8")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("camera_matrix").mat(), camera.matrix_px)
    np.testing.assert_array_equal(storage.getNode("distortion_coefficients").mat().ravel(), camera.distortion)
    assert int(storage.getNode("image_width").real()) == camera.width_px
    storage.release()


def test_scipy_reads_matlabs_with_its_first_pixel_at_one() -> None:
    from scipy.io import loadmat

    camera = typical_camera("plumb_bob")
    content = camera_content(camera, "matlab")
    assert isinstance(content, bytes)
    found = loadmat(io.BytesIO(content), simplify_cells=True)["cameraParams"]
    np.testing.assert_allclose(found["PrincipalPoint"], camera.matrix_px[:2, 2] + 1.0)
    np.testing.assert_allclose(found["IntrinsicMatrix"].T[:2, :2], camera.matrix_px[:2, :2])
    np.testing.assert_array_equal(found["ImageSize"], [camera.height_px, camera.width_px])
    np.testing.assert_array_equal(found["TangentialDistortion"], camera.distortion[2:4])


def test_a_plain_yaml_reader_reads_kalibrs_and_ros() -> None:
    camera = typical_camera("equidistant")
    chain = yaml.safe_load(camera_content(camera, "kalibr"))["cam0"]
    assert chain["distortion_model"] == "equidistant"
    np.testing.assert_array_equal(chain["intrinsics"], camera.parameters[:4])
    ros = yaml.safe_load(camera_content(camera, "ros", "front"))
    assert ros["camera_name"] == "front"
    np.testing.assert_array_equal(ros["distortion_coefficients"]["data"], camera.distortion)


def test_the_lines_of_colmap_and_kitti_say_what_their_documentation_says() -> None:
    camera = typical_camera("plumb_bob")
    line = str(camera_content(camera, "colmap")).splitlines()[-1].split()
    assert line[1] == "FULL_OPENCV" if camera.distortion[4] else "OPENCV"
    assert float(line[6]) == camera.matrix_px[0, 2] + 0.5
    keyed = dict(row.split(": ") for row in str(camera_content(camera, "kitti")).splitlines())
    np.testing.assert_array_equal(np.array(keyed["K_00"].split(), dtype=float), camera.matrix_px.ravel())
    np.testing.assert_array_equal(np.array(keyed["D_00"].split(), dtype=float), camera.distortion)


def test_mrcals_dictionary_names_model_and_size() -> None:
    text = str(camera_content(typical_camera("rational_polynomial"), "mrcal"))
    assert "'LENSMODEL_OPENCV8'" in text
    numbers = re.search(r"'intrinsics': \[ (.*) \]", text)
    assert numbers is not None
    np.testing.assert_array_equal(
        [float(number) for number in numbers[1].split(",")], typical_camera("rational_polynomial").parameters
    )


@pytest.mark.parametrize("to", ["ros", "json"])
def test_the_covariance_travels(to: str) -> None:
    plain = typical_camera("plumb_bob")
    spread = np.random.default_rng(2).standard_normal((9, 9))
    camera = plain.with_parameters(plain.parameters, CameraCovariance(plain.parameter_names, spread @ spread.T))
    again = read_back(camera_content(camera, to))
    assert again.covariance is not None
    assert camera.covariance is not None
    assert again.covariance.order == camera.covariance.order
    np.testing.assert_array_equal(again.covariance.matrix, camera.covariance.matrix)


MODEL = "{'lensmodel': 'LENSMODEL_OPENCV4', 'intrinsics': [500, 501, 320, 240, 0.1, 0, 0, 0], 'imagersize': [640, 480]}"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            MODEL.replace("OPENCV4", "SPLINED_STEREOGRAPHIC_order=3_Nx=30"),
            "is not supported; calibrate with LENSMODEL_OPENCV8",
        ),
        (MODEL.replace("0.1, 0, ", ""), "LENSMODEL_OPENCV4 has 8 numbers, found 6"),
        (MODEL.replace("500,", "__import__('os').system('true'),"), "not a valid cameramodel"),
        (MODEL + "]", "not a valid cameramodel"),
        (MODEL.replace("'imagersize': [640, 480]", "'imagersize': [640]"), "imagersize: expected 2 numbers, found 1"),
        ("1 THIN_PRISM_FISHEYE 640 480 500 500 320 240", "the model 'THIN_PRISM_FISHEYE' is not supported"),
        ("1 PINHOLE 640 480 500 500 320", "expected at least 4 parameters, found 3"),
        ("1 SIMPLE_RADIAL 640 480 500 500 320", "SIMPLE_RADIAL has 4 parameters, found 3"),
        ("K_00: 1 2 3\nD_00: 0 0 0 0 0\n", "K_00: expected 9 numbers, found 3"),
        ('{"fx": 500, "fy": 500}', "fx, fy, cx"),
        (
            '{"fx": 5, "fy": 5, "ppx": 3, "ppy": 2, "width": 6, "height": 4, "model": "inverse_brown_conrady", "coeffs": [1, 0]}',
            "no other tool does",
        ),
    ],
)
def test_what_cannot_be_read_is_refused_in_words(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_camera(text, "camera")


def test_cameras_software_names_its_numbers() -> None:
    numbers = {"width": 640, "height": 480, "fx": 600.0, "fy": 601.0, "ppx": 321.0, "ppy": 239.0}
    plain = read_camera(json.dumps(numbers | {"model": "distortion.inverse_brown_conrady", "coeffs": [0, 0, 0, 0, 0]}))
    assert plain.model == "pinhole"
    bent = read_camera(json.dumps(numbers | {"model": "brown_conrady", "coeffs": [0.1, 0, 0, 0, 0]}))
    assert bent.model == "plumb_bob"
    assert bent.matrix_px[0, 2] == 321.0


def test_a_one_focal_model_of_colmap_has_two_equal_ones() -> None:
    camera = read_camera("# Camera list\n3 SIMPLE_RADIAL 640 480 500 320.5 240.5 -0.1\n")
    assert (camera.model, camera.matrix_px[0, 0], camera.matrix_px[1, 1]) == ("plumb_bob", 500.0, 500.0)
    assert camera.matrix_px[0, 2] == 320.0
    assert camera.distortion.tolist() == [-0.1, 0.0, 0.0, 0.0]


def test_a_camera_is_scaled_to_resized_pictures_on_request_only() -> None:
    content = str(camera_content(typical_camera("plumb_bob", width_px=1280, height_px=720), "ros")).encode()
    half = CameraFile("c.yaml", content, rescale=True).camera(image_size_px=(640, 360))
    assert (half.width_px, half.height_px) == (640, 360)
    assert CameraFile("c.yaml", content).camera(image_size_px=(640, 360)).width_px == 1280
    with pytest.raises(InputError, match="another aspect ratio"):
        CameraFile("c.yaml", content, rescale=True).camera(image_size_px=(640, 480))


def test_a_mat_file_of_version_7_3_is_named() -> None:
    with pytest.raises(InputError, match="save it with -v7"):
        CameraFile("c.mat", b"MATLAB 7.3 MAT-file, Platform: GLNXA64" + b"\0" * 200).camera()


@pytest.mark.parametrize(
    ("content", "good", "bad", "why"),
    [
        (
            "1 OPENCV 640 480 500 500 320.5 240.5 0.1 0 0 0\n2 FOV 640 480 500 500 320.5 240.5 0.9\n",
            "camera 1",
            "camera 2",
            "the model 'FOV' is not supported",
        ),
        (
            "cam0: {camera_model: omni, intrinsics: [1.2, 500, 500, 320, 240], resolution: [640, 480]}\n"
            "cam1: {camera_model: pinhole, intrinsics: [500, 500, 320, 240], distortion_model: radtan,\n"
            "  distortion_coeffs: [0.1, 0, 0, 0], resolution: [640, 480]}\n",
            "cam1",
            "cam0",
            "'omni' is not supported",
        ),
    ],
    ids=["colmap", "kalibr"],
)
def test_a_camera_that_is_not_supported_does_not_hide_the_others(content: str, good: str, bad: str, why: str) -> None:
    assert read_camera(content, name=good).matrix_px[0, 2] == 320.0
    with pytest.raises(InputError, match=why):
        read_camera(content, name=bad)
