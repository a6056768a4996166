"""A camera is read from every supported kind of file, or refused with an error that says what was looked for."""

import json
from pathlib import Path

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import camera_info_text, read_camera, read_camera_file

K = [[500.5, 0.0, 320.25], [0.0, 501.5, 240.75], [0.0, 0.0, 1.0]]
D = [-0.3, 0.1, 0.001, -0.002, 0.01]
FLAT = "500.5, 0, 320.25, 0, 501.5, 240.75, 0, 0, 1"
COEFFICIENTS = "-0.3, 0.1, 0.001, -0.002, 0.01"

ROS = f"""image_width: 640
image_height: 480
camera_name: usb_webcam
camera_matrix: {{rows: 3, cols: 3, data: [{FLAT}]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 5, data: [{COEFFICIENTS}]}}
"""
OPENCV = f"""%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ {FLAT} ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ {COEFFICIENTS} ]
"""
OPENCV_XML = f"""<?xml version="1.0"?>
<opencv_storage>
<image_width>640</image_width>
<image_height>480</image_height>
<camera_matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt><data>{FLAT.replace(",", " ")}</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix"><rows>1</rows><cols>5</cols><dt>d</dt>
<data>{COEFFICIENTS.replace(",", " ")}</data></distortion_coefficients>
</opencv_storage>
"""
CAMERA_INFO = f"height: 480\nwidth: 640\ndistortion_model: plumb_bob\nD: [{COEFFICIENTS}]\nK: [{FLAT}]\n"
OURS = {"model": "plumb_bob", "width_px": 640, "height_px": 480, "matrix_px": K, "distortion": D}
KALIBR = """cam0:
  camera_model: pinhole
  intrinsics: [500.5, 501.5, 320.25, 240.75]
  distortion_model: radtan
  distortion_coeffs: [-0.3, 0.1, 0.001, -0.002]
  resolution: [640, 480]
"""


@pytest.mark.parametrize(
    "text",
    [
        ROS,
        OPENCV,
        OPENCV.replace("%YAML:1.0\n---\n", "%YAML 1.2\n---\n"),
        OPENCV.replace("---\n", ""),
        "\ufeff" + OPENCV_XML,
        CAMERA_INFO,
        CAMERA_INFO.replace("D:", "d:").replace("K:", "k:"),
        json.dumps(OURS),
        json.dumps({"schema": "cocalib/pairs-1", "camera": OURS, "pairs": []}),
    ],
    ids=[
        "ros",
        "opencv",
        "opencv-5",
        "opencv-no-dashes",
        "opencv-xml",
        "camera-info",
        "camera-info-2",
        "json",
        "pairs",
    ],
)
def test_every_kind_of_file_gives_the_same_camera(text):
    camera = read_camera(text)

    assert (camera.model, camera.width_px, camera.height_px) == ("plumb_bob", 640, 480)
    np.testing.assert_array_equal(camera.matrix_px, K)
    np.testing.assert_array_equal(camera.distortion, D)


def test_kalibr_s_camera_is_read_or_the_named_one_of_several():
    assert read_camera(KALIBR).distortion.tolist() == [-0.3, 0.1, 0.001, -0.002]

    two = KALIBR + KALIBR.replace("cam0", "cam1").replace("radtan", "equidistant")
    assert read_camera(two, name="cam1").model == "equidistant"
    with pytest.raises(
        InputError, match=r"chain\.yaml: contains 2 cameras; choose one: chain\.yaml#cam0, chain\.yaml#cam1"
    ):
        read_camera(two, "chain.yaml")
    with pytest.raises(InputError, match="no camera 'cam7' in it; it contains cam0, cam1"):
        read_camera(two, name="cam7")


@pytest.mark.parametrize(
    ("model", "coefficients", "read_as"),
    [
        ("", [], "pinhole"),
        ("plumb_bob", [], "pinhole"),
        ("", [0.1] * 4, "plumb_bob"),
        ("", [0.1] * 8, "rational_polynomial"),
        ("", [0.1] * 8 + [0.0] * 6, "rational_polynomial"),
        ("plumb_bob", [0.1] * 5 + [0.0] * 3, "plumb_bob"),
        ("fisheye", [0.1] * 4, "equidistant"),
        ("equidistant", [0.1] * 4 + [0.0], "equidistant"),
    ],
)
def test_the_lens_model_follows_from_name_and_number_of_coefficients(model, coefficients, read_as):
    text = json.dumps(
        {"width": 640, "height": 480, "distortion_model": model, "D": coefficients, "K": np.ravel(K).tolist()}
    )

    assert read_camera(text).model == read_as


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty; looked for camera_matrix and image_width"),
        ("a: 1\nb: 2\n", "no camera in it: looked for camera_matrix .*; found a, b"),
        ("- 1\n", "no camera in it: .*; found list"),
        ("a: [1\n", "line 2: not YAML"),
        ("a: &x [*x, *x]\nK: *x\n", "K: "),
        ("!!python/object/apply:os.system ['true']\n", "not YAML"),
        (ROS.replace("500.5", ".nan"), "camera_matrix: 'nan' is not a valid number"),
        (ROS.replace("500.5", "fx"), "camera_matrix: 'fx' is not a valid number"),
        (ROS.replace("500.5, ", ""), "camera_matrix: expected 9 numbers, found 8"),
        (ROS.replace("500.5", "0"), "the focal lengths must be positive"),
        (ROS.replace("image_width: 640\n", ""), "the image size is missing; add image_width and image_height"),
        (ROS.replace("plumb_bob", "omni"), "the lens model 'omni' is not supported; known: none, pinhole"),
        (ROS.replace(COEFFICIENTS, "1, 2, 3"), "plumb_bob takes 4 or 5 distortion coefficients, found 3"),
        (ROS + "binning_x: -2\n", "binning_x: -2 is not a number of pixels"),
        (ROS + "roi: {width: 100}\n", "roi: width 100 and height 0: state both"),
        (KALIBR.replace("pinhole", "omni"), "cam0.camera_model: 'omni' is not supported"),
        (KALIBR.replace("501.5, ", ""), "cam0.intrinsics: expected 4 numbers, found 3"),
        (json.dumps({**OURS, "distortions": []}), "distortions: unknown key; did you mean distortion?"),
        ("<robot/>", "XML with <robot>; expected OpenCV's <opencv_storage>"),
        ('<!DOCTYPE x [<!ENTITY a "b">]><opencv_storage/>', "declares a document type"),
        ("<opencv_storage>", "not XML"),
    ],
)
def test_a_file_without_a_valid_camera_is_refused_in_one_line(text, words):
    with pytest.raises(InputError, match=words) as refusal:
        read_camera(text, "camera.yml")

    assert str(refusal.value).startswith("camera.yml: ")
    assert "\n" not in str(refusal.value)


def test_a_missing_image_size_is_taken_from_the_recording():
    text = ROS.replace("image_width: 640\n", "")

    assert read_camera(text, image_size_px=(640, 480)).width_px == 640


@pytest.mark.parametrize("model", ["pinhole", "plumb_bob", "rational_polynomial", "equidistant"])
def test_the_camera_we_write_for_ros_is_the_camera_we_read(model):
    coefficients = {"pinhole": [], "plumb_bob": D, "rational_polynomial": [*D, 0.1, 1e-7, 0.3], "equidistant": D[:4]}
    camera = Camera(model, 640, 480, np.array(K), np.array(coefficients[model]))

    again = read_camera(camera_info_text(camera, "front: left"))

    np.testing.assert_array_equal(again.matrix_px, camera.matrix_px)
    point = np.array([[0.3, -0.2, 2.0]])
    np.testing.assert_array_equal(again.project(point), camera.project(point))


def test_what_opencv_writes_is_read(tmp_path):
    import cv2

    for name in ("camera.yml", "camera.xml"):
        storage = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_WRITE)
        storage.write("image_width", 640)
        storage.write("image_height", 480)
        storage.write("camera_matrix", np.array(K))
        storage.write("distortion_coefficients", np.array([D]))
        storage.release()

        camera = read_camera_file(tmp_path / name)

        np.testing.assert_array_equal(camera.matrix_px, K)
        np.testing.assert_array_equal(camera.distortion, D)


def test_a_file_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"absent\.yml: cannot be read \(No such file or directory\); check the path"):
        read_camera_file(tmp_path / "absent.yml")
    (tmp_path / "picture.png").write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe")
    with pytest.raises(InputError, match=r"picture\.png: not a text file; looked for"):
        read_camera_file(tmp_path / "picture.png")


@pytest.mark.real
def test_opencv_s_own_sample_intrinsics_are_read(shared_data: Path):
    folder = shared_data / "real_checkerboards"

    left = read_camera_file(folder / "left_intrinsics.yml")
    stereo = read_camera_file(f"{folder / 'intrinsics.yml'}#M2", image_size_px=(640, 480))

    assert (left.model, left.width_px, left.height_px) == ("plumb_bob", 640, 480)
    assert left.matrix_px[0, 0] == 5.3591573396163199e02
    assert stereo.matrix_px[0, 2] == 3.3455744527912015e02
    assert stereo.distortion[0] == -1.6916358306948096e-01


def test_binning_and_region_of_interest_of_a_file_are_those_of_the_recorded_picture() -> None:
    full = read_camera(ROS)
    part = read_camera(ROS + "binning_x: 2\nbinning_y: 2\nroi: {x_offset: 40, y_offset: 20, width: 320, height: 240}\n")
    assert (part.width_px, part.height_px) == (160, 120)
    points = np.array([[0.1, -0.05, 1.0], [-0.2, 0.1, 1.5]])
    np.testing.assert_allclose(part.project(points), (full.project(points) - [40.0, 20.0] + 0.5) / 2.0 - 0.5)
