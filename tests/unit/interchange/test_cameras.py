"""A camera is read from every supported kind of file, or refused with an error that says what was looked for."""

import io
import json

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from calib_core.camera import CAMERA_MODELS, Camera, CameraCovariance
from calib_core.errors import InputError
from calib_core.interchange.cameras.files import (
    CAMERA_FORMATS,
    CameraFile,
    camera_content,
    read_camera,
    read_camera_file,
)
from calib_core.synthetic.rig import typical_camera

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
        ("Plumb Bob", [0.1] * 5, "plumb_bob"),
        ("plumb'bob", [0.1] * 5, "plumb_bob"),
        ("Brown Conrady", [0.1] * 5, "plumb_bob"),
        ("rectified", [], "pinhole"),
        ("rectified", [0.0] * 5, "pinhole"),
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
        ("- 1\n", "no camera in it: .*; found no keys"),
        ("a: [1\n", "line 2: not YAML"),
        ("a: &x [*x, *x]\nK: *x\n", "line 1: "),
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
        ("<robot/>", "no camera in it: looked for .*found no keys"),
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
    with pytest.raises(
        InputError, match=r"principal point \(\d+, \d+\) is that of images of about 6\d\d x \d+ px, but these"
    ):
        read_camera(text, image_size_px=(960, 720))


def test_a_projection_of_three_rows_of_four_is_a_camera_matrix():
    projection = np.column_stack([K, np.zeros(3)]).ravel().tolist()
    text = json.dumps({"width": 640, "height": 480, "camera_matrix": projection})

    np.testing.assert_allclose(read_camera(text).matrix_px, K)


def test_the_projections_of_a_frame_of_kitti_are_one_rectified_camera_if_they_are_alike():
    alike = "P0: 800 0 320 0 0 800 240 0 0 0 1 0\nP2: 800 0 320 44.8 0 800 240 0.2 0 0 1 0.003\nR0_rect: 1 0 0 0 1 0 0 0 1\n"
    camera = read_camera(alike, "calib/01047.txt", image_size_px=(640, 480))
    assert (camera.model, camera.width_px) == ("pinhole", 640)
    assert camera.matrix_px.tolist() == [[800.0, 0.0, 320.0], [0.0, 800.0, 240.0], [0.0, 0.0, 1.0]]
    other = alike.replace("P2: 800", "P2: 790")
    assert read_camera(other, name="P2", image_size_px=(640, 480)).matrix_px[0, 0] == 790.0
    with pytest.raises(InputError, match="P0"):
        read_camera(other, image_size_px=(640, 480))


def test_the_camera_of_astyx_is_found_among_its_sensors():
    radar = {"sensor_uid": "radar_6455", "calib_data": {"T_to_ref_COS": np.eye(4).tolist()}}
    camera = {"sensor_uid": "camera_front", "calib_data": {"K": [[700, 0, 320], [0, 700, 240], [0, 0, 1]]}}
    found = read_camera(json.dumps({"sensors": [radar, camera]}), image_size_px=(640, 480))

    assert (found.model, found.matrix_px[0, 0], found.width_px) == ("pinhole", 700.0, 640)


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
    with pytest.raises(InputError, match=r"absent\.yml: no such file or folder; check the path"):
        read_camera_file(tmp_path / "absent.yml")
    (tmp_path / "image.png").write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe")
    with pytest.raises(InputError, match=r"image\.png: not a text file but an image; .*looked for"):
        read_camera_file(tmp_path / "image.png")


@pytest.mark.real
def test_opencv_s_own_sample_intrinsics_are_read(shared_data):
    folder = shared_data / "real_checkerboards"

    left = read_camera_file(folder / "left_intrinsics.yml")
    stereo = read_camera_file(f"{folder / 'intrinsics.yml'}#M2", image_size_px=(640, 480))

    assert (left.model, left.width_px, left.height_px) == ("plumb_bob", 640, 480)
    assert left.matrix_px[0, 0] == 5.3591573396163199e02
    assert stereo.matrix_px[0, 2] == 3.3455744527912015e02
    assert stereo.distortion[0] == -1.6916358306948096e-01


def test_binning_and_region_of_interest_of_a_file_are_those_of_the_recorded_image():
    full = read_camera(ROS)
    part = read_camera(ROS + "binning_x: 2\nbinning_y: 2\nroi: {x_offset: 40, y_offset: 20, width: 320, height: 240}\n")
    assert (part.width_px, part.height_px) == (160, 120)
    points = np.array([[0.1, -0.05, 1.0], [-0.2, 0.1, 1.5]])
    np.testing.assert_allclose(part.project(points), (full.project(points) - [40.0, 20.0] + 0.5) / 2.0 - 0.5)


# Every format for intrinsics: written, read by us and by readers that are not ours, and refused in words.


WITHOUT = {  # lens models that a format has no name for
    "kalibr": {"rational_polynomial"},
}


def read_back(content: str | bytes) -> Camera:
    data = content if isinstance(content, bytes) else content.encode()
    return CameraFile("camera", data).camera()


@pytest.mark.parametrize("model", CAMERA_MODELS)
@pytest.mark.parametrize("to", CAMERA_FORMATS)
def test_what_is_written_is_read_again(to, model):
    camera = typical_camera(model)
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
def test_a_plumb_bob_survives_every_format_to_the_last_digit(to, distortion, focal_px):
    if to == "kalibr":
        distortion[4] = 0.0
    matrix = np.array([[focal_px, 0.0, 321.25], [0.0, focal_px * 1.01, 238.5], [0.0, 0.0, 1.0]])
    camera = Camera("plumb_bob", 640, 480, matrix, np.array(distortion))
    again = read_back(camera_content(camera, to))
    kept = np.zeros(5)
    kept[: len(again.distortion)] = again.distortion
    np.testing.assert_array_equal(kept, camera.distortion)
    np.testing.assert_allclose(again.matrix_px, camera.matrix_px, rtol=1e-15)


def test_opencv_reads_its_format(tmp_path):
    camera, path = typical_camera("plumb_bob"), tmp_path / "camera.yml"
    path.write_text(str(camera_content(camera, "opencv")), encoding="utf-8")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("camera_matrix").mat(), camera.matrix_px)
    np.testing.assert_array_equal(storage.getNode("distortion_coefficients").mat().ravel(), camera.distortion)
    assert int(storage.getNode("image_width").real()) == camera.width_px
    storage.release()


def test_matlabs_parameters_are_read_with_their_first_pixel_at_one():
    from scipy.io import savemat

    camera = typical_camera("plumb_bob")
    k1, k2, p1, p2, k3 = camera.distortion
    matrix = camera.matrix_px + np.array([[0, 0, 1], [0, 0, 1], [0, 0, 0]])
    struct = {"RadialDistortion": [k1, k2, k3], "TangentialDistortion": [p1, p2], "IntrinsicMatrix": matrix.T}
    buffer = io.BytesIO()
    savemat(buffer, {"cameraParams": struct | {"ImageSize": [float(camera.height_px), float(camera.width_px)]}})
    again = read_back(buffer.getvalue())
    np.testing.assert_allclose(again.parameters, camera.parameters)
    assert (again.width_px, again.height_px) == (camera.width_px, camera.height_px)


def test_a_plain_yaml_reader_reads_kalibrs_and_ros():
    camera = typical_camera("equidistant")
    chain = yaml.safe_load(camera_content(camera, "kalibr"))["cam0"]
    assert chain["distortion_model"] == "equidistant"
    np.testing.assert_array_equal(chain["intrinsics"], camera.parameters[:4])
    ros = yaml.safe_load(camera_content(camera, "ros", "front"))
    assert ros["camera_name"] == "front"
    np.testing.assert_array_equal(ros["distortion_coefficients"]["data"], camera.distortion)


def test_mrcals_model_is_read():
    assert read_back(MODEL).distortion.tolist() == [0.1, 0, 0, 0]


def test_the_line_of_colmap_says_what_its_documentation_says():
    camera = typical_camera("plumb_bob")
    line = str(camera_content(camera, "colmap")).splitlines()[-1].split()
    assert line[1] == "FULL_OPENCV" if camera.distortion[4] else "OPENCV"
    assert float(line[6]) == camera.matrix_px[0, 2] + 0.5


def test_kittis_cameras_are_read_with_their_lens_and_rectified():
    camera = typical_camera("plumb_bob")
    rows = {
        "S_00": [camera.width_px, camera.height_px], "K_00": camera.matrix_px.ravel(), "D_00": camera.distortion,
        "S_rect_00": [600, 400], "P_rect_00": [*range(500, 504), *range(504, 508), 0, 0, 1, 0],
    }  # fmt: skip
    text = "calib_time: 1\n" + "".join(f"{key}: {' '.join(map(repr, map(float, row)))}\n" for key, row in rows.items())
    np.testing.assert_array_equal(CameraFile("camera", text.encode(), "00").camera().parameters, camera.parameters)
    assert CameraFile("camera", text.encode(), "rect_00").camera().width_px == 600


@pytest.mark.parametrize("to", ["ros", "json"])
def test_the_covariance_travels(to):
    plain = typical_camera("plumb_bob")
    spread = np.random.default_rng(2).standard_normal((9, 9))
    camera = plain.with_parameters(plain.parameters, CameraCovariance(plain.parameter_names, spread @ spread.T))
    again = read_back(camera_content(camera, to))
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
        (MODEL + "]", "not Python"),
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
def test_what_cannot_be_read_is_refused_in_words(text, words):
    with pytest.raises(InputError, match=words):
        read_camera(text, "camera")


def test_cameras_software_names_its_numbers():
    numbers = {"width": 640, "height": 480, "fx": 600.0, "fy": 601.0, "ppx": 321.0, "ppy": 239.0}
    plain = read_camera(json.dumps(numbers | {"model": "distortion.inverse_brown_conrady", "coeffs": [0, 0, 0, 0, 0]}))
    assert plain.model == "pinhole"
    bent = read_camera(json.dumps(numbers | {"model": "brown_conrady", "coeffs": [0.1, 0, 0, 0, 0]}))
    assert bent.model == "plumb_bob"
    assert bent.matrix_px[0, 2] == 321.0


def test_a_one_focal_model_of_colmap_has_two_equal_ones():
    camera = read_camera("# Camera list\n3 SIMPLE_RADIAL 640 480 500 320.5 240.5 -0.1\n")
    assert (camera.model, camera.matrix_px[0, 0], camera.matrix_px[1, 1]) == ("plumb_bob", 500.0, 500.0)
    assert camera.matrix_px[0, 2] == 320.0
    assert camera.distortion.tolist() == [-0.1, 0.0, 0.0, 0.0]


def test_a_camera_is_scaled_to_resized_images_on_request_only():
    content = str(camera_content(typical_camera("plumb_bob", width_px=1280, height_px=720), "ros")).encode()
    half = CameraFile("c.yaml", content, rescale=True).camera(image_size_px=(640, 360))
    assert (half.width_px, half.height_px) == (640, 360)
    assert CameraFile("c.yaml", content).camera(image_size_px=(640, 360)).width_px == 1280
    with pytest.raises(InputError, match="another aspect ratio"):
        CameraFile("c.yaml", content, rescale=True).camera(image_size_px=(640, 480))


def test_a_mat_file_of_version_7_3_is_named():
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
def test_a_camera_that_is_not_supported_does_not_hide_the_others(content, good, bad, why):
    assert read_camera(content, name=good).matrix_px[0, 2] == 320.0
    with pytest.raises(InputError, match=why):
        read_camera(content, name=bad)


def test_cameras_in_blocks_by_name_are_chosen_by_it():
    block = {"fx": 1061.2, "fy": 1060.9, "cx": 956.1, "cy": 560.4, "width": 1920, "height": 1080}
    text = json.dumps({"left": block | {"disto": [-0.04, 0.01, 0.0, 0.0, -0.005]}, "right": block | {"fx": 1062.0}})
    with pytest.raises(InputError, match=r"contains 2 cameras; choose one: .*#left, .*#right"):
        read_camera(text)
    left, right = (read_camera(text, name=name) for name in ("left", "right"))
    assert (left.distortion.tolist(), right.matrix_px[0, 0]) == ([-0.04, 0.01, 0.0, 0.0, -0.005], 1062.0)


def test_text_without_a_camera_says_what_was_looked_for():
    with pytest.raises(InputError, match=r"in no format that is read here; .*line 2: not YAML.*; looked for"):
        read_camera(' Intrinsic of "Color" / 640x480\n  Width: 640\n  Fx: 612.9\n', "rs.txt")


@pytest.mark.parametrize("names", [("camera_matrix", "dist_coeffs"), ("mtx", "dist")])
def test_the_arrays_of_opencvs_python_tutorial_are_a_camera_of_the_recordings_size(names, tmp_path):
    camera = typical_camera("plumb_bob")
    arrays = dict(zip(names, (camera.matrix_px, camera.distortion[None]), strict=True))
    np.savez(tmp_path / "camera.npz", **arrays)
    again = read_camera_file(tmp_path / "camera.npz", image_size_px=(camera.width_px, camera.height_px))
    np.testing.assert_array_equal(again.parameters, camera.parameters)
    np.savez(tmp_path / "other.npz", rvecs=np.zeros((3, 1)))
    with pytest.raises(InputError, match="no array camera_matrix, mtx or K in it; found rvecs"):
        read_camera_file(tmp_path / "other.npz")
