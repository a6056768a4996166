"""Formats that store only a camera matrix refuse a distorted lens unless the pictures are declared rectified."""

import dataclasses
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.web.channel.export_preview import export_preview, exported, format_rows
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import (
    FORMATS,
    CalibrationFile,
    check,
    choose_check_point,
    contents_text,
    export,
    imported,
    read_any,
    read_calibration,
)

MATRIX_ONLY = [known.name for known in FORMATS if known.camera == "matrix"]
OTHERS = [known.name for known in FORMATS if known.camera != "matrix"]
LENSES: dict[str, list[float]] = {
    "plumb_bob": [-0.39, 0.17, -0.004, 0.002, 0.0],
    "rational_polynomial": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.02],
    "equidistant": [0.0, 0.0, 0.0, 0.0],
}


@pytest.fixture(scope="module")
def file(project_root: Path) -> CalibrationFile:
    return read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))


def through(file: CalibrationFile, model: str, distortion: list[float]) -> CalibrationFile:
    camera = Camera(model, 640, 480, file.calibration.camera.matrix_px, np.array(distortion))  # type: ignore[arg-type]
    calibration = dataclasses.replace(file.calibration, camera=camera)
    return dataclasses.replace(file, calibration=calibration, check_point=choose_check_point(calibration))


@pytest.mark.parametrize("known", FORMATS, ids=[known.name for known in FORMATS])
def test_the_registry_says_how_much_of_the_camera_is_in_the_file(file, known):
    text = contents_text(export(file, known.name, rectified=known.is_for_rectified))

    assert ("554.42" in text) == (known.camera != "none")
    assert ("-0.3941" in text) == (known.camera == "lens")


@pytest.mark.parametrize("model", LENSES)
@pytest.mark.parametrize("name", MATRIX_ONLY)
def test_a_distorted_lens_is_refused_with_one_line_that_names_formats_which_store_it(file, name, model):
    distorted = through(file, model, LENSES[model])

    with pytest.raises(InputError) as refused:
        export(distorted, name)

    said = str(refused.value)
    assert f"{name} stores a camera matrix but not the distortion of this {model} lens" in said
    assert "wrong for pictures as taken; use a format that stores it, such as opencv or numpy" in said
    assert "undistorted with this same camera matrix, say so with --rectified (on the page, tick the box)" in said
    assert "\n" not in said
    for other in ("opencv", "numpy"):
        again = read_any(export(distorted, other).data).camera
        assert again is not None
        assert (again.model, again.distortion.tolist()) == (model, LENSES[model])


@pytest.mark.parametrize("name", MATRIX_ONLY)
@pytest.mark.parametrize(("model", "distortion"), [("pinhole", []), ("plumb_bob", [0.0] * 5)])
def test_a_lens_without_distortion_is_written_without_a_note(file, name, model, distortion):
    plain = through(file, model, distortion)

    written = export(plain, name)

    assert not any("rectified" in note for note in written.notes)
    assert written == export(plain, name, rectified=True)


@pytest.mark.parametrize("name", MATRIX_ONLY)
def test_for_rectified_pictures_it_is_written_and_a_note_says_so(file, name):
    written = export(file, name, rectified=True)

    assert any("written for rectified pictures" in note for note in written.notes)
    assert check(read_any(written.data), against=imported(file)).verdict == "right"


@pytest.mark.parametrize("name", OTHERS)
def test_a_format_that_is_not_for_rectified_pictures_refuses_the_option(file, name):
    with pytest.raises(InputError, match=rf"that cannot store distortion \(kitti, nuscenes\), not to {name}"):
        export(file, name, rectified=True)


def matrix_in(name: str, text: str) -> np.ndarray:
    if name == "nuscenes":
        return np.array(json.loads(text)[1]["camera_intrinsic"])
    (row,) = (line for line in text.splitlines() if line.startswith("P2: "))
    return np.array(row.split()[1:], dtype=float).reshape(3, 4)[:, :3]


@pytest.mark.parametrize("model", ["plumb_bob", "equidistant"])
@pytest.mark.parametrize("name", MATRIX_ONLY)
def test_its_numbers_project_the_check_point_to_its_pixel_in_the_rectified_picture(file, name, model):
    distorted = through(file, model, [-0.39, 0.17, -0.004, 0.002])
    check_point, camera = distorted.check_point, distorted.calibration.camera
    assert check_point is not None
    written = export(distorted, name, rectified=True).data

    seen = matrix_in(name, written.decode()) @ (read_any(written).camera_from_radar @ check_point.radar_m[None])[0]

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


def test_an_address_may_say_that_the_pictures_are_rectified(file):
    assert exported(file, "kitti", "rectified=1").data == export(file, "kitti", rectified=True).data
    for query, words in (
        ("", "tick the box"),
        ("rectified=0", "tick the box"),
        ("rectified=", "1"),
        ("rectified=yes", "'yes'"),
    ):
        with pytest.raises(InputError, match=words):
            exported(file, "kitti", query)


def test_the_page_knows_which_formats_ask_for_it(file):
    assert [row.key for row in format_rows() if row.takes_rectified] == MATRIX_ONLY
    said = export_preview(file, "nuscenes", "parent_from_radar=1,0,0,0,0,0,1&rectified=1", "drive")
    assert said.is_for_rectified
    assert said.check_is_good
    assert any("rectified pictures" in note for note in said.notes)
    assert not export_preview(through(file, "pinhole", []), "nuscenes", "", "drive").is_for_rectified
    assert not export_preview(file, "tf2", "", "drive").is_for_rectified
