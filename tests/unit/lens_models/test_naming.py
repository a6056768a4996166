"""The name of a lens in other formats, and how many coefficients are written."""

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.lens_models.lens_model import Elsewhere
from calib_core.lens_models.naming import lenses_named, names_in, opencv_lens, written_lens
from calib_core.lens_models.registry import LENS_MODELS

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
def test_a_lens_is_written_with_the_name_the_format_uses(
    model: str, distortion: list[float], where: Elsewhere, name: str, coefficients: list[float]
) -> None:
    written = written_lens(LENS_MODELS[model], np.array(distortion), where)
    assert (written.name, list(written.coefficients)) == (name, coefficients)


@pytest.mark.parametrize(
    ("model", "distortion", "missing"), [("plumb_bob", D[:5], "k3"), ("rational_polynomial", D, "k3 to k6")]
)
def test_a_coefficient_that_cannot_be_stored_is_never_dropped(
    model: str, distortion: list[float], missing: str
) -> None:
    with pytest.raises(InputError) as refusal:
        written_lens(LENS_MODELS[model], np.array(distortion), "kalibr")
    assert str(refusal.value) == (
        f"Kalibr's radtan model has no {missing}, which this camera uses; export with --to opencv, "
        "or calibrate the camera with k1 k2 p1 p2 only"
    )


def test_a_name_may_stand_for_several_lenses() -> None:
    assert [lens.name for lens in lenses_named("colmap", "FULL_OPENCV")] == ["plumb_bob", "rational_polynomial"]
    assert lenses_named("colmap", "OMNI") == ()
    assert names_in("camera_info") == ("plumb_bob", "rational_polynomial", "equidistant")


@pytest.mark.parametrize(
    ("count", "model"),
    [(0, "pinhole"), (1, "plumb_bob"), (5, "plumb_bob"), (6, "rational_polynomial"), (14, "rational_polynomial")],
)
def test_opencv_distinguishes_its_lenses_by_the_number_of_coefficients(count: int, model: str) -> None:
    assert opencv_lens(count).name == model
