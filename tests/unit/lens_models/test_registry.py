"""What every registered lens model must satisfy: unambiguous names, and flags that match its mathematics."""

from dataclasses import fields, replace
from typing import get_args

import numpy as np
import pytest

from calib_core.camera import CAMERA_MODELS, CameraModel
from calib_core.interchange.own.documents import CameraDocument
from calib_core.lens_models.brown_conrady import PLUMB_BOB
from calib_core.lens_models.lens_model import TypicalLens
from calib_core.lens_models.registry import LENS_MODELS, lenses_named, names_in, opencv_lens, written_lens
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.rig import typical_camera

LENSES = list(LENS_MODELS.values())
each_lens = pytest.mark.parametrize("lens", LENSES, ids=list(LENS_MODELS))


def test_names_are_keys_and_no_other_lens_is_read_from_them():
    assert [lens.name for lens in LENSES] == list(LENS_MODELS)
    in_files = [name for lens in LENSES for name in lens.names_in_files]
    in_messages = [name for lens in LENSES for name in lens.names_in_messages]
    assert len(set(in_files)) == len(in_files)
    assert len(set(in_messages)) == len(in_messages)
    assert [name for name in in_files + in_messages if name != name.lower()] == []


def test_the_command_line_and_the_files_accept_what_is_registered():
    """The published schemas follow; test_formats_page.py says how to regenerate them."""
    (camera_model,) = (field for field in fields(SimulationOptions) if field.name == "camera_model")
    for taken in (CameraModel, camera_model.type, CameraDocument.__annotations__["model"]):
        assert get_args(taken) == CAMERA_MODELS == tuple(LENS_MODELS)


@each_lens
def test_a_lens_is_read_by_its_own_name_and_by_those_we_write(lens):
    assert lens.name in lens.names_in_files
    known = {name: other for other in LENSES for name in other.names_in_files}
    read = {row.where: known[row.name] for row in lens.names_elsewhere if row.where != "colmap"}
    # OpenCV's models are distinguished by the number of coefficients, so a name may be shared among them
    assert all(other is lens or other.opencv == lens.opencv == "projectPoints" for other in read.values())


@each_lens
def test_a_typical_lens_is_distorted_unless_it_cannot_be(lens):
    assert typical_camera(lens.name).is_distorted == bool(lens.coefficients)


@each_lens
def test_without_distortion_a_ray_lands_where_its_angle_says(lens):
    angles_rad = np.deg2rad([5.0, 25.0, 50.0])
    points = np.array([np.sin(angles_rad), np.zeros(3), np.cos(angles_rad)])
    for count in lens.counts:
        plane, _ = lens.project(points, np.zeros(count))
        np.testing.assert_allclose(plane[0], [lens.typical.radius_at(angle) for angle in angles_rad], rtol=1e-12)
        is_pinhole = bool(np.allclose(plane[0], np.tan(angles_rad)))
        assert lens.is_perspective == is_pinhole


# A lens model that contradicts itself is refused where it is defined.


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"counts": ()}, "plumb_bob: counts must ascend"),
        ({"counts": (5, 4)}, "counts must ascend"),
        ({"counts": (-1, 5)}, "counts must ascend"),
        ({"counts": (4,)}, "5 coefficients are named, but counts ends at 4"),
        ({"typical": TypicalLens((0.1,))}, "the typical lens has 1 coefficient"),
    ],
)
def test_a_lens_model_that_contradicts_itself_is_refused(changes, reason):
    with pytest.raises(ValueError, match=reason):
        replace(PLUMB_BOB, **changes)


# The name of a lens in other formats, and how many coefficients are written.


D = [-0.3, 0.1, 0.001, -0.002, 0.01, 0.2, 0.03, 0.004]


@pytest.mark.parametrize(
    ("model", "distortion", "where", "name", "coefficients"),
    [
        ("pinhole", [], "camera_info", "plumb_bob", [0.0] * 5),
        ("pinhole", [], "kalibr", "none", []),
        ("pinhole", [], "colmap", "PINHOLE", []),
        ("plumb_bob", D[:4], "camera_info", "plumb_bob", [*D[:4], 0.0]),
        ("plumb_bob", D[:4], "opencv", "plumb_bob", D[:4]),
        ("plumb_bob", D[:5], "opencv", "plumb_bob", D[:5]),
        ("plumb_bob", [*D[:4], 0.0], "kalibr", "radtan", D[:4]),
        ("plumb_bob", [*D[:4], 0.0], "colmap", "OPENCV", D[:4]),
        ("plumb_bob", D[:5], "colmap", "FULL_OPENCV", [*D[:5], 0.0, 0.0, 0.0]),
        ("rational_polynomial", D, "foxglove", "rational_polynomial", D),
        ("rational_polynomial", [*D[:4], 0.0, 0.0, 0.0, 0.0], "kalibr", "radtan", D[:4]),
        ("equidistant", D[:4], "foxglove", "kannala_brandt", D[:4]),
    ],
)
def test_a_lens_is_written_with_the_name_the_format_uses(model, distortion, where, name, coefficients):
    written = written_lens(LENS_MODELS[model], np.array(distortion), where)
    assert (written.name, list(written.coefficients)) == (name, coefficients)


def test_a_name_may_stand_for_several_lenses():
    assert [lens.name for lens in lenses_named("colmap", "FULL_OPENCV")] == ["plumb_bob", "rational_polynomial"]
    assert lenses_named("colmap", "OMNI") == ()
    assert names_in("camera_info") == ("plumb_bob", "rational_polynomial", "equidistant")


@pytest.mark.parametrize(
    ("count", "model"),
    [(0, "pinhole"), (1, "plumb_bob"), (5, "plumb_bob"), (6, "rational_polynomial"), (14, "rational_polynomial")],
)
def test_opencv_distinguishes_its_lenses_by_the_number_of_coefficients(count, model):
    assert opencv_lens(count).name == model
