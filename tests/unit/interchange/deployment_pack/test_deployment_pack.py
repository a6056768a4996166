"""The pack as an archive: what is in it, how it is read back, and what other formats say of the angle map it holds."""

import hashlib
import io
import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import yaml

from calib_core.errors import InputError
from calib_core.interchange import (
    FORMATS,
    adopt,
    contents_text,
    export,
    format_named,
    read_any,
    read_calibration,
    read_camera,
    write_calibration,
)
from calib_core.interchange.calibration_file import EVIDENCE_LEVELS
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.interchange.syntax.zip_archives import pack, unpack


@pytest.fixture
def members(corrected) -> dict[str, bytes]:
    return unpack(export(corrected, "pack").data, source="pack")


def test_the_same_calibration_gives_the_same_bytes(corrected):
    again = read_calibration(write_calibration(corrected))

    assert export(again, "pack").data == export(corrected, "pack").data


def test_calibration_json_is_the_file_that_the_hash_in_every_other_file_names(corrected, members):
    sha256 = hashlib.sha256(members["calibration.json"]).hexdigest()

    assert members["calibration.json"].decode() == write_calibration(corrected)
    assert sha256 == calibration_sha256(corrected)
    assert sha256 in members["README.txt"].decode()
    found = read_any(export(corrected, "pack").data)
    assert (found.calibration_sha256, found.evidence) == (sha256, corrected.rests_on)


def test_a_pack_is_adopted_as_the_calibration_in_it(golden):
    found = read_any(export(golden, "pack").data)

    assert write_calibration(adopt(found, "pack")) == write_calibration(golden)


def test_the_transforms_and_the_camera_are_those_of_the_calibration(corrected, members):
    camera = read_camera(members["camera_info.yaml"].decode())
    info = yaml.safe_load(members["camera_info.yaml"])

    transforms = [name for name in members if name.startswith("tf/")]

    assert len(transforms) == 3
    for name in transforms:
        pose = read_any(members[name], name).camera_from_radar
        wanted = corrected.calibration.camera_from_radar
        np.testing.assert_allclose(pose.as_matrix(), wanted.as_matrix(), rtol=0, atol=1e-9)
    np.testing.assert_array_equal(camera.matrix_px, corrected.calibration.camera.matrix_px)
    np.testing.assert_array_equal(camera.distortion, corrected.calibration.camera.distortion)
    shapes = {"camera_matrix": (3, 3), "rectification_matrix": (3, 3), "projection_matrix": (3, 4)}
    for key, (rows, columns) in shapes.items():
        assert (info[key]["rows"], info[key]["cols"], len(info[key]["data"])) == (rows, columns, rows * columns)
    assert info["distortion_model"] == "plumb_bob"


def test_the_readme_says_what_is_in_the_pack(corrected, members):
    text = members["README.txt"].decode()
    words = " ".join(text.split())

    listed = re.findall(r"^(\S+) {2,}\S", text.partition("\nFiles\n")[2].partition("\nSelf-test\n")[0], re.MULTILINE)
    assert listed == list(members)
    for expected in (
        "p_camera = R p_radar + t",
        'radar frame "radar": x forward, y left, z up',
        "without it the pairs are 22.9 px off, with it 2.04 px",
        "range_bias_m 0.12",
        "evidence: clicked",
        "AED 1.86 px over 4 pairs",
        *(f"{warning.code}: {warning.message}; {warning.hint}" for warning in corrected.calibration.warnings),
        "python3 selftest.py",
        "sha256sum -c SHA256SUMS",
    ):
        assert expected in words
    assert "NOT IN THIS FILE" not in text
    assert max(map(len, text.splitlines())) <= 110


@pytest.mark.parametrize("evidence", EVIDENCE_LEVELS)
def test_the_readme_explains_what_the_pose_rests_on(evidence, golden):
    data = export(replace(golden, evidence=evidence), "pack").data

    words = " ".join(unpack(data, source="pack")["README.txt"].decode().split())

    assert f"evidence: {evidence}; from the calibration" in words
    assert ("check it on a recording before you use it" in words) == (evidence == "imported_assumed")
    assert read_any(data).evidence == evidence


def test_sha256sum_verifies_the_manifest(corrected, unpacked):
    if shutil.which("sha256sum") is None:
        pytest.skip("sha256sum is not installed")
    folder = unpacked(corrected)

    right = subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=folder, capture_output=True)
    (folder / "camera_info.yaml").write_text("changed")
    wrong = subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=folder, capture_output=True)

    assert (right.returncode, wrong.returncode) == (0, 1)


CHANGES: dict[str, tuple[Callable[[dict[str, bytes]], object], str]] = {
    "changed": (lambda m: m.update({"camera_info.yaml": b""}), "camera_info.yaml was changed after the export"),
    "calibration changed": (
        lambda m: m.update({"calibration.json": m["calibration.json"].replace(b"0", b"1", 1)}),
        "calibration.json was changed after the export",
    ),
    "missing": (lambda m: m.pop("tf/radar_camera.urdf"), "tf/radar_camera.urdf is missing"),
    "added": (lambda m: m.update({"notes.txt": b"mine"}), "notes.txt is not listed in SHA256SUMS"),
    "no manifest": (lambda m: m.pop("SHA256SUMS"), "SHA256SUMS is missing"),
    "damaged manifest": (lambda m: m.update({"SHA256SUMS": b"\xff\n"}), "not a hash and a file name"),
    "not calibration-1": (
        lambda m: m.update(
            {
                "calibration.json": b"{}",
                "SHA256SUMS": re.sub(
                    rb"\w+(?=  calibration)", hashlib.sha256(b"{}").hexdigest().encode(), m["SHA256SUMS"]
                ),
            }
        ),
        "calibration.json is not cocalib/calibration-1",
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_pack_that_contradicts_its_manifest_is_refused(change, members):
    edit, words = CHANGES[change]
    edit(members)

    with pytest.raises(InputError, match=rf"robot\.zip: .*{re.escape(words)}"):
        read_any(pack(members), "robot.zip")


def test_a_pack_zipped_again_with_its_folder_is_read(corrected, members):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.mkdir("robot")
        for name, data in sorted(members.items(), reverse=True):
            archive.writestr(f"robot/{name}", data)

    found = read_any(buffer.getvalue())

    assert found.format == "pack"
    np.testing.assert_array_equal(
        found.camera_from_radar.as_matrix(), corrected.calibration.camera_from_radar.as_matrix()
    )


@pytest.mark.parametrize("name", [known.name for known in FORMATS])
def test_a_format_that_cannot_hold_the_angle_map_says_so_first_with_both_figures(name, corrected):
    written = export(corrected, name, rectified=format_named(name).is_for_rectified)

    without = [note for note in written.notes if note.startswith("NOT IN THIS FILE: the radar's angle map")]
    if name in ("json", "pack"):
        assert without == []
    else:
        assert without == [written.notes[0]]
        assert "22.9 px off, with it 2.04 px" in without[0]


def test_a_calibration_without_a_map_has_no_such_note(golden):
    for known in FORMATS:
        notes = export(golden, known.name, rectified=known.is_for_rectified).notes
        assert not any("angle map" in note for note in notes if known.name != "pack")


def test_the_contents_are_shown_as_text(corrected):
    text = contents_text(export(corrected, "pack"))

    assert "[tf/static_transform.sh]\n#!/bin/sh" in text
    assert "[radar_angle_map.npz]\nazimuth_rad  float64  6" in text


def test_the_code_in_the_pack_has_a_licence_and_names_no_other_package(members):
    for name in ("radar_correction.py", "selftest.py", "radar_correction.hpp", "selftest.cpp"):
        text = members[name].decode()
        assert text.startswith(("# SPDX-License-Identifier: Apache-2.0\n", "// SPDX-License-Identifier: Apache-2.0\n"))
        assert not re.search(r"^\s*(import|from) (calib_core|cocalib)", text, re.MULTILINE)


def test_the_code_in_the_pack_is_the_installed_files(project_root, members):
    delivered = project_root / "calib_core/interchange/formats/delivered"
    names = {path.name for path in delivered.iterdir() if path.is_file() and path.name != "__init__.py"}

    assert names == {"radar_correction.py", "selftest.py", "radar_correction.hpp", "selftest.cpp"}
    for name in names:
        assert members[name] == (delivered / name).read_bytes().replace(b"\r\n", b"\n")
