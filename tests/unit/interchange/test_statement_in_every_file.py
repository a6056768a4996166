"""Every file states what its pose rests on, which calibration it is made from, and its check point; reading finds them."""

import dataclasses
import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.interchange import (
    FORMATS,
    CalibrationFile,
    Format,
    ImportedCalibration,
    adopt,
    check,
    export,
    read_any,
    read_calibration,
)
from calib_core.interchange.calibration_file import EVIDENCE_LEVELS
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.interchange.syntax.mcap_file import load_mcap
from tests.kept_files import kept_file

OTHERS = [known for known in FORMATS if known.name != "json"]


@pytest.fixture(scope="module")
def file(project_root: Path) -> CalibrationFile:
    golden = read_calibration((project_root / "tests/golden/calibration-1.json").read_bytes())
    return dataclasses.replace(golden, evidence="imported_proven")


def read_back(file: CalibrationFile, known: Format) -> ImportedCalibration:
    return read_any(export(file, known.name, rectified=known.is_for_rectified).data)


@pytest.mark.parametrize("known", OTHERS, ids=lambda known: known.name)
def test_a_file_states_its_evidence_its_calibration_and_its_check_point(file: CalibrationFile, known: Format) -> None:
    found = read_back(file, known)
    point, check_point = file.check_point, found.check_point

    assert found.evidence == "imported_proven"
    assert found.calibration_sha256 == calibration_sha256(file)
    assert found.assumptions == ()
    assert point is not None
    assert check_point is not None
    np.testing.assert_array_equal(check_point.radar_m, point.radar_m)
    if check_point.camera_m is not None:
        seen_m = file.calibration.camera_from_radar @ point.radar_m[None]
        np.testing.assert_allclose(check_point.camera_m, seen_m[0], rtol=0, atol=1e-12)
    if not known.is_for_rectified:
        assert check_point.pixel_px is not None
        np.testing.assert_array_equal(check_point.pixel_px, point.pixel_px)
    if known.comment != "numbers":
        assert found.frames == file.frames
    assert check(found, camera=file.calibration.camera).verdict == "right"


@pytest.mark.parametrize("level", EVIDENCE_LEVELS)
def test_kitti_states_each_level_as_a_number(file: CalibrationFile, level: str) -> None:
    one = dataclasses.replace(file, evidence=level)  # type: ignore[arg-type]
    kitti = next(known for known in FORMATS if known.name == "kitti")

    assert read_back(one, kitti).evidence == level


def test_what_is_not_a_number_of_ours_in_a_kitti_file_states_nothing(file: CalibrationFile) -> None:
    lines = export(file, "kitti", rectified=True).data.decode().splitlines()

    def with_line(key: str, value: str) -> ImportedCalibration:
        return read_any("\n".join(f"{key}: {value}" if line.startswith(f"{key}:") else line for line in lines))

    assert with_line("cocalib_evidence", "7").evidence is None
    for value in ("1 2 3", " ".join(["256"] * 32), " ".join(["-1"] * 32), " ".join(["1.0"] * 32)):
        assert with_line("cocalib_calibration_sha256", value).calibration_sha256 is None


def test_a_file_of_another_tool_states_nothing(file: CalibrationFile) -> None:
    archive = zipfile.ZipFile(io.BytesIO(export(file, "nuscenes", rectified=True).data))
    radar, camera = json.loads(archive.read("calibrated_sensor.json"))
    for key in (None, 3, ["no statement", 4], {"a": 1}):
        found = read_any(json.dumps([radar, {**camera, "cocalib": key}]))
        assert (found.evidence, found.calibration_sha256, found.check_point, found.frames) == (None,) * 4
        assert found.assumptions


def test_the_covariance_survives_arrays_with_its_order(file: CalibrationFile) -> None:
    covariance = np.diag([1.0, 2, 3, 4, 5, 6]) * 1e-6
    covariance[0, 4] = covariance[4, 0] = 3e-7
    calibration = dataclasses.replace(file.calibration, covariance=covariance)
    found = read_any(export(dataclasses.replace(file, calibration=calibration), "matlab").data)

    assert found.covariance is not None
    np.testing.assert_array_equal(found.covariance, covariance)
    np.testing.assert_array_equal(adopt(found, "file").calibration.covariance, covariance)


def test_a_covariance_in_an_unknown_order_is_not_taken_for_ours(file: CalibrationFile) -> None:
    pose = file.calibration.camera_from_radar.as_matrix()
    for convention in ({}, {"covariance_convention": np.array("rotX, rotY, rotZ, x, y, z")}):
        buffer = io.BytesIO()
        np.savez(buffer, camera_from_radar=pose, covariance=np.eye(6), **convention)
        assert read_any(buffer.getvalue()).covariance is None


def test_foxglove_s_messages_are_read_as_json_too() -> None:
    found = load_mcap(kept_file("foxglove"), source="file")
    assert found is not None
    transforms, camera = (json.loads(message.data) for message in found.messages)

    earlier = read_any(json.dumps({"FrameTransform": transforms["transforms"][0], "CameraCalibration": camera}))

    assert earlier.format == "foxglove"
    np.testing.assert_array_equal(
        earlier.camera_from_radar.as_matrix(), read_any(kept_file("foxglove")).camera_from_radar.as_matrix()
    )


def test_an_mcap_file_that_is_a_recording_or_damaged_is_refused_in_words() -> None:
    data = kept_file("foxglove")
    other = data.replace(b"foxglove.FrameTransforms", b"std_msgs/FrameTransforms")
    for content, words in (
        (other, "MCAP without foxglove.FrameTransforms .found std_msgs/FrameTransforms"),
        (data.replace(b"\x04\x00\x00\x00json", b"\x04\x00\x00\x00ros1"), "neither text nor an archive"),
        (data[:200], "damaged MCAP file"),
    ):
        with pytest.raises(InputError, match=words):
            read_any(content, "file.mcap")
