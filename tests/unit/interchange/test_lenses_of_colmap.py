"""COLMAP's camera models: each becomes the right lens, and no coefficient is lost."""

import io
import zipfile
from pathlib import Path

import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import export, read_any, read_calibration


@pytest.fixture
def read(project_root: Path):
    file = read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    exported = zipfile.ZipFile(io.BytesIO(export(file, "colmap").data))

    def read(model: str, *coefficients: float) -> Camera:
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            archive.writestr("images.txt", exported.read("images.txt"))
            numbers = " ".join(map(str, coefficients))
            archive.writestr("cameras.txt", f"1 {model} 640 480 500 501 320 240 {numbers}\n")
        return read_any(packed.getvalue(), "colmap.zip").camera

    return read


@pytest.mark.parametrize(
    ("model", "coefficients", "lens", "kept"),
    [
        ("PINHOLE", (), "pinhole", []),
        ("OPENCV", (0.1, 0.2, 0.3, 0.4), "plumb_bob", [0.1, 0.2, 0.3, 0.4]),
        ("FULL_OPENCV", (0.1, 0.2, 0.3, 0.4, 0.5, 0.0, 0.0, 0.0), "plumb_bob", [0.1, 0.2, 0.3, 0.4, 0.5]),
        ("FULL_OPENCV", (0.1,) * 8, "rational_polynomial", [0.1] * 8),
        ("OPENCV_FISHEYE", (0.1, 0.2, 0.3, 0.4), "equidistant", [0.1, 0.2, 0.3, 0.4]),
    ],
)
def test_each_camera_model_becomes_the_smallest_lens_that_fits_it(read, model, coefficients, lens, kept):
    camera = read(model, *coefficients)
    assert (camera.model, camera.distortion.tolist()) == (lens, kept)


@pytest.mark.parametrize(
    ("model", "coefficients", "words"),
    [
        ("OPENCV", (0.1,) * 6, "plumb_bob takes 4 or 5 distortion coefficients, found 6"),
        ("PINHOLE", (0.1,), "pinhole takes 0 distortion coefficients, found 1"),
        ("FULL_OPENCV", (0.1,) * 7, "rational_polynomial takes 8 distortion coefficients, found 7"),
        ("THIN_PRISM_FISHEYE", (), "not supported; known: PINHOLE, OPENCV, FULL_OPENCV, OPENCV_FISHEYE"),
    ],
)
def test_coefficients_without_a_place_are_refused_and_not_dropped(read, model, coefficients, words):
    with pytest.raises(InputError, match=words):
        read(model, *coefficients)
