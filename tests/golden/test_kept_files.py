"""Formats that are no longer written: what earlier versions exported is read as the calibration that it was made from."""

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.interchange import CalibrationFile, check, export, imported, read_any
from tests.kept_files import KEPT, kept_file


@pytest.mark.parametrize("name", KEPT)
def test_it_is_read_as_its_calibration(file: CalibrationFile, name: str) -> None:
    found = read_any(kept_file(name))

    assert (found.format, found.frames, found.evidence, found.assumptions) == (name, file.frames, "clicked", ())
    np.testing.assert_allclose(
        found.camera_from_radar.as_matrix(), file.calibration.camera_from_radar.as_matrix(), rtol=0, atol=1e-12
    )
    assert found.check_point is not None
    assert file.check_point is not None
    np.testing.assert_array_equal(found.check_point.radar_m, file.check_point.radar_m)
    report = check(found, of=imported(file), camera=file.calibration.camera)
    assert report.verdict == "right"


@pytest.mark.parametrize("name", ["koide3", "openlabel", "foxglove", "numpy"])
def test_its_lens_is_read(file: CalibrationFile, name: str) -> None:
    camera, wanted = read_any(kept_file(name)).camera, file.calibration.camera

    assert camera is not None
    assert (camera.width_px, camera.height_px) == (wanted.width_px, wanted.height_px)
    np.testing.assert_array_equal(camera.matrix_px, wanted.matrix_px)
    np.testing.assert_array_equal(camera.distortion, wanted.distortion)


@pytest.mark.parametrize("name", KEPT)
def test_it_is_no_longer_written(file: CalibrationFile, name: str) -> None:
    with pytest.raises(InputError, match=f"unknown format '{name}'"):
        export(file, name)
