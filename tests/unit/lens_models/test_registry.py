"""What every registered lens model must satisfy: unambiguous names, and flags that match its mathematics."""

from dataclasses import fields
from typing import get_args

import numpy as np
import pytest

from calib_core.camera import CAMERA_MODELS, CameraModel
from calib_core.errors import InputError
from calib_core.interchange import camera_info_text, read_camera
from calib_core.interchange.own.documents import CameraDocument
from calib_core.lens_models.lens_model import LensModel
from calib_core.lens_models.registry import LENS_MODELS
from calib_core.synthetic import SimulationOptions, typical_camera

LENSES = list(LENS_MODELS.values())
each_lens = pytest.mark.parametrize("lens", LENSES, ids=list(LENS_MODELS))


def test_names_are_keys_and_no_other_lens_is_read_from_them() -> None:
    assert [lens.name for lens in LENSES] == list(LENS_MODELS)
    in_files = [name for lens in LENSES for name in lens.names_in_files]
    in_messages = [name for lens in LENSES for name in lens.names_in_messages]
    assert len(set(in_files)) == len(in_files)
    assert len(set(in_messages)) == len(in_messages)
    assert [name for name in in_files + in_messages if name != name.lower()] == []


def test_the_command_line_and_the_files_accept_what_is_registered() -> None:
    """The published schemas follow; test_formats_page.py says how to regenerate them."""
    (camera_model,) = (field for field in fields(SimulationOptions) if field.name == "camera_model")
    for taken in (CameraModel, camera_model.type, CameraDocument.__annotations__["model"]):
        assert get_args(taken) == CAMERA_MODELS == tuple(LENS_MODELS)


@each_lens
def test_a_lens_is_read_by_its_own_name_and_by_those_we_write(lens: LensModel) -> None:
    assert lens.name in lens.names_in_files
    known = {name: other for other in LENSES for name in other.names_in_files}
    read = {row.where: known[row.name] for row in lens.names_elsewhere if row.where != "colmap"}
    # OpenCV's models are distinguished by the number of coefficients, so a name may be shared among them
    assert all(other is lens or other.opencv == lens.opencv == "projectPoints" for other in read.values())


@each_lens
def test_a_typical_lens_is_distorted_unless_it_cannot_be(lens: LensModel) -> None:
    assert typical_camera(lens.name).is_distorted == bool(lens.coefficients)


@each_lens
def test_the_camera_info_we_write_projects_points_as_the_camera_does(lens: LensModel) -> None:
    camera, points = typical_camera(lens.name), np.array([[0.3, -0.2, 2.0]])
    if any(row.where == "camera_info" for row in lens.names_elsewhere):
        np.testing.assert_array_equal(read_camera(camera_info_text(camera)).project(points), camera.project(points))
    else:
        with pytest.raises(InputError, match="ROS has no name for the lens model"):
            camera_info_text(camera)


@each_lens
def test_without_distortion_a_ray_lands_where_its_angle_says(lens: LensModel) -> None:
    angles_rad = np.deg2rad([5.0, 25.0, 50.0])
    points = np.array([np.sin(angles_rad), np.zeros(3), np.cos(angles_rad)])
    for count in lens.counts:
        plane, _ = lens.project(points, np.zeros(count))
        np.testing.assert_allclose(plane[0], [lens.typical.radius_at(angle) for angle in angles_rad], rtol=1e-12)
        is_pinhole = bool(np.allclose(plane[0], np.tan(angles_rad)))
        assert lens.is_perspective == is_pinhole


@each_lens
def test_unprojecting_the_image_plane_gives_the_original_rays(lens: LensModel) -> None:
    distortion = np.array(lens.typical.distortion)
    points = np.random.default_rng(2).uniform([-2.0, -2.0, 3.0], [2.0, 2.0, 5.0], (30, 3))
    plane, _ = lens.project(np.ascontiguousarray(points.T), distortion)
    rays = lens.unproject(plane.T, distortion)
    np.testing.assert_allclose(rays, points / np.linalg.norm(points, axis=1, keepdims=True), atol=1e-12)
