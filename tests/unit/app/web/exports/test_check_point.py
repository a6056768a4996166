"""The check point in the export panel: one sentence that fits the format, and the picture in which it was clicked."""

import re
from dataclasses import replace

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.interchange import choose_check_point
from calib_core.results import CheckPoint
from cocalib.web.channel.export_preview import export_preview
from cocalib.web.exports.check_point import picture_of


def pixels_in(words):
    return [tuple(map(float, found)) for found in re.findall(r"pixel \((-?[\d.]+), (-?[\d.]+)\)", words)]


def test_a_file_with_its_lens_must_give_the_pixel(file):
    point = export_preview(file, "opencv", "", "drive").check_point
    assert point is not None
    (pixel,) = pixels_in(point.words)
    assert pixel == pytest.approx((point.u_px, point.v_px), abs=0.006)
    radar = [float(number) for number in re.findall(r"point \((.*?)\) m", point.words)[0].split(", ")]
    projected = file.calibration.camera.project(file.calibration.camera_from_radar @ np.array([radar]))[0]
    assert projected == pytest.approx(pixel, abs=0.01)
    assert "your reader" in point.words


def test_a_file_without_a_lens_must_give_the_point_in_the_camera_frame(file):
    point = export_preview(file, "urdf", "camera_frame=rear_optical", "drive").check_point
    assert point is not None
    assert file.check_point is not None
    at = re.search(r"expect \((.*?)\) m in 'rear_optical'", point.words)
    assert at is not None
    expected = (file.calibration.camera_from_radar @ file.check_point.radar_m[None])[0]
    np.testing.assert_allclose([float(number) for number in at[1].split(", ")], expected, atol=6e-4)


def test_a_file_for_rectified_pictures_names_both_pixels(file):
    camera = file.calibration.camera
    lens = Camera("plumb_bob", camera.width_px, camera.height_px, camera.matrix_px, np.array([-0.3, 0.1, 0, 0, 0]))
    calibration = replace(file.calibration, camera=lens)
    distorted = replace(file, calibration=calibration, check_point=choose_check_point(calibration))
    point = export_preview(distorted, "kitti", "rectified=1", "drive").check_point
    assert point is not None
    assert distorted.check_point is not None
    rectified, taken = pixels_in(point.words)
    assert taken == pytest.approx((point.u_px, point.v_px), abs=0.006)
    at = camera.matrix_px @ (calibration.camera_from_radar @ distorted.check_point.radar_m[None])[0]
    assert rectified == pytest.approx((at[:2] / at[2]).tolist(), abs=0.006)
    assert rectified != taken


def test_the_picture_is_that_of_the_pair_it_was_chosen_from(file):
    assert file.check_point is not None
    stamped = replace(
        file,
        calibration=replace(
            file.calibration,
            pairs=tuple(replace(pair, image_time=index) for index, pair in enumerate(file.calibration.pairs)),
        ),
    )
    stamp = picture_of(stamped)
    assert stamp is not None
    errors = stamped.calibration.radar_errors
    position = errors.corrected(stamped.calibration.pairs[stamp].point_radar_m[None])[0]
    np.testing.assert_allclose(position, file.check_point.radar_m, rtol=0, atol=1e-3)
    elsewhere = replace(stamped, check_point=CheckPoint(np.array([50.0, 1.0, 2.0]), np.array([5.0, 5.0])))
    assert picture_of(elsewhere) is None
    made = export_preview(elsewhere, "opencv", "", "drive").check_point
    assert made is not None
    assert made.pair == ""


def test_a_calibration_without_a_check_point_says_nothing(file):
    assert export_preview(replace(file, check_point=None), "tf2", "", "drive").check_point is None
