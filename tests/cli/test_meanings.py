"""`cocalib import` of files that do not say what their numbers mean."""

import json
from pathlib import Path

import numpy as np
import pytest

from calib_core.geometry import RigidTransform
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.interchange.rotations import LINK_FROM_OPTICAL
from tests.cli.conftest import Made

POSE = Made().camera_from_radar
BODY = (LINK_FROM_OPTICAL @ POSE).inverse()
"""The pose of the camera's body frame in the radar: near the identity, so that its direction is open."""


@pytest.fixture
def camera_file(tmp_path: Path) -> Path:
    path = tmp_path / "camera.yaml"
    path.write_text(camera_info_text(Made().camera))
    return path


@pytest.fixture
def ambiguous(tmp_path: Path) -> Path:
    path = tmp_path / "extrinsic.json"
    path.write_text(json.dumps({"calibration": {"radar": {"T": BODY.as_matrix().tolist()}}}))
    return path


def _is_pose(path: Path, tolerance: float = 1e-9) -> bool:
    found = read_calibration(path.read_text()).calibration.camera_from_radar
    return bool(np.abs(found.as_matrix() - POSE.as_matrix()).max() < tolerance)


def test_import_writes_what_was_picked_and_says_so(cocalib, ambiguous, camera_file, tmp_path):
    out = tmp_path / "out.json"
    picked = cocalib("import", ambiguous, "--as", "radar_from_camera,body,m", "--out", out, "--camera", camera_file)
    assert picked.code == 3
    assert _is_pose(out)
    file = read_calibration(out.read_text())
    assert file.evidence == "imported_assumed"
    assumed = [str(warning) for warning in file.calibration.warnings if warning.code == "assumed"]
    assert any("picked by hand" in message and "radar_from_camera,body,m" in message for message in assumed)


def test_pairs_decide_what_the_numbers_mean(cocalib, ambiguous, camera_file, pairs_file, tmp_path):
    out, pairs = tmp_path / "out.json", pairs_file
    assert cocalib("import", ambiguous, "--pairs", pairs, "--out", out, "--camera", camera_file).code == 0
    assert _is_pose(out)
    assert read_calibration(out.read_text()).evidence == "imported_proven"
    against = cocalib("import", ambiguous, "--against", out, "--out", tmp_path / "second.json", "--camera", camera_file)
    assert against.code == 0
    assert _is_pose(tmp_path / "second.json")


def test_what_the_pairs_contradict_cannot_be_picked(cocalib, ambiguous, camera_file, pairs_file, tmp_path):
    flags = ("--as", "camera_from_radar,body,m", "--pairs", pairs_file, "--out", tmp_path / "out.json")
    refused = cocalib("import", ambiguous, *flags, "--camera", camera_file)
    assert refused.code == 2
    assert "--as camera_from_radar,body,m is contradicted" in refused.err
    assert "the test supports radar_from_camera,body,m" in refused.err
    assert not (tmp_path / "out.json").exists()


@pytest.mark.parametrize("inverse", [False, True])
def test_check_reads_a_bare_matrix_as_import_reads_it(cocalib, camera_file, pairs_file, tmp_path, inverse):
    bare, out = tmp_path / "bare.txt", tmp_path / "out.json"
    np.savetxt(bare, (POSE.inverse() if inverse else POSE).as_matrix())
    meaning = "radar_from_camera,optical,m" if inverse else "camera_from_radar,optical,m"

    for evidence in ((), ("--pairs", pairs_file)):
        assert f"taken as {meaning}" in cocalib("import", bare, "--out", out, "--camera", camera_file, *evidence).err
        checked = cocalib("check", bare, *evidence)
        assert checked.code == (0 if evidence else 3), checked.out
        assert f"({meaning})" in checked.out


def test_one_of_several_poses_is_chosen_by_its_place(cocalib, camera_file, tmp_path):
    several, out = tmp_path / "rig.json", tmp_path / "out.json"
    other = RigidTransform(POSE.rotation, [0.5, 0.5, 0.5]).as_matrix().tolist()
    several.write_text(json.dumps({"front": POSE.as_matrix().tolist(), "rear": other}))
    assert cocalib("import", several, "--pose", "front", "--out", out, "--camera", camera_file).code == 3
    assert _is_pose(out)
