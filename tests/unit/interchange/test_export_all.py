"""Every format at once: those that can represent a calibration are written, the others say why not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.interchange import (
    CalibrationFile,
    choose_check_point,
    export,
    export_all,
    format_named,
    read_any,
    read_calibration,
    written_formats,
)
from calib_core.interchange.formats import registry


@pytest.fixture
def file(project_root: Path) -> CalibrationFile:
    """Return a calibration whose camera uses k3, which Kalibr cannot store."""
    golden = read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    camera = replace(golden.calibration.camera, distortion=np.array([-0.39, 0.17, -0.004, 0.002, 0.05]))
    calibration = replace(golden.calibration, camera=camera, pairs=())
    return replace(golden, calibration=calibration, check_point=choose_check_point(calibration))


@pytest.mark.parametrize("rectified", [False, True])
def test_each_format_is_written_as_alone_or_refused_as_alone(file: CalibrationFile, rectified: bool) -> None:
    written, refused = export_all(file, rectified=rectified)

    assert {*written, *(one.name for one in refused)} == {known.name for known in written_formats()}
    assert "kalibr" in {one.name for one in refused}
    for name, made in written.items():
        assert made == export(file, name, rectified=rectified and format_named(name).is_for_rectified)
        assert format_named(name).reads is None or read_any(made.data).format == name
    for one in refused:
        with pytest.raises(InputError) as alone:
            export(file, one.name, rectified=rectified and format_named(one.name).is_for_rectified)
        assert one.reason == str(alone.value)


def test_two_formats_do_not_write_one_file(file: CalibrationFile, monkeypatch: pytest.MonkeyPatch) -> None:
    twin = replace(format_named("matrix"), name="matrix-twin")
    monkeypatch.setattr(registry, "plugin_formats", lambda _reserved: (twin,))

    written, refused = export_all(file)

    assert "matrix" in written
    assert [one.name for one in refused if "is that of another format" in one.reason] == ["matrix-twin"]
