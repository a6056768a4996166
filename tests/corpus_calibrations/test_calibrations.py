"""Calibrations in the shape that other programs write: read right, or refused in words, and never read wrong."""

import re

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.interchange.importing import read_any, read_any_file
from tests.corpus_calibrations.data_sets import DATA_SETS
from tests.corpus_calibrations.reading import Reading, read
from tests.corpus_calibrations.ros import ROS
from tests.corpus_calibrations.tools import TOOLS

CALIBRATIONS = {calibration.name: calibration for calibration in (*ROS, *TOOLS, *DATA_SETS)}


def refusal(data: bytes) -> str:
    """Return the message with which a file is refused; empty if it is read."""
    try:
        read_any(data, "file")
    except InputError as error:
        return str(error)
    return ""


@pytest.fixture(scope="module")
def readings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Reading]:
    folders = {name: tmp_path_factory.mktemp("foreign") for name in CALIBRATIONS}
    return {name: read(calibration, folders[name]) for name, calibration in CALIBRATIONS.items()}


@pytest.mark.parametrize("name", CALIBRATIONS)
def test_a_file_is_read_right_or_refused_with_what_to_do(readings, name):
    calibration, reading = CALIBRATIONS[name], readings[name]
    print(f"{name:32} {reading.outcome:8} {reading.why}")

    if calibration.refused:
        assert reading.outcome == "refused"
        assert re.search(calibration.refused, reading.why)
    else:
        assert reading.outcome == "right", reading.why


def test_a_sensor_that_the_file_does_not_call_a_radar_is_an_assumption(readings):
    for name in ("koide3", "KITTI raw", "KITTI odometry", "Segments.ai, OpenCV", "Autoware.AI", "OpenLABEL"):
        assert readings[name].assumed, name
    for name in ("tf2_echo without names", "TUM pose", "PJLab", "DriveWorks rig, corrected"):
        assert readings[name].assumed, name


def test_the_folder_of_a_file_is_looked_at_for_what_completes_it(tmp_path):
    calibration = CALIBRATIONS["KITTI raw"]
    together = read(calibration, tmp_path)
    (tmp_path / "calib_cam_to_cam.txt").write_text("R_rect_00: 1 0 0\n", encoding="utf-8")

    assert together.outcome == "right"
    with pytest.raises(InputError, match="R_rect_00: expected 9 numbers, found 3"):
        read_any_file(tmp_path / calibration.file_name)


@pytest.mark.parametrize("name", CALIBRATIONS)
def test_a_damaged_file_is_read_or_refused(name):
    content = CALIBRATIONS[name].content
    data = content.encode() if isinstance(content, str) else content
    rng = np.random.default_rng(len(data))
    for _ in range(8):
        at, cut = int(rng.integers(len(data))), int(rng.integers(1, 40))
        junk = rng.choice([b"", b"-", b"0", b"nan", b"[", b"{}", b": ", b"\n", b"\xff", b'"'])
        refused = refusal(data[:at] + bytes(junk) + data[at + cut :])
        assert not refused or re.match(r"file(, line \d+|:\d+)?: ", refused)
        assert "\n" not in refused
