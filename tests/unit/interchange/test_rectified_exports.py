"""Formats that store only a camera matrix get that of rectified images, with maps that make them, or the declared one."""

import dataclasses
import io
import json
import zipfile

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, choose_check_point
from calib_core.interchange.cameras.rectification import rectified_camera
from calib_core.interchange.check.report import check
from calib_core.interchange.exporting import contents_text, export
from calib_core.interchange.format import imported
from calib_core.interchange.formats.registry import FORMATS
from calib_core.interchange.importing import read_any
from calib_core.interchange.own.calibration_json import calibration_sha256
from cocalib.opening.opened import camera_of
from cocalib.web.channel.export_preview import export_preview, exported
from cocalib.web.exports import format_rows

MATRIX_ONLY = [known.name for known in FORMATS if known.camera == "matrix"]
OTHERS = [known.name for known in FORMATS if known.camera != "matrix"]


def through(file: CalibrationFile, model: str, distortion: list[float]) -> CalibrationFile:
    camera = Camera(model, 640, 480, file.calibration.camera.matrix_px, np.array(distortion))
    calibration = dataclasses.replace(file.calibration, camera=camera)
    return dataclasses.replace(file, calibration=calibration, check_point=choose_check_point(calibration))


@pytest.mark.parametrize("known", FORMATS, ids=[known.name for known in FORMATS])
def test_the_registry_says_how_much_of_the_camera_is_in_the_file(file, known):
    text = contents_text(export(file, known.name, rectified=known.is_for_rectified))

    assert ("554.42" in text) == (known.camera != "none")
    assert ("-0.3941" in text) == (known.camera == "lens")


WIDE: dict[str, list[float]] = {
    "plumb_bob": [-0.39, 0.17, -0.004, 0.002, 0.0],
    "rational_polynomial": [0.3, 0.05, 0.001, -0.002, 0.01, 0.6, 0.1, 0.02],
    "equidistant": [-0.02, 0.01, 0.003, -0.001],
}


def maps_of(file: CalibrationFile, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the maps and the camera matrix of an export."""
    (maps,) = export(file, name).extra_files
    assert maps.file_name == "rectification.npz"
    arrays = np.load(io.BytesIO(maps.data), allow_pickle=False)
    return arrays["map_x"], arrays["map_y"], arrays["K_new"]


@pytest.mark.parametrize("model", WIDE)
def test_a_point_through_the_lens_and_the_maps_is_where_the_rectified_matrix_puts_it(file, model):
    distorted = through(file, model, WIDE[model])
    camera = distorted.calibration.camera
    map_x, map_y, matrix_px = maps_of(distorted, "kitti")
    np.testing.assert_array_equal(matrix_in("kitti", export(distorted, "kitti").data), matrix_px)
    inside = np.random.default_rng(4).uniform([5, 5], [634, 474], (500, 2))
    points_camera_m = np.column_stack([inside, np.ones(500)]) @ np.linalg.inv(matrix_px).T * 7.0

    found_px = np.column_stack(
        [
            cv2.remap(one, inside[:, :1].astype(np.float32), inside[:, 1:].astype(np.float32), cv2.INTER_LINEAR).ravel()
            for one in (map_x, map_y)
        ]
    )

    np.testing.assert_allclose(found_px, camera.project(points_camera_m), rtol=0, atol=0.01)


@pytest.mark.parametrize("model", WIDE)
def test_the_maps_are_opencv_s_for_that_matrix_and_leave_no_border_empty(file, model):
    distorted = through(file, model, WIDE[model])
    camera = distorted.calibration.camera
    map_x, map_y, matrix_px = maps_of(distorted, "nuscenes")

    undistort = cv2.fisheye if model == "equidistant" else cv2
    theirs = undistort.initUndistortRectifyMap(
        camera.matrix_px, camera.distortion, np.eye(3), matrix_px, (640, 480), cv2.CV_32FC1
    )
    np.testing.assert_allclose([map_x, map_y], theirs, rtol=0, atol=2e-3)
    assert min(map_x.min(), map_y.min()) > -0.51
    assert (map_x.max(), map_y.max()) < (639.51, 479.51)
    # and no larger image is: a border of the image as taken is used on each side
    edges = (map_x[:, 0].min(), map_y[0].min(), 639 - map_x[:, -1].max(), 479 - map_y[-1].max())
    assert max(edges) < 1.0


def test_a_camera_without_distortion_is_its_own_rectified_camera(file):
    camera = through(file, "plumb_bob", [0.0] * 5).calibration.camera
    np.testing.assert_allclose(rectified_camera(camera).matrix_px, camera.matrix_px, rtol=0, atol=1e-6)


def test_the_matrix_is_that_of_opencv_s_alpha_0(file):
    distorted = through(file, "plumb_bob", WIDE["plumb_bob"])
    camera = distorted.calibration.camera

    theirs, _ = cv2.getOptimalNewCameraMatrix(camera.matrix_px, camera.distortion, (640, 480), 0.0)

    np.testing.assert_allclose(maps_of(distorted, "kitti")[2], theirs, rtol=0.01, atol=0.5)


def test_a_lens_that_folds_back_within_the_image_gives_a_smaller_field_and_none_at_the_centre_is_refused(file):
    folding = through(file, "plumb_bob", [-0.9, 0.0, 0.0, 0.0])
    map_x, map_y, matrix_px = maps_of(folding, "kitti")
    assert matrix_px[0, 0] > 554.5
    assert np.isfinite([map_x, map_y]).all()
    corners = np.array([[0, 0, 1], [639, 0, 1], [0, 479, 1], [639, 479, 1.0]]) @ np.linalg.inv(matrix_px).T
    assert folding.calibration.camera.sees(corners).all()
    with pytest.raises(InputError, match="no rectified image can be cut from this lens"):
        export(through(file, "plumb_bob", [-5000.0, 0.0, 0.0, 0.0]), "kitti")


@pytest.mark.parametrize("name", MATRIX_ONLY)
def test_a_distorted_lens_is_written_with_the_matrix_of_images_that_its_maps_rectify(file, name):
    written = export(file, name)

    found = read_any(written.data)
    assert any("rectification.npz beside this file" in note and "--rectified" in note for note in written.notes)
    assert check(found, against=imported(file)).verdict == "right"
    assert found.calibration_sha256 == calibration_sha256(file)
    archive = zipfile.ZipFile(io.BytesIO(written.download.data))
    assert archive.namelist() == [written.file_name, "rectification.npz"]
    assert export(file, name) == written


@pytest.mark.parametrize("name", MATRIX_ONLY)
@pytest.mark.parametrize(("model", "distortion"), [("pinhole", []), ("plumb_bob", [0.0] * 5)])
def test_a_lens_without_distortion_is_written_without_a_note(file, name, model, distortion):
    plain = through(file, model, distortion)

    written = export(plain, name)

    assert not any("rectified" in note for note in written.notes)
    assert written == export(plain, name, rectified=True)


@pytest.mark.parametrize("name", MATRIX_ONLY)
def test_for_rectified_images_it_is_written_and_a_note_says_so(file, name):
    written = export(file, name, rectified=True)

    assert any("written for rectified images" in note for note in written.notes)
    assert check(read_any(written.data), against=imported(file)).verdict == "right"


@pytest.mark.parametrize("name", OTHERS)
def test_a_format_that_is_not_for_rectified_images_refuses_the_option(file, name):
    with pytest.raises(InputError, match=rf"that cannot store distortion \(kitti, nuscenes\), not to {name}"):
        export(file, name, rectified=True)


def matrix_in(name: str, data: bytes) -> np.ndarray:
    if name == "nuscenes":
        table = zipfile.ZipFile(io.BytesIO(data)).read("calibrated_sensor.json")
        return np.array(json.loads(table)[1]["camera_intrinsic"])
    (row,) = (line for line in data.decode().splitlines() if line.startswith("P2: "))
    return np.array(row.split()[1:], dtype=float).reshape(3, 4)[:, :3]


@pytest.mark.parametrize("model", ["plumb_bob", "equidistant"])
@pytest.mark.parametrize("name", MATRIX_ONLY)
def test_its_numbers_project_the_check_point_to_its_pixel_in_the_rectified_image(file, name, model):
    distorted = through(file, model, [-0.39, 0.17, -0.004, 0.002])
    check_point, camera = distorted.check_point, distorted.calibration.camera
    written = export(distorted, name, rectified=True).data

    seen = matrix_in(name, written) @ (read_any(written).camera_from_radar @ check_point.radar_m[None])[0]

    given = (check_point.pixel_px[None, None], camera.matrix_px, camera.distortion)
    if model == "equidistant":
        rectified = cv2.fisheye.undistortPoints(*given, P=camera.matrix_px)
    else:
        often = (cv2.TERM_CRITERIA_COUNT, 100, 0.0)
        if hasattr(cv2, "undistortPointsIter"):  # until OpenCV 5
            rectified = cv2.undistortPointsIter(*given, None, camera.matrix_px, often)
        else:
            rectified = cv2.undistortPoints(*given, P=camera.matrix_px, criteria=often)
    np.testing.assert_allclose(seen[:2] / seen[2], np.ravel(rectified), rtol=0, atol=1e-4)
    assert np.linalg.norm(seen[:2] / seen[2] - check_point.pixel_px) > 0.5


def test_an_address_may_say_that_the_images_are_rectified(file):
    assert exported(file, "kitti", "rectified=1").data == export(file, "kitti", rectified=True).data
    assert exported(file, "kitti", "rectified=0").data == exported(file, "kitti", "").data == export(file, "kitti").data
    for query, words in (("rectified=", "1"), ("rectified=yes", "'yes'")):
        with pytest.raises(InputError, match=words):
            exported(file, "kitti", query)


def test_the_page_knows_which_formats_ask_for_it(file):
    assert [row.key for row in format_rows() if row.takes_rectified] == MATRIX_ONLY
    said = export_preview(file, "nuscenes", "parent_from_radar=1,0,0,0,0,0,1&rectified=1", "drive")
    assert said.is_for_rectified
    assert said.check_is_good
    assert any("rectified images" in note for note in said.notes)
    with_maps = export_preview(file, "kitti", "", "drive")
    assert (with_maps.file_name, with_maps.is_binary) == ("drive_calib_and_maps.zip", True)
    assert with_maps.text.startswith("P0: ")
    assert not export_preview(through(file, "pinhole", []), "nuscenes", "", "drive").is_for_rectified
    assert not export_preview(file, "tf2", "", "drive").is_for_rectified


def test_a_matrix_without_a_size_is_not_that_of_images_twice_as_large(file, tmp_path):
    found, path = read_any(export(file, "kitti").data), tmp_path / "calib.txt"
    size_px = (file.calibration.camera.width_px, file.calibration.camera.height_px)

    assert camera_of(found, path, size_px).width_px == size_px[0]
    with pytest.raises(InputError, match=r"calib.txt: the principal point \(\d+, \d+\) is that of images of about"):
        camera_of(found, path, (2 * size_px[0], 2 * size_px[1]))
