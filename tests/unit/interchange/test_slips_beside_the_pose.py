"""Slips beside the pose: a guess that proves a guess, another camera matrix, numbers stated twice, swapped frame names."""

import dataclasses
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from calib_core.geometry import RigidTransform
from calib_core.interchange import (
    CalibrationFile,
    FrameNames,
    adoption,
    check,
    export,
    imported,
    read_any,
    read_calibration,
)
from calib_core.interchange.check.report_json import CheckedFile, check_json
from tests.kept_files import kept_file


@pytest.fixture(scope="module")
def file(project_root: Path) -> CalibrationFile:
    file = read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    return dataclasses.replace(file, evidence="clicked")


@pytest.fixture(scope="module")
def guessed(file) -> CalibrationFile:
    """Made from a bare matrix of the inverse pose, which was taken for camera_from_radar."""
    return adoption(read_any(inverse_of(file)), "bare.txt", camera=file.calibration.camera).file


def inverse_of(file: CalibrationFile) -> str:
    rows = file.calibration.camera_from_radar.inverse().as_matrix()
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist())


def test_agreeing_with_a_guess_proves_nothing(file, guessed):
    found, other = read_any(inverse_of(file)), imported(guessed)

    assert check(found, against=other).verdict == "doubtful"
    made = adoption(found, "bare.txt", camera=file.calibration.camera, against=other)
    assert made.file.evidence == "imported_assumed"
    proven = imported(dataclasses.replace(guessed, evidence="imported_proven"))
    assert check(found, against=proven).verdict == "right"


def test_being_the_file_of_a_guess_proves_nothing(guessed):
    found = read_any(export(guessed, "tf2").data)
    report = check(found, of=imported(guessed))
    assert report.verdict == "doubtful"
    assert {"same-pose", "assumed-reference"} <= {result.code for result in report.results}


@pytest.mark.parametrize("name", ["kitti", "nuscenes"])
@pytest.mark.parametrize("rectified", [True, False])
def test_another_matrix_in_a_file_of_rectified_pictures_misses_its_check_point(file, name, rectified):
    exported = export(file, name, rectified=rectified)
    found = read_any(exported.data)
    assert found.matrix_px is not None
    other = dataclasses.replace(found, matrix_px=found.matrix_px * np.array([[1.01, 1, 1], [1, 1.01, 1], [1, 1, 1]]))

    assert check(found).verdict == "right"
    assert [result.code for result in check(other).results if result.level == "error"] == ["other-lens"]


@pytest.mark.parametrize("name", ["koide3", "openlabel"])
def test_another_distortion_is_seen_at_the_check_point(file, name):
    found = read_any(kept_file(name))
    assert found.camera is not None
    other = dataclasses.replace(
        found, camera=dataclasses.replace(found.camera, distortion=found.camera.distortion * 0.9)
    )

    assert check(found).verdict == "right"
    assert [result.code for result in check(other).results if result.level == "error"] == ["other-lens"]


@pytest.mark.parametrize("key", ["R", "t"])
def test_numbers_beside_the_matrix_of_an_npz_must_be_its_own(file, key):
    arrays = dict(np.load(io.BytesIO(kept_file("numpy"))))
    buffer = io.BytesIO()
    np.savez(buffer, **{**arrays, key: arrays[key].T + (0.01 if key == "t" else 0.0)})

    report = check(read_any(buffer.getvalue()))
    assert report.verdict == "wrong"
    assert any(f"{key} is not that of camera_from_radar" in result.message for result in report.results)


def test_numbers_beside_the_matrix_of_a_mat_file_must_be_its_own(file):
    variables = {key: value for key, value in loadmat(io.BytesIO(export(file, "matlab").data)).items() if key[0] != "_"}
    variables["camera_from_radar"]["Translation"][0, 0] = np.array([[9.0, 9.0, 9.0]])
    buffer = io.BytesIO()
    savemat(buffer, variables)

    assert check(read_any(buffer.getvalue())).verdict == "wrong"


def test_the_rotation_vector_beside_a_matrix_must_be_its_own(file):
    text = export(file, "opencv").data.decode()
    changed = re.sub(r"(rvec:[^\[]*\[ )[^,]*", r"\g<1>0.1", text)

    assert changed != text
    report = check(read_any(changed))
    assert any("rvec is not the rotation vector of R" in result.message for result in report.results)


def test_swapped_frame_names_are_an_error_and_renamed_ones_are_not(file):
    data = kept_file("numpy")
    names = {"radar_frame": file.frames.radar, "camera_frame": file.frames.camera}
    arrays = dict(np.load(io.BytesIO(data)))
    buffer = io.BytesIO()
    np.savez(buffer, **{**arrays, "radar_frame": names["camera_frame"], "camera_frame": names["radar_frame"]})
    swapped = check(read_any(buffer.getvalue()), of=imported(file))
    renamed = check(read_any(export(file, "matlab", frames=FrameNames("front", "eye_optical")).data), of=imported(file))

    assert [result.code for result in swapped.results if result.level == "error"] == ["swapped-frames"]
    assert renamed.verdict == "right"


def test_a_file_that_cannot_be_read_has_the_keys_of_the_others(file):
    read = CheckedFile("a.json", check(imported(file)))
    first, second = json.loads(check_json([read, CheckedFile("b.json", unreadable="b.json: not read")]))["files"]
    assert set(first) == set(second)
    assert second["results"] == []


def test_a_rough_fit_names_no_slip_if_none_explains_the_check_point(file):
    """The sign of one number of a quaternion is no known slip, though two slips together come within ten degrees of it."""
    text = export(file, "tf2").data.decode()
    changed = re.sub(r"--qx -?", lambda found: "--qx " if found[0].endswith("-") else "--qx -", text)

    report = check(read_any(changed), against=imported(file))
    assert [result.code for result in report.results if result.level == "error"] == ["check-point-missed", "disagrees"]


def test_a_stale_file_is_said_to_be_stale_first(file):
    pose = file.calibration.camera_from_radar
    moved = RigidTransform(pose.rotation, pose.translation_m + np.array([0.03, 0.0, 0.0]))
    newer = dataclasses.replace(
        file, calibration=dataclasses.replace(file.calibration, camera_from_radar=moved), check_point=None
    )
    report = check(read_any(export(file, "tf2").data), of=imported(newer))
    assert [result.code for result in report.results if result.level == "error"] == ["stale", "other-pose"]
